#!/usr/bin/python3
"""Man pages and completions say what --help says, and the shells offer it.

    option_texts_test.py GONIOD GONIO GONIO_BENCH
"""
import gzip
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAMS = {pathlib.Path(program).name: program for program in sys.argv[1:4]}
sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / 'packaging'))
import option_texts  # noqa: E402

# Each is given a completion and lines of words, and prints a line for each.
BASH = """source "$1"
while read -ra words; do
    COMP_LINE="${words[*]}"; COMP_POINT=${#COMP_LINE}
    _${words[0]//-/_}
    echo "${COMPREPLY[@]}"
done
"""
# The shell's own functions are what it would ask; here they print.
ZSH = """_describe() { local row; for row in ${(P)2}; do print -rn -- "${row%%:*} "; done }
_files() { :; }
compset() { PREFIX=${PREFIX#*=}; }
compadd() { print -n -- ${(P)2}; }
while read -rA words; do
    CURRENT=$#words; PREFIX=${words[-1]}
    source $1
    print
done
"""
FISH = """source $argv[1]
while read line
    set offered (complete -C $line | string replace -r '\\t.*' '')
    echo $offered
end
"""
CASES = (('gonio', 'se', 'set'), ('gonio', 'set', 'li', 'light'), ('gonio', '--server', 'http://127.0.0.1:8080', 'cue', 'as', 'assert'),
         ('gonio', '--server=http://127.0.0.1:8080', 'set', 'lig', 'light'), ('goniod', '--backfaces=c', 'cull'),
         ('gonio', 'set', 'light', 'key', '--le', '--level'), ('gonio', 'grid', 'val', 'values'),
         ('gonio', 'capture', 'a.png', '--qua', '--quality'), ('gonio', 'undo', '--js', '--json'),
         ('goniod', '--backf', '--backfaces'), ('goniod', '--backfaces', 'c', 'cull'), ('gonio-bench', 'par', 'pareto'),
         ('gonio-bench', 'pareto', '--qui', '--quick'))


def help_of(program, *words):
    return subprocess.run([program, *words, '--help'], check=True, capture_output=True, text=True).stdout


def options_in(text):
    """The options that a help lists, at the beginning of lines."""
    return {name for line in re.findall(r'^ +((?:-\w,)?--[\w,-]+)', text, re.M) for name in line.split(',')}


class Texts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.share = pathlib.Path(folder.name) / 'share'
        for program in PROGRAMS.values():
            option_texts.main(program, folder.name, 0)

    def text_of(self, name):
        section = option_texts.SECTIONS.get(name, 1)
        page = gzip.decompress((self.share / f'man/man{section}/{name}.{section}.gz').read_bytes()).decode()
        files = {'bash': f'bash-completion/completions/{name}', 'zsh': f'zsh/vendor-completions/_{name}',
                 'fish': f'fish/vendor_completions.d/{name}.fish'}
        return {'man': page.replace('\\-', '-'), **{shell: (self.share / file).read_text() for shell, file in files.items()}}

    def check(self, name, texts, options):
        self.assertTrue(options, name)
        for option in options:
            for kind, text in texts.items():
                wanted = ' -' + ('l ' + option[2:] if option.startswith('--') else 's ' + option[1:]) if kind == 'fish' else option
                self.assertIn(wanted, text, f'{kind} of {name}')

    def test_all_that_help_lists_stands_in_each(self):
        for name, program in PROGRAMS.items():
            told, texts = option_texts.dump(program), self.text_of(name)
            options = options_in(help_of(program))
            self.assertEqual(options - {'-h'}, {n for o in told['options'] for n in option_texts.dashed(o)} - {'-h'}, name)
            self.check(name, texts, options)
            for command in told['commands'][:2 if name == 'gonio-bench' else None]:  # it takes long to start
                listed = options_in(help_of(program, *command['name'].split())) - {'--help', '-h'}
                held = {n for o in command['options'] for n in option_texts.dashed(o)} - {'--help', '-h'}
                self.assertEqual(listed, held, command['name'])
                if listed:
                    self.check(f'{name} {command["name"]}', texts, listed)

    def test_every_command_of_help_is_known(self):
        listed = re.findall(r'^  ([a-z][a-z-]*(?: [a-z][a-z-]*)?)(?= )', help_of(PROGRAMS['gonio']), re.M)
        names = [command['name'] for command in option_texts.dump(PROGRAMS['gonio'])['commands']]
        self.assertEqual(listed, names)
        self.assertGreater(len(names), 50)

    def offered(self, shell, command, file):
        if not shutil.which(shell):
            self.skipTest(f'there is no {shell}')
        for name in PROGRAMS:
            cases = [case for case in CASES if case[0] == name]
            said = subprocess.run([*command, self.share / file.format(name)], check=True, capture_output=True, text=True,
                                  input=''.join(' '.join(words) + '\n' for *words, _ in cases), env={'HOME': '/nowhere', 'PATH': '/usr/bin:/bin'})
            self.assertEqual(said.stderr, '')
            for (*words, wanted), line in zip(cases, said.stdout.splitlines(), strict=True):
                offered = [word.removeprefix(words[-1].split('=')[0] + '=') for word in line.split()]  # fish: the whole word
                self.assertIn(wanted, offered, words)

    def test_bash_offers(self):
        self.offered('bash', ('bash', '-c', BASH, 'bash'), 'bash-completion/completions/{}')

    def test_zsh_offers(self):
        self.offered('zsh', ('zsh', '-fc', ZSH, 'zsh'), 'zsh/vendor-completions/_{}')

    def test_fish_offers(self):
        self.offered('fish', ('fish', '--no-config', '-c', FISH), 'fish/vendor_completions.d/{}.fish')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])

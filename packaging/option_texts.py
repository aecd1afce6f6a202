#!/usr/bin/python3
"""Man pages and completions, of what a program says of its own options.

    option_texts.py PROGRAM FOLDER [SOURCE_DATE_EPOCH]

asks PROGRAM --dump-options, and writes below FOLDER share/man/manN/NAME.N.gz and the completions of bash, zsh and fish.
"""
import gzip
import json
import pathlib
import subprocess
import sys
import time

SECTIONS = {'goniod': 8}  # others are in section 1
EXTRA = {
    'goniod': """.SH FILES
.TP
.I /etc/goniod/goniod.toml
the options of the service
.TP
.I /etc/goniod/token
the token that clients of the service show
.TP
.I /var/lib/goniod
the service's saved show, shows and uploads
.SH ENVIRONMENT
Each option has a variable: \\fBGONIOD_MAX_CLIENTS\\fR of \\fB\\-\\-max\\-clients\\fR. The command line wins over it, and it
over the file of \\fB\\-\\-config\\fR.
.SH EXIT STATUS
0: ended as asked. 1: a job failed, or the doctor found a fault. 2: an argument is wrong, or a file that one names. 69: no
GL, no encoder, or the port is taken. 75: a job of \\fB\\-\\-oneshot\\fR was stopped, or a file of its sequence could not be
written: the same command goes on. 78: the file, a variable or the job is wrong, or options do not go together. 128 + 2 or 15:
a second SIGINT or SIGTERM.
""",
    'gonio': """.SH ENVIRONMENT
.TP
.B GONIO_SERVER
the server's URL; default: http://127.0.0.1:8080
.SH EXIT STATUS
0: done. 1: refused by the server. 2: usage. 3: unreachable.
""",
}
SEE_ALSO = {'goniod': 'gonio (1)', 'gonio': 'goniod (8), gonio\\-bench (1)', 'gonio-bench': 'goniod (8)'}


def dump(program):
    return json.loads(subprocess.run([program, '--dump-options'], check=True, capture_output=True, text=True).stdout)


def long_names(option):
    return [name for name in option['names'] if name.startswith('--')]


def dashed(option):
    return [name for name in option['names'] if name.startswith('-')]


def offered(options):
    """Each name once, in order: options of a command come before those of all."""
    seen = {}
    for option in options:
        for name in dashed(option):
            seen.setdefault(name, option)
    return seen


# ---- man

def troff(text):
    text = text.replace('\\', '\\e').replace('-', '\\-')
    return '\\&' + text if text[:1] in ".'" else text


def man_option(option):
    value = f' \\fI{troff(option["value"])}\\fR' if option['value'] and dashed(option) else ''
    names = ', '.join(f'\\fB{troff(name)}\\fR' for name in option['names'])
    more = []
    if option['choices']:
        more.append('One of: ' + ', '.join(option['choices']) + '.')
    if option['default'] not in ('', '[]') and 'default:' not in option['help'].lower():
        more.append(f'Default: {option["default"]}.')
    text = '. '.join([option['help'].rstrip('.')] + [' '.join(more)]) if more else option['help']
    return f'.TP\n{names}{value}\n{troff(text or "prints it")}\n'


def man(told, seconds):
    name, section = told['program'], SECTIONS.get(told['program'], 1)
    about = told['help'].split(': ', 1)[-1]
    day = time.strftime('%Y-%m-%d', time.gmtime(seconds))
    page = f'.TH {name.upper()} {section} {day} "Gonio {told["version"]}" "Gonio"\n.SH NAME\n{troff(name)} \\- {troff(about)}\n'
    page += f'.SH SYNOPSIS\n.B {troff(name)}\n[options]' + (' \\fICOMMAND\\fR' if told['commands'] else '') + '\n'
    groups = {}
    for option in told['options']:
        groups.setdefault(option['group'], []).append(option)
    for group, options in groups.items():
        page += '.SH OPTIONS\n' if group == 'Options' else f'.SS {troff(group)}\n'
        page += ''.join(man_option(option) for option in options)
    if told['commands']:
        page += '.SH COMMANDS\n'
    for command in told['commands']:
        words = ' '.join(f'\\fI{troff(word["names"][0])}\\fR' for word in command['names'])
        page += f'.SS {troff(command["name"])} {words}\n{troff(command["help"])}\n'
        page += ''.join(man_option(option) for option in command['names'] + command['options'])
    page += EXTRA.get(name, '')
    page += f'.SH SEE ALSO\n{SEE_ALSO[name]}; /usr/share/doc/gonio\n'
    return page


# ---- completions: of the words before the cursor the command is found, then its words and options are offered

def first_words(told):
    return list(dict.fromkeys(command['name'].split()[0] for command in told['commands']))


def second_words(told):
    groups = {}
    for command in told['commands']:
        first, *rest = command['name'].split()
        if rest:
            groups.setdefault(first, []).append(rest[0])
    return groups


def common_values(told):
    """Options before the command that take the next word, as a pattern of case."""
    return '|'.join(name for option in told['options'] if option['value'] for name in dashed(option)) or '--'


def quote(text):
    return "'" + text.replace("'", "'\\''") + "'"


FIND_COMMAND = """    local command='' first='' skip='' word
    for word in "${%(before)s}"; do
        if [[ -n $skip ]]; then
            skip=''
            continue
        fi
        case $word in
            %(values)s) skip=1 ;;
            -*) ;;
            *)
                case "$first $word" in
                    %(whole)s) command="${first:+$first }$word"; break ;;
                    %(parts)s) first=$word ;;
                    *) break ;;
                esac ;;
        esac
    done
"""


def find_command(told, before):
    if not told['commands']:
        return "    local command=''\n"
    whole = '|'.join(quote(name if ' ' in name else ' ' + name) for name in (c['name'] for c in told['commands']))
    parts = '|'.join(quote(' ' + first) for first in second_words(told)) or quote('-')
    return FIND_COMMAND % {'before': before, 'values': common_values(told), 'whole': whole, 'parts': parts}


def tables(told):
    """Of each command, '' for none: its name, its options beside those of all, and the words that may follow."""
    common = told['options']
    yield '', common, first_words(told) if told['commands'] else []
    for command in told['commands']:
        yield command['name'], command['options'] + common, []


def value_cases(word, options, choose, otherwise):
    """Where an option stands before the cursor: its choices by choose(choices), what else it takes by `otherwise`."""
    text = f'            case "${word}" in\n'
    for one, option in offered(options).items():
        if option['choices']:
            text += f'                {one}) {choose(option["choices"])}; return ;;\n'
    free = [one for one, option in offered(options).items() if option['value'] and not option['choices']]
    return text + f'                {"|".join(free) or "--"}) {otherwise}return ;;\n            esac ;;\n'


# Bash makes several words of http://HOST:PORT and of --server=URL; here blanks alone part them.
BASH_WORDS = """    local options='' words='' cur='' before=() line=${COMP_LINE:0:COMP_POINT}
    COMPREPLY=()
    read -ra before <<< "${line#*[[:blank:]]}"
    if [[ $line == *[^[:blank:]] ]]; then
        cur=${before[-1]}
        unset 'before[-1]'
    fi
    local prev=''
    (( ${#before[@]} )) && prev=${before[-1]}
    if [[ $cur == --*=* ]]; then
        prev=${cur%%=*} cur=${cur#*=}
    fi
"""


def bash(told):
    name = told['program'].replace('-', '_')
    text = f'# bash completion of {told["program"]}, written by packaging/option_texts.py\n_{name}()\n{{\n'
    text += BASH_WORDS
    text += find_command(told, 'before[@]')
    text += '    case "$command" in\n'
    for command, options, words in tables(told):
        text += f'        {quote(command)})\n            options={quote(" ".join(offered(options)))}\n'
        if words:
            text += '            case "$first" in\n'
            for first, seconds in second_words(told).items():
                text += f'                {first}) words={quote(" ".join(seconds))} ;;\n'
            text += f'                *) words={quote(" ".join(words))} ;;\n            esac\n'
        # What an option takes: choices, or files by -o default.
        text += value_cases('prev', options, lambda choices: f'COMPREPLY=($(compgen -W {quote(" ".join(choices))} -- "$cur"))', '')
    text += '    esac\n    [[ $cur == -* ]] && words=$options\n    COMPREPLY=($(compgen -W "$words" -- "$cur"))\n}\n'
    return text + f'complete -o default -F _{name} {told["program"]}\n'


def described(name, help_text):
    return quote(name.replace(':', '\\:') + ':' + help_text.replace('\\', '\\\\'))


def zsh(told):
    name = told['program']
    text = f'#compdef {name}\n# written by packaging/option_texts.py\n_{name}() {{\n'
    text += '    local -a before options commands choices\n    before=("${(@)words[2,CURRENT-1]}")\n    local previous=${words[CURRENT-1]}\n'
    text += "    if [[ $PREFIX == --*=* ]]; then\n        previous=${PREFIX%%=*}\n        compset -P '*='\n    fi\n"
    text += find_command(told, '(@)before')
    text += '    case "$command" in\n'
    for command, options, first in tables(told):
        text += f'        {quote(command)})\n            options=({" ".join(described(one, o["help"]) for one, o in offered(options).items())})\n'
        if first:
            helps = {c['name']: c['help'] for c in told['commands']}
            text += '            case "$first" in\n'
            for one, seconds in second_words(told).items():
                rows = ' '.join(described(second, helps[f'{one} {second}']) for second in seconds)
                text += f'                {one}) commands=({rows}) ;;\n'
            rows = ' '.join(described(one, helps.get(one, '')) for one in first)
            text += f'                *) commands=({rows}) ;;\n            esac\n'
        text += value_cases('previous', options, lambda choices: f'choices=({" ".join(map(quote, choices))}); compadd -a choices', '_files; ')
    text += '    esac\n    if [[ $PREFIX == -* ]]; then\n        _describe option options\n'
    text += '    elif (( $#commands )); then\n        _describe command commands\n    else\n        _files\n    fi\n}\n'
    return text + f'_{name} "$@"\n'


def fish_text(text):
    return "'" + text.replace('\\', '\\\\').replace("'", "\\'") + "'"


def fish_option(told, option, condition):
    line = f'complete -c {told["program"]}' + (f' -n {fish_text(condition)}' if condition else '')
    for one in dashed(option):
        line += f' -l {one[2:]}' if one.startswith('--') else f' -s {one[1:]}'
    if option['choices']:
        line += f' -x -a {fish_text(" ".join(option["choices"]))}'
    elif option['value']:
        line += ' -r'
    return line + f' -d {fish_text(option["help"])}\n'


def fish(told):
    program = told['program']
    at = f'__{program.replace("-", "_")}_at'
    text = f'# fish completion of {program}, written by packaging/option_texts.py\n'
    if told['commands']:
        names = ' '.join(fish_text(command['name']) for command in told['commands'])
        groups = ' '.join(second_words(told)) or "''"
        values = ' '.join(common_values(told).split('|'))
        text += f"""function {at} --description 'the command before the cursor is the argument'
    set -l first
    set -l skip
    for word in (commandline -opc)[2..-1]
        if set -q skip[1]
            set -e skip
            set -l skip
        else if contains -- $word {values}
            set skip 1
        else if not string match -q -- '-*' $word
            if contains -- "$first $word" {names}
                test "$argv[1]" = "$first $word"
                return
            else if test -z "$first"; and contains -- $word {names}
                test "$argv[1]" = $word
                return
            else if test -z "$first"; and contains -- $word {groups}
                set first $word
            else
                break
            end
        end
    end
    test "$argv[1]" = "of $first"
end
"""
        for first in first_words(told):
            helps = {command['name']: command['help'] for command in told['commands']}
            where = fish_text(f"{at} 'of '")
            text += f'complete -c {program} -f -n {where} -a {first} -d {fish_text(helps.get(first, ""))}\n'
        for first, seconds in second_words(told).items():
            where = fish_text(f"{at} 'of {first}'")
            for second in seconds:
                text += f'complete -c {program} -f -n {where} -a {second} -d {fish_text(helps[f"{first} {second}"])}\n'
        for command in told['commands']:
            for option in command['options']:
                text += fish_option(told, option, f"{at} '{command['name']}'")
    return text + ''.join(fish_option(told, option, '') for option in told['options'])


def main(program, folder, seconds=0):
    told = dump(program)
    name, share = told['program'], pathlib.Path(folder) / 'share'
    section = SECTIONS.get(name, 1)
    files = {share / 'bash-completion/completions' / name: bash(told),
             share / 'zsh/vendor-completions' / f'_{name}': zsh(told),
             share / 'fish/vendor_completions.d' / f'{name}.fish': fish(told)}
    for path, text in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    page = share / f'man/man{section}' / f'{name}.{section}.gz'
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_bytes(gzip.compress(man(told, int(seconds)).encode(), 9, mtime=0))


if __name__ == '__main__':
    main(*sys.argv[1:])

"""Retired words (docs/glossary.md) that stand in code: names, not comments or text in quotes."""
import pathlib
import re
import sys

CODE = ('.cpp', '.h', '.glsl', '.vert', '.frag', '.comp')


def retired(glossary):
    """The words of the glossary's second table -> what is said now."""
    rows = re.findall(r'^\| (`.*?`) \| (.*?) \|$', glossary[glossary.index('## Retired words'):], re.M)
    return {word: now for words, now in rows for word in re.findall(r'`([^`]+)`', words)}


def names_of(text):
    """A source without comments, text in quotes and includes; lines keep their numbers."""
    text = re.sub(r'^#include.*$', '', text, flags=re.M)
    return re.sub(r'//.*|"(?:[^"\\\n]|\\.)*"', '', text)


def pattern_of(word):
    """A whole name; …word… also as a part of one, as in learn_wish, kMaxWish, wishes_."""
    part = word.strip('…')
    if part == word:
        return r'\b' + re.escape(word) + r'\b'
    capital = part[0].upper() + part[1:]
    return rf'\w*(?:(?<![A-Za-z]){part}|{capital})(?:e?s)?(?![a-z])\w*'


def found(name, text, words):
    """A line for each retired word of a source."""
    text = names_of(text)
    # Few words stand anywhere in a source; only those are looked for line by line.
    whole = text.lower()
    here = [(re.compile(pattern_of(word)), words[word]) for word in words if word.strip('…').lower() in whole]
    return [f'{name}:{number}: {match[0]}; say {now}'
            for number, line in enumerate(text.split('\n'), 1) for pattern, now in here
            for match in pattern.finditer(line)]


def main(root):
    root = pathlib.Path(root)
    words = retired((root / 'docs/glossary.md').read_text())
    files = [file for top in ('ies', 'protocol', 'server', 'client', 'shaders') for file in root.glob(top + '/**/*')
             if file.suffix in CODE]
    lines = [line for file in sorted(files) for line in found(str(file.relative_to(root)), file.read_text(), words)]
    print('\n'.join(lines))
    print(f'{len(lines)} retired words in {len(files)} files')
    return 1 if lines else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))

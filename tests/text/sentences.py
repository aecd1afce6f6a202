"""The sentences of README, docs and header comments that are longer than a reader can hold; a test fails on each.

Words are what blanks separate, in code spans too. A cell of a table, a heading and a point of a list are paragraphs.
Code blocks, formulas that are indented, and links' addresses are no sentences.
"""
import pathlib
import re
import sys

MOST_WORDS = 30
END = re.compile(r'(?<=[.!?])["\')”]*\s+(?=[A-Z0-9"“`(\[*_])')


def sentences(text):
    """The sentences of plain text, each as its words; an empty line ends one too."""
    return [words for block in re.split(r'\n\s*\n', text) for sentence in END.split(block)
            if (words := sentence.split())]


def prose_of_markdown(text):
    """Markdown without what is no sentence."""
    text = re.sub(r'^( *)```.*?^ *```', '', text, flags=re.S | re.M)
    text = re.sub(r'<!--.*?-->', '', text, flags=re.S)
    text = re.sub(r'(?<=\n\n)(?: {4,}.*[=←].*\n)+', '\n', text)  # formulas
    text = re.sub(r'!?\[([^\]]*)\]\([^)]*\)', r'\1', text)
    text = re.sub(r'^ *\|.*$', lambda row: row.group().replace('|', '\n\n'), text, flags=re.M)
    text = re.sub(r'^(#+ .*)$', r'\n\1\n', text, flags=re.M)
    # A point of a list is a paragraph.
    return re.sub(r'^( *(?:[-*]|\d+\.) )', r'\n\1', text, flags=re.M)


def prose_of_header(text):
    """The comments of a C++ header; what stands beside code is a paragraph of its own."""
    lines = []
    for line in text.split('\n'):
        whole = re.match(r'\s*//\s?(.*)', line)
        beside = re.search(r'\S.*?\s//\s(.*)', line)
        lines.append(whole.group(1) if whole else '\0' + beside.group(1) + '\0' if beside else '\0')
    return '\n'.join(lines).replace('\0', '\n')


def too_long(name, text):
    """A line for each sentence of a file that has too many words."""
    prose = prose_of_header(text) if name.endswith('.h') else prose_of_markdown(text)
    return [f'{name}: {len(words)} words: {" ".join(words[:8])} …' for words in sentences(prose)
            if len(words) > MOST_WORDS]


def main(root):
    root = pathlib.Path(root)
    files = [root / 'README.md', root / 'CONTRIBUTING.md', root / 'protocol/schema/PROTOCOL.md',
             *root.glob('docs/**/*.md'), *root.glob('*/README.md')]
    for top in ('ies', 'protocol', 'server', 'client', 'shaders'):
        files += root.glob(top + '/**/*.h')
    found = [line for file in sorted(set(files))
             for line in too_long(str(file.relative_to(root)), file.read_text())]
    print('\n'.join(found))
    print(f'{len(found)} sentences of more than {MOST_WORDS} words')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))

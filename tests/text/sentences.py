"""The sentences of README, docs and header comments that are longer than a reader can hold; a test fails on each.

Tables, code, links' addresses and headings are no sentences. A formula in backquotes counts as one word.
"""
import pathlib
import re
import sys

MOST_WORDS = 35
# Headers with longer ones still: the list only shrinks.
NOT_YET = set('''
    ies/eulumdat.h ies/opening.h ies/quantities.h ies/text_encoding.h ies/web.h ies/writers.h
    protocol/dmx/source_row.h protocol/schema/frame_header.h protocol/text/text_bytes.h server/assets/assets.h
    server/assets/gltf_import.h server/assets/mesh_builder.h server/base/memory_room.h server/base/metrics.h
    server/lighting/direct.h server/lighting/display.h server/lighting/final_gather.h
    server/lighting/kernels.h server/lighting/layers.h server/lighting/raster.h server/lighting/upsample.h
    server/render/graph.h server/render/live_renderer.h server/render/renderer.h server/scene/console.h
    server/scene/direction_table.h server/session/capture_file.h server/show/saved_show.h
    server/show/state_file.h server/stream/lanes.h server/stream/video_gate.h server/trace/reference.h
    server/transport/solve.h server/transport/transport.h
'''.split())
END = re.compile(r'(?<=[.!?])["\')”]*\s+(?=[A-Z0-9"“`(\[*_])')


def sentences(text):
    """The sentences of plain text, each as its words; an empty line ends one too."""
    return [words for block in re.split(r'\n\s*\n', text) for sentence in END.split(block)
            if (words := re.findall(r'[^\W_]\S*', sentence))]


def blank(match):
    return re.sub(r'[^\n]', ' ', match.group())


def prose_of_markdown(text):
    """Markdown without what is no sentence; lines keep their numbers."""
    text = re.sub(r'^```.*?^```', blank, text, flags=re.S | re.M)
    text = re.sub(r'^( *\||#).*$', '', text, flags=re.M)
    text = re.sub(r'<!--.*?-->', blank, text, flags=re.S)
    text = re.sub(r'`[^`\n]+`', 'code', text)
    text = re.sub(r'!?\[([^\]]*)\]\([^)]*\)', r'\1', text)
    # A point of a list is a paragraph.
    return re.sub(r'^( *(?:[-*]|\d+\.) )', r'\n\1', text, flags=re.M)


def prose_of_header(text):
    """The comments of a C++ header; what stands beside code is a paragraph of its own."""
    lines = []
    for line in text.split('\n'):
        whole = re.match(r'\s*//\s?(.*)', line)
        beside = re.search(r'\S.*?\s//\s(.*)', line)
        lines.append(whole.group(1) if whole else '\0' + beside.group(1) + '\0' if beside else '\0')
    return re.sub(r'`[^`\n]+`', 'code', '\n'.join(lines)).replace('\0', '\n')


def too_long(name, text):
    """A line for each sentence of a file that has too many words."""
    prose = prose_of_header(text) if name.endswith('.h') else prose_of_markdown(text)
    return [f'{name}: {len(words)} words: {" ".join(words[:8])} …' for words in sentences(prose)
            if len(words) > MOST_WORDS]


def main(root):
    root = pathlib.Path(root)
    files = [root / 'README.md', root / 'CONTRIBUTING.md', *root.glob('docs/**/*.md'), *root.glob('*/README.md')]
    for top in ('ies', 'protocol', 'server', 'client', 'shaders'):
        files += root.glob(top + '/**/*.h')
    found = [line for file in sorted(set(files)) if 'notebook' not in file.parts and str(file.relative_to(root)) not in NOT_YET
             for line in too_long(str(file.relative_to(root)), file.read_text())]
    print('\n'.join(found))
    print(f'{len(found)} sentences of more than {MOST_WORDS} words')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))

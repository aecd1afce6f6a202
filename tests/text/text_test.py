"""The project's prose and words keep to their rules (CONTRIBUTING.md), and each check can fail."""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import sentences  # noqa: E402
import words  # noqa: E402

ROOT = pathlib.Path(__file__).parents[2]
LONG = ' '.join(['word'] * (sentences.MOST_WORDS + 1)) + '.'


class Sentences(unittest.TestCase):
    def test_the_tree_has_no_long_one(self):
        self.assertEqual(sentences.main(ROOT), 0)

    def test_a_long_one_is_found(self):
        self.assertEqual(len(sentences.too_long('a.md', 'A short one. A ' + LONG)), 1)
        self.assertEqual(len(sentences.too_long('a.h', '// A ' + LONG.replace('word word', 'word\n// word', 1))), 1)

    def test_it_may_stand_in_a_cell_a_list_a_heading_or_code(self):
        for text in ('| a | ' + LONG + ' |\n', '- ' + LONG, '1. a\n\n    ' + LONG, '# ' + LONG, '`' + LONG + '`',
                     LONG.replace('word word', '`word` = word;', 1), LONG.replace('word word', 'word\nword', 1)):
            self.assertEqual(len(sentences.too_long('a.md', text)), 1, text)

    def test_what_is_no_sentence_is_left_out(self):
        for text in ('```\n' + LONG + '\n```', '1. a\n\n   ```\n   ' + LONG + '\n   ```\n', 'a\n\n    x = ' + LONG + '\n',
                     LONG.replace('word word', 'word\n\nword', 1), LONG.replace('word word', 'word | word', 1).join('||')):
            self.assertEqual(sentences.too_long('a.md', text), [])
        self.assertEqual(sentences.too_long('a.h', LONG), [])


class Words(unittest.TestCase):
    def test_the_tree_has_no_retired_one(self):
        self.assertEqual(words.main(ROOT), 0)

    def test_a_retired_one_is_found(self):
        retired = words.retired((ROOT / 'docs/glossary.md').read_text())
        self.assertGreater(len(retired), 10)
        self.assertEqual(words.found('a.cpp', 'int a;\nLedger b;\n', retired), ['a.cpp:2: Ledger; say pass cache'])

    def test_comments_text_and_other_words_are_left_out(self):
        retired = words.retired((ROOT / 'docs/glossary.md').read_text())
        self.assertEqual(words.found('a.cpp', '// a Hub\nf("Hub");\nHubs c;\nemail d;\n', retired), [])

    def test_words_between_dots_are_found_inside_names(self):
        retired = words.retired((ROOT / 'docs/glossary.md').read_text())
        for name in ('learn_wish', 'wishes_', 'kMaxWish', 'LaneWishes'):
            self.assertEqual(words.found('a.cpp', f'int {name};\n', retired), [f'a.cpp:1: {name}; say request'])


if __name__ == '__main__':
    unittest.main()

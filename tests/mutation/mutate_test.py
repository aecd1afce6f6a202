"""What tests/mutation/mutate.py makes of lines."""
import unittest

import mutate


def made(line):
    return {new for _, new in mutate.mistakes(line)}


class Mistakes(unittest.TestCase):
    def test_conditions_operators_and_constants(self):
        self.assertEqual(made("if (a < 2) b();"),
                         {"if (!(a < 2)) b();", "if (a <= 2) b();", "if (a < 3) b();"})
        self.assertEqual(made("const float half = 0.5f;"), {"const float half = 1.0f;"})
        self.assertEqual(made("const double none = 0.0;"), {"const double none = 1.0;"})

    def test_statements(self):
        self.assertIn("    ;", made("    sum += value;"))
        self.assertIn("    ;", made("    keep(a, b);"))
        self.assertIn("    keep(b, a);", made("    keep(a, b);"))
        self.assertNotIn(";", made("const int a = b;"))
        self.assertEqual(made("return found;"), set())

    def test_strings_comments_and_preprocessor(self):
        self.assertEqual(made('say("a < 2");'), {";"})
        self.assertEqual(made("// if (a < 2)"), set())
        self.assertEqual(made("}  // a < 2"), set())
        self.assertEqual(made("#define MOST 2"), set())


if __name__ == "__main__":
    unittest.main()

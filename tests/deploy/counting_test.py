"""Files of tests that skip some do not end as those that ran all."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import counting

BEGINNING = """
import unittest
import counting
class Given(unittest.TestCase):
    def test_good(self): pass
"""
SKIPS = """    @unittest.skip("no tool")
    def test_skips(self): pass
"""
FAILS = """    def test_fails(self): self.fail()
"""
NOTHING_IS_HERE = """
def setUpModule(): raise unittest.SkipTest("no tools at all")
"""
END = """
counting.main()
"""


class Endings(unittest.TestCase):
    def ended(self, *parts):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "given.py"
            file.write_text("".join([BEGINNING, *parts, END]))
            return subprocess.run([sys.executable, file], capture_output=True, text=True, check=False,
                                  env={"PYTHONPATH": str(pathlib.Path(__file__).parent), "PYTHONDONTWRITEBYTECODE": "1"})

    def test_all_that_ran_well_is_0(self):
        self.assertEqual(self.ended().returncode, 0)

    def test_one_that_was_skipped_is_told_of_and_77(self):
        done = self.ended(SKIPS)
        self.assertEqual(done.returncode, counting.SKIPPED)
        self.assertRegex(done.stdout, r"SKIPPED: test_skips .*: no tool\n")

    def test_a_file_that_lacks_what_all_need_is_77(self):
        done = self.ended(NOTHING_IS_HERE)
        self.assertEqual(done.returncode, counting.SKIPPED)
        self.assertIn("no tools at all", done.stdout)

    def test_a_failure_counts_before_what_was_skipped(self):
        self.assertEqual(self.ended(SKIPS, FAILS).returncode, 1)


if __name__ == "__main__":
    counting.main()

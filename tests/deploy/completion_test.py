"""Tests the completion scripts that the programs print, in bash and in zsh.

  completion_test.py FOLDER-OF-THE-PROGRAMS
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import counting

PROGRAMS = pathlib.Path(sys.argv.pop(1))
DRIVER = {
    # Sets the variables and arguments that bash passes to a completion function.
    "bash": 'COMP_WORDS=("${@:2}"); COMP_CWORD=$(($# - 2)); "_$2" "$2" "$1" && printf "%s\\n" "${COMPREPLY[@]}"',
    # Replaces functions of zsh. Prints each offered word after the prefix that compset removed.
    "zsh": """compset() { local taken=${(M)PREFIX##${~2}}; [[ -z $taken ]] || { PREFIX=${PREFIX##${~2}}; BEFORE+=$taken; } }
_describe() { local each; for each in ${(P)2}; do [[ ${each%%:*} != $PREFIX* ]] || print -r -- $BEFORE${each%%:*}; done }
_files() { : }
words=("${@:2}"); CURRENT=${#words}; PREFIX=$1; BEFORE=; _$words[1]""",
}


class Completion(unittest.TestCase):
    shell = "bash"

    def setUp(self):
        if shutil.which(self.shell) is None:
            self.skipTest(f"{self.shell} is not installed")

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="oblique-completion-"))
        for program in "oblique", "oblique-server", "oblique-worker":
            done = subprocess.run([PROGRAMS / program, "completion", cls.shell], capture_output=True, text=True, check=True)
            (cls.folder / program).write_text(done.stdout)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def offers(self, program, *words, word=None):
        """Returns the completions of the last word, or of `word` if bash would pass only that part of it."""
        words = [program, *words]
        script = f"{'compdef() { : }; ' if self.shell == 'zsh' else ''}. '{self.folder / program}'; {DRIVER[self.shell]}"
        done = subprocess.run([self.shell, "-c", script, self.shell, words[-1] if word is None else word, *words],
                              capture_output=True, text=True, check=True)
        self.assertEqual(done.stderr, "")
        return [line for line in done.stdout.splitlines() if line]

    def test_verbs(self):
        self.assertEqual(self.offers("oblique", "stu"), ["study", "studies"])
        self.assertEqual(self.offers("oblique", "keys", "re"), ["revoke"])
        self.assertEqual(self.offers("oblique", "autoscale", ""), ["slurm"])

    def test_flags(self):
        self.assertEqual(self.offers("oblique", "query", "x", "--whe"), ["--where"])
        self.assertEqual(self.offers("oblique", "keys", "add", "x", "--rol"), ["--role"])
        self.assertEqual(self.offers("oblique-server", "--http-tok"), ["--http-token-file"])
        self.assertEqual(self.offers("oblique-worker", "--idle"), ["--idle-exit"])
        self.assertEqual([flag for flag in self.offers("oblique", "run", "--len") if flag[-1].isdigit()], [])

    def test_choices(self):
        self.assertEqual(self.offers("oblique", "query", "x", "--format", "js"), ["json", "jsonl"])
        self.assertEqual(self.offers("oblique", "solve", "--integrator", ""), ["explicit", "generalized-alpha"])
        self.assertEqual(self.offers("oblique-server", "--quiet", "--log-level", "wa"), ["warning"])

    def test_columns_in_lists_and_conditions(self):
        self.assertEqual(self.offers("oblique", "query", "x", "--select", "mu,eta"), ["mu,eta2"])
        self.assertEqual(self.offers("oblique", "query", "x", "--where", "mu > 0.5 AND eta"), ["mu > 0.5 AND eta2"])

    def test_file_names_are_left_to_the_shell(self):
        for words in (["query", "--db", "obl"], ["run", "a"], ["query", "x", "--limit", ""]):
            self.assertEqual(self.offers("oblique", *words), [], words)

    def test_a_value_behind_an_equals_sign(self):
        self.assertEqual(self.offers("oblique", "query", "x", "--format", "=", "js"), ["json", "jsonl"])
        self.assertEqual(self.offers("oblique", "query", "x", "--format", "=", word=""),
                         self.offers("oblique", "query", "x", "--format", ""))

    def test_another_shell_is_wrong_usage(self):
        done = subprocess.run([PROGRAMS / "oblique", "completion", "fish"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (2, ""))


class CompletionOfZsh(Completion):
    shell = "zsh"

    def test_a_value_behind_an_equals_sign(self):
        self.assertEqual(self.offers("oblique", "query", "x", "--format=js"), ["--format=json", "--format=jsonl"])


if __name__ == "__main__":
    counting.main()

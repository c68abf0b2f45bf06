"""Compares flags, help, manual pages and completion of every program and command.

  flags_test.py TREE FOLDER-OF-THE-PROGRAMS
"""
import functools
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import counting

TREE = pathlib.Path(sys.argv.pop(1)).resolve()
PROGRAMS = pathlib.Path(sys.argv.pop(1)).resolve()


@functools.cache
def output_of(*words):
    done = subprocess.run([PROGRAMS / words[0], *words[1:]], capture_output=True, text=True, check=False,
                          env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"})
    return done.stdout if done.returncode == 0 else ""


def help_of(words):
    return output_of(*words, "--help")


def offered(words):
    """Returns the commands and flags that completion offers after `words`."""
    done = subprocess.run(["bash", "-c", f'{output_of(words[0], "completion", "bash")}\n"_$1_offers" "${{*:2}}" && printf "%s\\n" "${{offers[@]}}"',
                           "bash", *words], capture_output=True, text=True, check=True)
    return done.stdout.split()


def verbs_below(words):
    """Returns the words of all commands below `words`, and first `words` itself."""
    listed = re.search(r"^Subcommands:\n((?:  .*\n)+)", help_of(words), re.M)
    names = re.findall(r"^  ([a-z][\w-]*)", listed[1], re.M) if listed else []
    return [words] + [verb for name in names for verb in verbs_below([*words, name])]


VERBS = verbs_below(["oblique"]) + [["oblique-server"], ["oblique-worker"]]


def flags_in_help(words):
    return set(re.findall(r"^  (?:-\w,)?(--[\w-]+)", help_of(words), re.M))


def numbered_in_help(words):
    """Returns names of numbered flags, such as --length for "--length1, --length2, ..."."""
    return set(re.findall(r"(--[\w-]+?)1, \1(?:2), \.\.\.", help_of(words)))


def examples_of(words):
    block = re.search(r"^Examples:\n((?:  .*\n)+)", help_of(words), re.M)
    lines = block[1].splitlines() if block else []
    return [line.strip() for line in lines + re.findall(r"^Example: (.*)", help_of(words), re.M)]


class HelpAndCompletion(unittest.TestCase):
    def test_there_are_verbs_and_flags(self):
        self.assertGreater(len(VERBS), 30)
        self.assertGreater(sum(len(flags_in_help(words)) for words in VERBS), 400)

    def test_completion_has_the_verbs_of_help(self):
        for words in VERBS:
            below = [verb[-1] for verb in VERBS if verb[:-1] == words]
            if below:
                self.assertEqual([word for word in offered(words) if not word.startswith("-")], below)

    def test_completion_has_the_flags_of_help(self):
        for words in VERBS:
            self.assertEqual({word for word in offered(words) if word.startswith("-")}, flags_in_help(words), words)

    def test_numbered_flags_are_listed_once(self):
        self.assertGreater(sum(len(numbered_in_help(words)) for words in VERBS), 3)

    def test_examples_use_existing_flags(self):
        seen = 0
        for words in VERBS:
            for example in examples_of(words):
                typed = shlex.split(re.split("  +", example)[0], comments=False)
                if "VERB" in typed or typed[0] not in ("oblique", "oblique-server", "oblique-worker"):
                    continue
                verb = max((v for v in VERBS if typed[:len(v)] == v), key=len)
                for flag in (word.split("=")[0] for word in typed if re.fullmatch(r"--[\w-]+(=\S*)?", word)):
                    known = flags_in_help(verb) | {name + str(n) for name in numbered_in_help(verb) for n in range(1, 65)}
                    self.assertIn(flag, known, example)
                    seen += 1
        self.assertGreater(seen, 100)

    def test_every_verb_has_an_example(self):
        for words in VERBS:
            self.assertNotEqual(examples_of(words if help_of(words).find("Example") >= 0 else words[:-1]), [], words)


@unittest.skipUnless(shutil.which("help2man"), "there is no help2man")
class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="oblique-pages-"))
        subprocess.run([TREE / "proto/program/manual/pages", PROGRAMS, cls.folder / "first"], check=True)
        cls.pages = {page.stem: page.read_text() for page in (cls.folder / "first").glob("*/*.1")}

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def page_of(self, words):
        return self.pages["-".join(words[:2])]

    def test_each_program_and_verb_has_one(self):
        self.assertEqual(set(self.pages), {"-".join(words[:2]) for words in VERBS})
        self.assertEqual([p.name for p in (self.folder / "first/server").iterdir()], ["oblique-server.1"])
        self.assertEqual([p.name for p in (self.folder / "first/worker").iterdir()], ["oblique-worker.1"])

    def test_pages_have_the_flags_of_help(self):
        for name, page in self.pages.items():
            listed = re.findall(r"^\.[TH]P\n(?:\\fB\\-\w\\fR, )?\\fB(\\-\\-[\w\\-]+)\\fR", page, re.M)
            of_help = set().union(*(flags_in_help(words) for words in VERBS if "-".join(words[:2]) == name))
            self.assertEqual({flag.replace("\\-", "-") for flag in listed}, of_help, name)

    def test_pages_have_the_examples_of_help(self):
        for words in VERBS:
            text = self.page_of(words)
            for plain, roff in {"-": "\\-", "'": "\\(aq"}.items():
                text = text.replace(roff, plain)
            text = text.replace("\\e\n    ", "").replace("\\e", "\\")
            for example in examples_of(words):
                self.assertIn(re.split("  +", example)[0] + "\n", text)

    def test_pages_have_their_sections(self):
        for name, page in self.pages.items():
            sections = re.findall(r'^\.SH "?([A-Z ]+)"?$', page, re.M)
            for section in ("NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS", "ENVIRONMENT", "EXAMPLES", "SEE ALSO"):
                self.assertIn(section, sections, name)
            self.assertEqual("--db FILE" in page.replace("\\-", "-").replace("\\fR", ""), ".SH FILES" in page and "oblique.db" in page, name)

    def test_pages_named_in_pages_exist(self):
        for name, page in self.pages.items():
            named = re.findall(r"\\fB([\w\\-]+)\\fR\(1\)", page)
            self.assertGreater(len(named), 0, name)
            for other in named:
                self.assertIn(other.replace("\\-", "-"), self.pages, name)

    @counting.full
    def test_pages_contain_neither_the_folder_nor_the_time_of_the_build(self):
        copied = self.folder / "elsewhere/bin"
        copied.parent.mkdir()
        copied.symlink_to(PROGRAMS.resolve())
        subprocess.run([TREE / "proto/program/manual/pages", copied, self.folder / "second"], check=True, cwd="/",
                       env={**os.environ, "TZ": "Asia/Tokyo", "SOURCE_DATE_EPOCH": "1"})
        self.assertEqual({page.stem: page.read_text() for page in (self.folder / "second").glob("*/*.1")}, self.pages)
        for name, page in self.pages.items():
            self.assertIn('"@DATE@"', page, name)
            for place in (str(PROGRAMS.parent.resolve()), str(TREE.resolve()), str(self.folder)):
                self.assertNotIn(place, page, name)

    @unittest.skipUnless(shutil.which("man"), "there is no man")
    def test_man_shows_pages_without_warnings(self):
        pages = sorted((self.folder / "first").glob("*/*.1"))
        for page in pages if counting.IS_FULL else pages[::8]:
            shown = subprocess.run(["man", "--warnings", "-l", page], capture_output=True, text=True, check=True,
                                   env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "MANWIDTH": "80"})
            self.assertEqual(shown.stderr, "", page)
            self.assertLessEqual(max(map(len, shown.stdout.splitlines())), 90, page)


if __name__ == "__main__":
    counting.main()

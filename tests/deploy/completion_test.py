"""Completion in real shells, at a terminal, and what a program answers to them.

  completion_test.py TREE FOLDER-OF-THE-PROGRAMS
"""
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import counting

TREE = pathlib.Path(sys.argv.pop(1))
PROGRAMS = pathlib.Path(sys.argv.pop(1))
SCRIPTS = TREE / "proto/program/completion"
LONGEST_S = 600  # ends a hang


def environment(folder):
    return {"PATH": f"{PROGRAMS}:/usr/bin:/bin", "HOME": str(folder), "TERM": "dumb", "LC_ALL": "C.UTF-8", "PS1": "> ",
            "COLUMNS": "200", "LINES": "60"}


def offers(folder, *words):
    """What the program answers: its lines, without meanings."""
    done = subprocess.run([PROGRAMS / "oblique", "__complete", "fish", *words], cwd=folder, capture_output=True, check=True,
                          env=environment(folder), timeout=LONGEST_S)
    assert done.stderr == b"", done.stderr
    return [line.split("\t")[0] for line in done.stdout.decode(errors="surrogateescape").splitlines()]


class Shell:
    """A shell at a terminal of its own; Ctrl-G prints the line that is being typed."""

    def __init__(self, words, folder, begin):
        self.text = b""
        self.asked = 2 if words[0] == "bash" else 1
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe(words[0], words, environment(folder))
        for line in begin:
            self.send(line + "\n")
        self.send("echo rea''dy\n")
        self.wait(rb"\r?\nready\r?\n")

    def send(self, text):
        os.write(self.terminal, text.encode())

    def wait(self, pattern):
        """Reads until the pattern; gives the match, and forgets what was read."""
        end = time.monotonic() + LONGEST_S
        while not (found := re.search(pattern, self.text, re.S)):
            if not select.select([self.terminal], [], [], max(0, end - time.monotonic()))[0]:
                raise TimeoutError(f"no {pattern} in {self.text!r}")
            self.text += os.read(self.terminal, 65536)
        self.text = self.text[found.end():]
        return found

    def completed(self, typed):
        """The line after `typed` and a tabulator."""
        self.send("\x15" + typed + "\t\x07")
        return self.wait(rb"LINE<(.*?)>ENIL")[1].decode()

    def listed(self, typed):
        """What is shown; bash wants to be asked twice."""
        self.send("\x15" + typed + "\t" * self.asked + "\x07")
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self.wait(rb"(.*?)LINE<.*?>ENIL")[1].decode())

    def close(self):
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self.terminal)


def bash(folder):
    return Shell(["bash", "--norc", "--noprofile", "-i"], folder, [
        "bind 'set enable-bracketed-paste off'; bind 'set bell-style none'; bind 'set page-completions off'",
        "show() { printf 'LINE<%s>ENIL' \"$READLINE_LINE\"; }; bind -x '\"\\C-g\": show'",
        f". '{SCRIPTS}/oblique.bash'"])


def zsh(folder):
    return Shell(["zsh", "-f", "-i"], folder, [
        "unsetopt zle_bracketed_paste prompt_sp beep 2> /dev/null; unset zle_bracketed_paste; PROMPT='> '; stty cols 200 rows 60",
        "autoload -Uz compinit && compinit -u -D",
        "show() { print -rn -- \"LINE<$BUFFER>ENIL\" }; zle -N show; bindkey '^G' show; bindkey '^U' kill-whole-line",
        f". '{SCRIPTS}/_oblique'"])


class Folder(unittest.TestCase):
    longMessage = True

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="oblique-completion-"))
        (cls.folder / "oblique.db").write_text("")
        (cls.folder / "a sweep.toml").write_text("")
        (cls.folder / "notes.txt").write_text("")
        (cls.folder / "studies").mkdir()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)


class Answers(Folder):
    def test_verbs_and_verbs_of_verbs(self):
        self.assertEqual(offers(self.folder, "stu"), ["study", "studies"])
        self.assertEqual(offers(self.folder, "keys", ""), ["add", "list", "revoke"])
        self.assertNotIn("__complete", offers(self.folder, ""))

    def test_flags_that_are_given_or_excluded_are_not_offered(self):
        flags = offers(self.folder, "query", "x", "--")
        self.assertIn("--db", flags)
        self.assertIn("--server", flags)
        self.assertNotIn("--server", offers(self.folder, "query", "x", "--db", "a.db", "--"))
        self.assertNotIn("--limit", offers(self.folder, "query", "x", "--limit=3", "--"))
        self.assertIn("--at", offers(self.folder, "plot", "x", "--at", "mu=1", "--"))
        self.assertEqual([f for f in flags if re.search(r"\d$", f)], [])
        self.assertIn("--length64", offers(self.folder, "run", "--length6"))

    def test_nothing_where_a_number_is_meant(self):
        for words in (["query", "x", "--limit", ""], ["query", "x", "--limit="], ["solve", "--H", ""],
                      ["trace", "x", ""], ["query", "x", "--timeout", "-"]):
            self.assertEqual(offers(self.folder, *words), [], words)

    def test_choices(self):
        self.assertEqual(offers(self.folder, "query", "x", "--format", "js"), ["json", "jsonl"])
        self.assertEqual(offers(self.folder, "query", "x", "--format=js"), ["--format=json", "--format=jsonl"])
        self.assertEqual(offers(self.folder, "solve", "--integrator", ""), ["explicit", "generalized-alpha"])
        self.assertEqual(offers(self.folder, "plot", "--format", ""), ["svg", "png", "csv", "gnuplot"])
        self.assertEqual(offers(self.folder, "keys", "add", "--role", ""), ["client", "worker", "reader"])
        self.assertEqual(offers(self.folder, "autoscale", ""), ["slurm"])
        self.assertEqual(offers(self.folder, "run", "--sample", ""), ["random:", "lhs:", "sobol:"])

    def test_columns_in_lists_and_conditions(self):
        self.assertEqual(offers(self.folder, "query", "x", "--select", "mu,fn_peak_"), ["mu,fn_peak_N", "mu,fn_peak_error"])
        self.assertIn("mu > 0.5 AND stick_total_s", offers(self.folder, "query", "x", "--where", "mu > 0.5 AND stick"))
        self.assertIn("avg(fn_peak_N", offers(self.folder, "query", "x", "--order", "avg(fn_"))
        self.assertEqual(offers(self.folder, "query", "x", "--where", "mode LIKE 'S"), [])
        self.assertIn("mu=", offers(self.folder, "plot", "x", "--at", ""))
        self.assertIn("eta2", offers(self.folder, "run", "--where", "et"))

    def test_server_and_worker_answer_too(self):
        for program, words, expected in (("oblique-server", ["--log-f"], ["--log-format"]),
                                         ("oblique-server", ["--log-format", ""], ["text", "json"]),
                                         ("oblique-worker", ["--thr"], ["--threads"])):
            done = subprocess.run([PROGRAMS / program, "__complete", "fish", *words], capture_output=True, text=True, check=True)
            self.assertEqual([line.split("\t")[0] for line in done.stdout.splitlines()], expected)


class Shells(Folder):
    def session(self, kind):
        if shutil.which(kind.__name__) is None:
            self.skipTest(f"there is no {kind.__name__}")
        shell = kind(self.folder)
        self.addCleanup(shell.close)
        return shell

    def check_words(self, shell):
        for typed, expected in {
                "oblique que": "oblique query ",
                "oblique keys rev": "oblique keys revoke ",
                "oblique query x --whe": "oblique query x --where ",
                "oblique query x --select mu,instruct": "oblique query x --select mu,instruction_set",
                "oblique query x --format cs": "oblique query x --format csv ",
                "oblique query x --format=cs": "oblique query x --format=csv ",
                "oblique solve --elem": "oblique solve --elements-per-link ",
                "oblique query x --limit ": "oblique query x --limit ",
                "oblique-server --log-level warn": "oblique-server --log-level warning ",
                "oblique-worker --idle": "oblique-worker --idle-exit ",
                "oblique run a": r"oblique run a\ sweep.toml ",
                "oblique keygen st": "oblique keygen studies/",
                "oblique query --db obl": "oblique query --db oblique.db ",
                "oblique query pl": "oblique query pl",  # studies are not completed
        }.items():
            with self.subTest(typed=typed):
                self.assertEqual(shell.completed(typed), expected)

    def test_bash_completes_words(self):
        self.check_words(self.session(bash))

    def test_zsh_completes_words(self):
        self.check_words(self.session(zsh))

    def test_bash_completes_inside_a_quoted_condition(self):
        shell = self.session(bash)
        self.assertEqual(shell.completed('oblique query x --where "mu > 0.5 AND instruct'),
                         'oblique query x --where "mu > 0.5 AND instruction_set')
        listing = shell.listed('oblique query x --where "mu > 0.5 AND fn_peak')
        self.assertIn("fn_peak_N", listing)
        self.assertNotIn("mu > 0.5 AND fn_peak_N", listing)

    def test_zsh_says_what_flags_mean(self):
        listing = self.session(zsh).listed("oblique query x --")
        self.assertRegex(listing, r"--limit +-- most rows shown")

    def test_bash_with_an_assignment_and_another_command_before(self):
        self.assertEqual(self.session(bash).completed("true; X=1 oblique que"), "true; X=1 oblique query ")

    def test_no_program_no_words(self):
        shell = self.session(bash)
        self.assertEqual(shell.completed("/nowhere/oblique que"), "/nowhere/oblique que")


if __name__ == "__main__":
    counting.main()

"""Runs the recipes of deploy/examples as a user: copied to another folder, with the programs in PATH.

  recipes_test.py TREE FOLDER-OF-THE-PROGRAMS FOLDER-OF-THE-PYTHON-MODULE RECIPE

If a program or module that the recipe needs is missing, prints its name and exits with 77.
"""
import csv
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import counting

TREE, PROGRAMS, MODULE = map(pathlib.Path, sys.argv[1:4])
PYTHON = "/usr/bin/python3"
HANGS_S = 300  # ends a test that hangs


def missing(modules):
    """Returns the first module that Python cannot import, or None."""
    for module in modules:
        if subprocess.run([PYTHON, "-c", f"import {module}"], capture_output=True, check=False,
                          env=os.environ | {"PYTHONPATH": str(MODULE)}).returncode != 0:
            return module
    return None


class Recipe(unittest.TestCase):
    NEEDS = ()  # required Python modules

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for file in (TREE / "deploy/examples").iterdir():
            shutil.copy(file, self.folder)
        self.environment = {k: v for k, v in os.environ.items() if not k.startswith("OBLIQUE_")}
        # As if installed, the programs are in PATH. matplotlib stores its fonts in the test folder.
        self.environment |= {"PATH": f"{PROGRAMS}:/usr/bin:/bin", "PYTHONPATH": str(MODULE),
                             "MPLCONFIGDIR": str(self.folder / "fonts")}

    def run_in_folder(self, *words, code=0, **more):
        done = subprocess.run(words, cwd=self.folder, env=self.environment | more, text=True, capture_output=True,
                              timeout=HANGS_S, check=False)
        self.assertEqual(done.returncode, code, f"{words}: {done.stdout}{done.stderr}")
        return done.stdout

    def start(self, *words, **more):
        log = open(self.folder / (pathlib.Path(words[0]).name + ".log"), "w")
        self.addCleanup(log.close)
        process = subprocess.Popen(words, cwd=self.folder, env=self.environment | more, stdout=log, stderr=log)

        def end():
            process.terminate()
            process.wait()
        self.addCleanup(end)
        return process

    def log_of(self, process):
        return self.folder / (pathlib.Path(process.args[0]).name + ".log")

    def start_server(self):
        """Starts a server and returns its addresses for clients and for workers."""
        server = self.start("oblique-server", "--client-port", "0", "--worker-port", "0", "--http", "off")
        return self.wait_for(server, r"clients at (\S+), workers at (\S+),").groups()

    def wait_for(self, process, pattern):
        """Waits until the output of the process matches, and returns the match."""
        end = time.monotonic() + HANGS_S
        while not (found := re.search(pattern, printed := self.log_of(process).read_text())):
            self.assertIn(process.poll(), (None, 0), printed)
            self.assertLess(time.monotonic(), end, printed)
            time.sleep(0.05)
        return found

    def rows_of(self, file):
        with open(self.folder / file, newline="") as table:
            return list(csv.DictReader(table))


class StudyFromAScript(Recipe):
    def test_it_submits_waits_and_queries_and_its_exit_code_is_the_studys(self):
        url, workers = self.start_server()
        self.start("oblique-worker", "--server", workers)
        printed = self.run_in_folder("sh", "study.sh", "friction", OBLIQUE_SERVER=url)
        self.assertRegex(printed, r"^friction: 16 points, 0 done\nlargest normal force of friction: \d{4}\.\d+ N\n$")
        rows = self.rows_of("friction.csv")
        self.assertEqual([round(float(r["mu"]), 9) for r in rows], [0.2, 0.4, 0.6, 0.8, 1, 1.2, 1.4, 1.6])
        self.assertEqual(max(float(r["fn_peak_N"]) for r in rows), float(printed.split()[-2]))
        # A second run solves no point again and prints the same result.
        self.assertEqual(self.run_in_folder("sh", "study.sh", "friction", OBLIQUE_SERVER=url),
                         printed.replace(" 0 done", " 16 done; the server already had it"))
        # A cancelled study is not done: exit code 1.
        self.run_in_folder("oblique", "submit", "--name", "long", "--preset", "paper", "--H", "1", "--mu", "0.1:2:1000", "--e",
                           "0.5:1:1000", OBLIQUE_SERVER=url)
        self.run_in_folder("oblique", "cancel", "long", OBLIQUE_SERVER=url)
        self.run_in_folder("oblique", "watch", "long", "--quiet", code=1, OBLIQUE_SERVER=url)
        # Wrong usage: exit code 2.
        self.run_in_folder("sh", "study.sh", "", code=2, OBLIQUE_SERVER=url)


class CampaignOnACluster(Recipe):
    def test_it_exports_the_results_and_fails_if_a_point_failed(self):
        programs = self.folder / "programs"
        programs.mkdir()
        oblique = """case $1 in
            keygen) mkdir keys ;;
            autoscale) exec sleep 1000 ;;
            watch) exit 1 ;;
            query) printf 'point,mu\\n0,0.4\\n' ;;
            esac"""
        for name, script in {"oblique": oblique, "oblique-server": "exec sleep 1000", "scancel": "", "squeue": ""}.items():
            (programs / name).write_text(f"#!/bin/sh\n{script}\n")
            (programs / name).chmod(0o755)
        printed = self.run_in_folder("sh", "campaign.sh", "some.toml", code=1, PATH=f"{programs}:/usr/bin:/bin")
        self.assertEqual(printed, "1 results in some.csv\n")
        self.assertEqual([row["mu"] for row in self.rows_of("some.csv")], ["0.4"])


class PictureOfARunningStudy(Recipe):
    NEEDS = "matplotlib", "pandas"

    def test_it_is_drawn_while_the_study_runs_and_once_more_when_it_is_done(self):
        url, workers = self.start_server()
        self.run_in_folder("oblique", "submit", "--name", "first", "--preset", "paper", "--H", "1", "--mu", "0.1:2:40", "--e", "0.8,1",
                           OBLIQUE_SERVER=url)
        # The worker starts only after the first picture is drawn.
        drawing = self.start(PYTHON, "-u", "running.py", "oblique.db", "first")
        self.wait_for(drawing, "0 of 80 points, running\n")
        self.start("oblique-worker", "--server", workers)
        self.wait_for(drawing, "80 of 80 points, done\n")
        self.assertEqual(drawing.wait(HANGS_S), 0)
        self.assertEqual((self.folder / "first.png").read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
        self.run_in_folder(PYTHON, "running.py", "oblique.db", "frist", code=1)


class FiguresOfThePaper(Recipe):
    NEEDS = "matplotlib", "numpy", "oblique"

    def test_they_are_drawn_and_the_largest_forces_are_the_published_ones(self):
        printed = self.run_in_folder(PYTHON, "paper_figures.py")
        lines = printed.splitlines()
        self.assertEqual(len(lines), 11)
        for line in lines[1:-1]:
            *_, fn_kN, published_fn_kN, ft_kN, published_ft_kN = map(float, line.split())
            # The rms difference to the paper is 0.56 %; 0.005 is half of the last printed digit.
            self.assertAlmostEqual(fn_kN, published_fn_kN, delta=0.005 + 0.006 * published_fn_kN)
            self.assertAlmostEqual(ft_kN, published_ft_kN, delta=0.005 + 0.006 * published_ft_kN)
        for number in 4, 5, 6, 7:
            self.assertGreater((self.folder / f"figure{number}.png").stat().st_size, 20_000)


if __name__ == "__main__":
    if lacking := missing(globals()[sys.argv[4]].NEEDS):
        print(f"SKIPPED: {PYTHON} cannot import {lacking} here; deploy/test installs or builds it")
        sys.exit(77)
    counting.main(argv=[sys.argv[0], sys.argv[4]])

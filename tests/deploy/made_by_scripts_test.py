"""Tests build scripts that write the commit of a program and Debian's changelogs.

  made_by_scripts_test.py TREE
"""
import datetime
import gzip
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import counting

TREE = pathlib.Path(sys.argv.pop(1))
ORIGIN = "proto/program/origin"
HASH = "0123456789abcdef0123456789abcdef01234567"


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_here(self, *words, **more):
        done = subprocess.run(words, cwd=self.folder, env=os.environ | more, text=True, capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, f"{words}: {done.stdout}{done.stderr}")
        return done.stdout


@unittest.skipUnless(shutil.which("git"), "git is not installed")
class Origin(InAFolder):
    def tree(self, name, commit=None):
        shutil.copytree(TREE / ORIGIN, self.folder / name / ORIGIN)
        if commit is not None:
            (self.folder / name / ORIGIN / "commit").write_text(commit + "\n")
        return self.folder / name

    def git(self, tree, *words):
        return self.run_here("git", "-C", str(tree), "-c", "user.name=a", "-c", "user.email=a@example", *words,
                             GIT_COMMITTER_DATE="2026-11-20T12:00:00+0000").strip()

    def committed(self, tree):
        self.git(tree, "init", "-q")
        self.git(tree, "add", ".")
        self.git(tree, "commit", "-qm", "all")
        return self.git(tree, "rev-parse", "HEAD")

    def origin_of(self, tree, **more):
        self.run_here("cmake", "-D", f"TREE={tree}", "-D", "VERSION=0.2.0", "-D", "BUILD_TYPE=Release", "-D", "SANITIZE=",
                      "-D", f"FILE={self.folder}/origin.cpp", "-P", str(tree / ORIGIN / "look_up.cmake"), **more)
        text = (self.folder / "origin.cpp").read_text()
        return re.search(r'return \{"0.2.0", "(.*?)", "(.*?)", (\w+),', text).groups()

    def test_a_clone_has_its_commit_and_whether_it_was_changed(self):
        tree = self.tree("clone")
        commit = self.committed(tree)[:12]
        self.assertEqual(self.origin_of(tree), (commit, "2026-11-20", "false"))
        (tree / "notes").write_text("not known to git")
        self.assertEqual(self.origin_of(tree), (commit, "2026-11-20", "false"))
        (tree / ORIGIN / "origin.h").write_text("changed")
        self.assertEqual(self.origin_of(tree), (commit, "2026-11-20", "true"))
        # GIT_DIR names another repository, as it does in a hook of that repository.
        self.assertEqual(self.origin_of(tree, GIT_DIR="/nowhere"), (commit, "2026-11-20", "true"))

    def test_the_same_answer_leaves_the_file_alone(self):
        tree = self.tree("clone")
        self.committed(tree)
        self.origin_of(tree)
        file = self.folder / "origin.cpp"
        os.utime(file, (1, 1))
        self.origin_of(tree)
        self.assertEqual(file.stat().st_mtime, 1)

    def test_an_archive_of_git_contains_its_commit(self):
        tree = self.tree("clone")
        shutil.copy(TREE / ".gitattributes", tree)
        commit = self.committed(tree)[:12]
        self.git(tree, "archive", "--prefix=unpacked/", "-o", str(self.folder / "a.tar"), "HEAD")
        self.run_here("tar", "-xf", "a.tar")
        self.assertEqual(self.origin_of(self.folder / "unpacked"), (commit, "2026-11-20", "false"))

    def test_a_tree_without_either_or_inside_another_repository_has_no_commit(self):
        self.assertEqual(self.origin_of(self.tree("plain")), ("", "", "false"))
        self.tree("outer/inner", "$Format:%H %cs$")
        self.committed(self.folder / "outer")
        self.assertEqual(self.origin_of(self.folder / "outer/inner"), ("", "", "false"))

    def test_the_commit_of_a_tree_without_git_can_be_set(self):
        self.assertEqual(self.origin_of(self.tree("packed", f"{HASH} 2026-11-20")), (HASH[:12], "2026-11-20", "false"))


class DebiansChangelog(InAFolder):
    def changelog_of(self, text):
        (self.folder / "deploy/packages/packing").mkdir(parents=True)
        (self.folder / "deploy/CHANGELOG.md").write_text(text)
        shutil.copy(TREE / "deploy/packages/packing/add_changelog.cmake", self.folder / "deploy/packages/packing")
        parts = "server", "worker", "client"
        names = "".join(f"set(CPACK_DEBIAN_{part.upper()}_PACKAGE_NAME a-{part})\n" for part in parts)
        (self.folder / "run.cmake").write_text(
            f'set(CPACK_TEMPORARY_INSTALL_DIRECTORY "{self.folder}/out")\nset(CPACK_PACKAGE_CONTACT "a <a@example>")\n'
            f'set(CPACK_COMPONENTS_ALL {" ".join(parts)})\n{names}include("{self.folder}/deploy/packages/packing/add_changelog.cmake")\n')
        self.run_here("cmake", "-P", "run.cmake")
        with gzip.open(self.folder / "out/client/usr/share/doc/a-client/changelog.gz", "rt") as file:
            return file.read()

    def test_it_has_each_version_of_the_changelog(self):
        text = self.changelog_of("# Changelog\n\nFor people.\n\n## [Unreleased]\n\n- not yet\n\n## [1.1.0] - 2024-02-29\n\n"
                                       "One [word](x.md); two.\n\n### Added\n\n- `a`; b\n  goes on\n\n## [1.0.0] - 2000-01-01\n\n- first\n")
        self.assertEqual(text, "a-client (1.1.0) stable; urgency=medium\n\n  * One word; two.\n\n  [ Added ]\n  * a; b\n"
                         "    goes on\n\n -- a <a@example>  Thu, 29 Feb 2024 00:00:00 +0000\n\n"
                         "a-client (1.0.0) stable; urgency=medium\n\n  * first\n\n -- a <a@example>  Sat, 01 Jan 2000 00:00:00 +0000\n")

    def test_ours_fits_debians_width_and_names_the_right_days_of_the_week(self):
        text = self.changelog_of((TREE / "deploy/CHANGELOG.md").read_text())
        ends = [line for line in text.splitlines() if line.startswith(" -- ")]
        self.assertGreaterEqual(len(ends), 2)
        for end in ends:
            date = end.split(">  ")[1]
            self.assertEqual(datetime.datetime.strptime(date, "%a, %d %b %Y %H:%M:%S %z").strftime("%a"), date[:3])
        self.assertEqual([line for line in text.splitlines() if len(line) > 80 and not line.startswith(" -- ")], [])


if __name__ == "__main__":
    counting.main()

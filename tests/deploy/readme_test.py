"""Checks the commands in deploy/README.md and the READMEs below it against programs, units and files.

  readme_test.py TREE FOLDER-OF-THE-PROGRAMS
"""
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import unittest

import counting

TREE = pathlib.Path(sys.argv.pop(1))
PROGRAMS = pathlib.Path(sys.argv.pop(1))
READMES = [TREE / "deploy/README.md", *sorted((TREE / "deploy").glob("*/README.md"))]
MAIN = READMES[0].read_text()


def blocks(text):
    """Returns the fenced blocks, which contain commands."""
    return re.findall(r"^```\n(.*?)^```$", text, re.M | re.S)


def commands(text):
    """Yields the words of each command that runs one of oblique's programs, from blocks and code spans."""
    lines = [l for b in blocks(text) for l in b.replace("\\\n", " ").splitlines()]
    lines += re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S))
    for line in lines:
        try:
            words = shlex.split(line)
        except ValueError:
            continue
        if words[:3] == ["sudo", "-u", "oblique"]:
            words = words[3:]
        if words and words[0] in ("oblique", "oblique-server", "oblique-worker") and len(words) > 1:
            yield words


def help_of(words):
    """Returns the help of the program and of the commands in `words`."""
    text = ""
    for n in range(1, min(3, len(words)) + 1):
        if n > 1 and not re.fullmatch(r"[a-z]+", words[n - 1]):
            break
        text += subprocess.run([PROGRAMS / words[0], *words[1:n], "--help"], capture_output=True, text=True,
                               check=False).stdout
    return text


def settings():
    """Returns the default settings of oblique-server."""
    return subprocess.run([PROGRAMS / "oblique-server", "--no-config", "--print-config"], text=True,
                          capture_output=True, check=True).stdout


class Readmes(unittest.TestCase):
    longMessage = False

    def test_commands_have_the_flags_that_are_shown(self):
        seen = 0
        for readme in READMES:
            for words in commands(readme.read_text()):
                text = help_of(words)
                self.assertNotEqual(text, "", f"{readme}: {words}: no explanation")
                for flag in (w.split("=")[0] for w in words if w.startswith("--")):
                    self.assertRegex(text, rf"(?<![\w-]){flag}(?![\w-])", f"{readme}: {' '.join(words)}: there is no {flag}")
                    seen += 1
        self.assertGreater(seen, 10)

    def test_the_changelog_begins_with_the_version_that_is_built_and_cited(self):
        version = re.search(r"project\(oblique VERSION ([\d.]+)", (TREE / "CMakeLists.txt").read_text())[1]
        changes = re.findall(r"(?m)^## \[([\d.]+)\] - (\d{4}-\d\d-\d\d)$", (TREE / "deploy/CHANGELOG.md").read_text())
        self.assertEqual(changes[0][0], version)
        self.assertEqual([date for _, date in changes], sorted((date for _, date in changes), reverse=True))
        citation = (TREE / "deploy/packages/CITATION.cff").read_text()
        self.assertIn(f"\nversion: {version}\n", citation)
        self.assertIn(f'\ndate-released: "{changes[0][1]}"\n', citation)

    def test_settings_that_are_named_exist(self):
        printed = settings()
        named = re.findall(r"^\| 760\d \(`(\w+)`\)", MAIN, re.M) + ["drain", "insecure"]
        self.assertEqual(len(named), 5)
        for key in named:
            self.assertIn(f"`{key}`", MAIN)
            self.assertRegex(printed, rf"(?m)^(# )?{key}\b", f"there is no setting {key}")

    def test_ports_are_the_defaults(self):
        printed = settings()
        for port, key in re.findall(r"^\| (760\d) \(`(\w+)`\)", MAIN, re.M):
            self.assertRegex(printed, rf'(?m)^{key} = "?([\d.]+:)?{port}\b', f"{key} is not {port}")

    def test_units_packages_and_parts_are_there(self):
        for unit in re.findall(r"systemctl enable --now ([\w-]+)", MAIN):
            self.assertTrue((TREE / f"deploy/systemd/{unit}.service.in").exists(), unit)
        cmake = (TREE / "deploy/packages/CMakeLists.txt").read_text()
        for package in re.findall(r"\./([\w-]+)_\*\.deb", MAIN):
            self.assertRegex(cmake, rf"set\(package_of_\w+ {package}\)")
        for part in re.search(r"`--component (\w+)`, `(\w+)` or `(\w+)`", MAIN).groups():
            self.assertIn(part, re.search(r"set\(parts ([\w ]+)\)", cmake)[1].split())

    def test_the_labs_commands_make_the_installed_configuration_one_that_listens_and_connects(self):
        edits = re.findall(r"sudo (sed -i .*) /etc/oblique/(\w+)\.toml$", MAIN, re.M)
        self.assertEqual([part for _, part in edits], ["server", "worker"])
        expected = {"server": {"listen": "*", "keys": "/var/lib/oblique/keys/server.key"},
                    "worker": {"server": "tcp://hub:7601",
                               "keys": "/run/credentials/oblique-worker.service/worker.key"}}
        for edit, part in edits:
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / f"{part}.toml"
                file.write_text((TREE / f"deploy/systemd/{part}.toml").read_text())
                subprocess.run([*shlex.split(edit), file], check=True)
                printed = subprocess.run([PROGRAMS / f"oblique-{part}", "--config", file, "--print-config"],
                                         text=True, capture_output=True, check=True).stdout
            for key, value in expected[part].items():
                self.assertRegex(printed, rf'(?m)^{key} = "{re.escape(value)}"')


if __name__ == "__main__":
    counting.main()

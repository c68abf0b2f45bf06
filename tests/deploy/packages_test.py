"""Debian packages that cpack makes from the build: contents, dependencies, and installation by dpkg in a
separate root folder without chroot.

  packages_test.py CPACK BUILD-FOLDER
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import counting

CPACK, BUILD = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1))
SERVICES = ("oblique-server", "oblique-worker")


def run(*words, **more):
    """Runs a command, which must succeed, and returns its output."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **more)
    if done.returncode != 0:
        raise AssertionError(f"{words}: {done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def pack(folder):
    """Makes the packages, uncompressed to save time, and returns their files by name."""
    run(CPACK, "--config", BUILD / "CPackConfig.cmake", "-G", "DEB", "-B", folder,
        "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=none", env={**os.environ, "SOURCE_DATE_EPOCH": "1800000000"})
    return {file.name.split("_")[0]: file for file in sorted(folder.glob("*.deb"))}


def older(package, folder):
    """Makes a copy of a package with an earlier version number and another configuration file."""
    tree = folder / package
    run("dpkg-deb", "--raw-extract", PACKAGES[package], tree)
    for name in ("control", "prerm"):
        file = tree / "DEBIAN" / name
        file.write_text(file.read_text().replace(VERSION, "0.0.1"))
    settings = tree / "etc/oblique" / f"{package.removeprefix('oblique-')}.toml"
    settings.write_text("# as version 0.0.1 had it\n")
    run("dpkg-deb", "-Znone", "--root-owner-group", "--build", tree, folder / f"{package}.deb")
    return folder / f"{package}.deb"


def setUpModule():
    tools = ("dpkg-deb", "dpkg-shlibdeps", "deb-systemd-helper", "systemd-sysusers", "file")
    if missing := [tool for tool in tools if not shutil.which(tool)]:
        raise unittest.SkipTest(f"{missing[0]} is not installed")
    global FOLDER, PACKAGES, VERSION
    FOLDER = tempfile.TemporaryDirectory()
    PACKAGES = pack(pathlib.Path(FOLDER.name))
    VERSION = field("oblique", "Version")
    unittest.addModuleCleanup(FOLDER.cleanup)


def field(package, name):
    return run("dpkg-deb", "--field", PACKAGES[package], name).strip()


def files(package):
    lines = run("dpkg-deb", "--contents", PACKAGES[package]).splitlines()
    return [line.split(maxsplit=5)[5].split(" -> ")[0].removeprefix(".") for line in lines if not line.endswith("/")]


def script(package, name):
    return run("dpkg-deb", "--info", PACKAGES[package], name)


class Packages(unittest.TestCase):
    def test_programs_depend_only_on_the_libraries_they_link(self):
        for package, library in ("oblique", "libsqlite3-0"), ("oblique-server", "libmicrohttpd12"), ("oblique-worker", "libzmq5"):
            self.assertIn(library, field(package, "Depends"))
            self.assertNotRegex(field(package, "Depends"), r"python|chromium|node|oblique")
            self.assertEqual(field(package, "Multi-Arch"), "foreign")
            self.assertEqual(field(package, "Section"), "science")
        self.assertNotRegex(field("oblique-worker", "Depends"), "sqlite|microhttpd|systemd")
        self.assertIn("systemd-sysusers", field("oblique-server", "Depends"))

    def test_the_library_is_coinstallable_and_its_development_files_need_the_same_version(self):
        library, = (package for package in PACKAGES if re.fullmatch(r"liboblique\d[\d.]*", package))
        self.assertEqual(field("liboblique-dev", "Depends"), f"{library} (= {VERSION})")
        self.assertRegex(field(library, "Depends"), r"^libc6 [^,]*, libgcc-s1 [^,]*, libstdc\+\+6 [^,]*$")
        soname = library.removeprefix("liboblique")
        triplet = run("dpkg-architecture", "-qDEB_HOST_MULTIARCH").strip()
        self.assertIn(f"/usr/lib/{triplet}/liboblique.so.{VERSION}", files(library))
        self.assertEqual(script(library, "shlibs"), f"liboblique {soname} {library} (>= {VERSION})\n")
        for package in library, "liboblique-dev":
            self.assertEqual(field(package, "Multi-Arch"), "same")
            # Packages of two architectures may differ only in paths that contain the architecture.
            self.assertEqual([f for f in files(package) if re.match(r"/usr/lib/(?!%s/)" % triplet, f)], [])

    def test_the_python_module_depends_on_python_and_numpy_only(self):
        if "python3-oblique" not in PACKAGES:
            self.skipTest("the Python module is not built")
        self.assertRegex(field("python3-oblique", "Depends"), r"^python3 \(>= 3\.\d+\), python3 \(<< 3\.\d+\), python3-numpy, libc6")
        self.assertNotRegex(field("python3-oblique", "Depends"), "oblique|pandas")
        self.assertIn("/usr/lib/python3/dist-packages/oblique/__init__.py", files("python3-oblique"))
        self.assertEqual([f for f in files("python3-oblique") if f.endswith(".pyc")], [])

    def test_the_command_line_brings_the_services_of_its_own_version(self):
        self.assertEqual(field("oblique", "Recommends"), ", ".join([*(f"{s} (= {VERSION})" for s in SERVICES), "gnuplot-nox"]))

    def test_descriptions_fit_a_terminal_and_begin_with_a_summary(self):
        for package in PACKAGES:
            synopsis, *text = field(package, "Description").splitlines()
            self.assertLessEqual(len(synopsis), 70, synopsis)
            self.assertGreater(len(text), 3)
            self.assertTrue(all(len(line) <= 80 for line in text), text)

    def test_scripts_are_posix_and_filled_in(self):
        scripts = [(service, name) for service in SERVICES for name in ("postinst", "prerm", "postrm")]
        if "python3-oblique" in PACKAGES:
            scripts += [("python3-oblique", "postinst"), ("python3-oblique", "prerm")]
        for package, name in scripts:
            text = script(package, name)
            subprocess.run(["sh", "-n"], input=text, text=True, check=True)
            self.assertNotRegex(text, r"@[A-Za-z_]+@")

    def test_a_cancelled_removal_starts_stopped_services_again(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "run/systemd/system").mkdir(parents=True)
            (folder / "run/systemd/units").mkdir()
            for unit in "oblique-worker.service", "oblique-worker@lab.service", "other.service":
                (folder / "run/systemd/units" / f"invocation:{unit}").symlink_to("0123456789abcdef")
            tools = {"systemctl": "", "deb-systemd-helper": "exit 1", "deb-systemd-invoke": f'echo "$@" >> {folder}/asked'}
            for tool, text in tools.items():
                (folder / tool).write_text(f"#!/bin/sh\n{text}\n")
                (folder / tool).chmod(0o755)
            for name, word in ("prerm", "remove"), ("postinst", "abort-remove"):
                text = script("oblique-worker", name).replace("/run/", f"{folder}/run/")
                subprocess.run(["sh", "-s", word], input=text, text=True, check=True, env={"PATH": f"{folder}:/usr/bin:/bin"})
            self.assertEqual((folder / "asked").read_text().splitlines(),
                             ["stop oblique-worker.service oblique-worker@*.service",
                              "start oblique-worker.service oblique-worker@lab.service"])
            self.assertFalse((folder / "run/oblique-worker.stopped").exists())

    @counting.full
    def test_lintian_has_no_errors_and_warns_of_nothing(self):
        if not shutil.which("lintian"):
            self.skipTest("lintian is not installed")
        # Only release builds are shipped; builds with sanitizers or assertions differ from them.
        if "CMAKE_BUILD_TYPE:STRING=Release" not in (BUILD / "CMakeCache.txt").read_text():
            self.skipTest("only a release build is checked with lintian")
        run("lintian", "--allow-root", "--fail-on", "error,warning", "--suppress-tags",
            "uses-no-compression-for-data-tarball", *PACKAGES.values())

    @counting.full
    def test_packing_again_gives_the_same_bytes(self):
        again = pack(pathlib.Path(FOLDER.name) / "elsewhere")
        self.assertEqual(again.keys(), PACKAGES.keys())
        for package, file in again.items():
            self.assertEqual(file.read_bytes(), PACKAGES[package].read_bytes(), package)


class AtWork(unittest.TestCase):
    """dpkg installs, upgrades and removes packages in an empty root folder; scripts get it as DPKG_ROOT."""

    def setUp(self):
        if os.geteuid() != 0:
            self.skipTest("needs root, as dpkg does")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.root = self.folder / "root"
        for name in "var/lib/dpkg/info", "var/lib/dpkg/updates", "etc":
            (self.root / name).mkdir(parents=True)
        (self.root / "var/lib/dpkg/status").touch()

    def dpkg(self, *words):
        return run("dpkg", f"--root={self.root}", "--force-script-chrootless,depends,confold", *words,
                   env={**os.environ, "LC_ALL": "C.UTF-8"})

    def install(self, *packages):
        return self.dpkg("--install", *(PACKAGES.get(package, package) for package in packages))

    def enable(self, unit, link):
        """Enables a unit as `systemctl enable` does, and returns the link."""
        wants = self.root / "etc/systemd/system/multi-user.target.wants"
        wants.mkdir(parents=True, exist_ok=True)
        (wants / link).symlink_to(f"/usr/lib/systemd/system/{unit}")
        return wants / link

    def test_an_installation_starts_and_enables_nothing_and_prints_how_to(self):
        printed = self.install(*SERVICES)
        for service in SERVICES:
            self.assertIn(f"{service} is installed and not started.", printed)
            self.assertIn(f"  systemctl enable --now {service}\n", printed)
        self.assertEqual(list(self.root.glob("etc/systemd/**/*.service")), [])
        state = self.root / "var/lib/oblique"
        self.assertEqual(state.stat().st_mode & 0o777, 0o750)
        account = re.search(r"^oblique:x:(\d+):(\d+):.*:/var/lib/oblique:", (self.root / "etc/passwd").read_text(), re.M)
        self.assertEqual((str(state.stat().st_uid), str(state.stat().st_gid)), account.groups())

    def test_an_upgrade_keeps_edited_settings_and_replaces_others(self):
        self.install(*(older(service, self.folder) for service in SERVICES))
        mine = self.root / "etc/oblique/server.toml"
        mine.write_text("# mine\n")
        printed = self.install(*SERVICES)
        self.assertEqual(mine.read_text(), "# mine\n")
        self.assertNotIn("0.0.1", (self.root / "etc/oblique/worker.toml").read_text())
        self.assertNotIn("not started", printed)

    def test_databases_and_keys_survive_upgrade_removal_and_purge(self):
        self.install(older("oblique-server", self.folder), older("oblique-worker", self.folder))
        kept = [self.root / name for name in ("var/lib/oblique/oblique.db", "var/lib/oblique/keys", "etc/oblique/worker.key")]
        for file in kept:
            file.write_text(file.name)
        self.install(*SERVICES)
        self.dpkg("--remove", *SERVICES)
        self.assertTrue((self.root / "etc/oblique/server.toml").exists())
        self.assertFalse((self.root / "usr/bin/oblique-server").exists())
        printed = self.dpkg("--purge", *SERVICES)
        self.assertIn("/var/lib/oblique is not removed", printed)
        self.assertIn("/etc/oblique/worker.key is not removed", printed)
        self.assertFalse((self.root / "etc/oblique/server.toml").exists())
        self.install(*SERVICES)
        self.assertEqual([file.read_text() for file in kept], [file.name for file in kept])
        self.assertTrue((self.root / "etc/oblique/server.toml").exists())

    @counting.full
    def test_a_downgrade_prints_its_consequences(self):
        self.install(*SERVICES)
        printed = self.install(*(older(service, self.folder) for service in SERVICES))
        self.assertIn(f"oblique-server is downgraded from {VERSION} to 0.0.1.", printed)
        self.assertIn("then use an older copy", printed)
        self.assertNotIn("is downgraded", self.install(*SERVICES))

    @counting.full
    def test_services_stay_enabled_after_a_removal_but_not_after_a_purge(self):
        self.install(*SERVICES)
        links = [self.enable("oblique-server.service", "oblique-server.service"),
                 self.enable("oblique-worker.service", "oblique-worker.service"),
                 self.enable("oblique-worker@.service", "oblique-worker@lab.service")]
        other = self.enable("other.service", "other.service")
        self.install(*SERVICES)
        self.dpkg("--remove", *SERVICES)
        self.install(*SERVICES)
        self.assertTrue(all(link.is_symlink() for link in links))
        self.dpkg("--purge", *SERVICES)
        self.assertEqual([link for link in links if link.is_symlink()], [])
        self.assertTrue(other.is_symlink())

    @counting.full
    def test_a_purge_keeps_links_to_a_users_unit(self):
        self.install("oblique-worker")
        ours = self.enable("oblique-worker@.service", "oblique-worker@lab.service")
        own = self.root / "etc/systemd/system/oblique-worker@night.service"
        own.write_text("[Service]\nExecStart=/bin/true\n")
        links = [ours.parent / name for name in ("oblique-worker@night.service", "oblique-worker@by-name.service")]
        links[0].symlink_to("/etc/systemd/system/oblique-worker@night.service")
        links[1].symlink_to("../oblique-worker@night.service")
        self.dpkg("--purge", "oblique-worker")
        self.assertFalse(ours.is_symlink())
        self.assertTrue(all(link.is_symlink() for link in links))

    def test_a_state_folder_that_is_a_link_to_another_disk_stays_one(self):
        state = self.root / "var/lib/oblique"
        state.symlink_to("/nowhere/that/is/mounted")
        self.install("oblique-server")
        self.assertTrue(state.is_symlink())


if __name__ == "__main__":
    counting.main()

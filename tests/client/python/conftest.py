"""Shared by the tests of the module: the programs of the same build, and a study that they solved."""

import json
import os
import subprocess
import sys

import pytest

PROGRAMS = os.environ["OBLIQUE_PROGRAMS"]


def run_oblique(*arguments):
    return subprocess.run(
        [os.path.join(PROGRAMS, "oblique"), *arguments], check=True, capture_output=True, text=True
    ).stdout


def solved_by_program(*arguments):
    """Returns the output of `oblique solve --json` without its wall time."""
    return without_time(json.loads(run_oblique("solve", "--json", *arguments)))


def without_time(result):
    return {**result, "solver": {**result["solver"], "wall_s": None}}


#: Beginning of scripts that run until a test interrupts them. The alarm ends a script that is not
#: interrupted.
BEGINNING = """
import os, signal, sys, threading
signal.alarm(1000)
def threads():
    return len(os.listdir("/proc/self/task"))
def wait_for_threads(more_than, of):
    while threads() <= more_than and of.is_alive():
        os.sched_yield()
"""


def ended_script(script, *arguments):
    """Runs BEGINNING followed by `script` and returns its outcome. A script that does not end is stopped by the
    time limit of all tests."""
    return subprocess.run(
        [sys.executable, "-c", BEGINNING + script, *arguments], capture_output=True, text=True
    )


@pytest.fixture(scope="session")
def database(tmp_path_factory):
    file = str(tmp_path_factory.mktemp("study") / "sweep.db")
    run_oblique("run", "--H", "0.6,1", "--mu", "0:2:9", "--e", "0.5,1", "--name", "sweep", "--db", file)
    return file


def pytest_configure(config):
    config.addinivalue_line("markers", "full: runs only with OBLIQUE_TEST_ALL, which `deploy/test --all` sets")


def pytest_collection_modifyitems(config, items):
    """Leaves tests with the marker `full` to `deploy/test --all`."""
    if "OBLIQUE_TEST_ALL" not in os.environ:
        left_out = [item for item in items if item.get_closest_marker("full")]
        items[:] = [item for item in items if item not in left_out]
        config.hook.pytest_deselected(items=left_out)


def pytest_terminal_summary(terminalreporter):
    for report in terminalreporter.stats.get("skipped", []):
        terminalreporter.write_line(f"SKIPPED: {report.nodeid}: {report.longrepr[2]}")


def pytest_sessionfinish(session, exitstatus):
    """Exits with 77, which ctest counts as skipped, if no test failed and some were skipped."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if exitstatus == 0 and reporter.stats.get("skipped"):
        session.exitstatus = 77

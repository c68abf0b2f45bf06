"""Interruption by Ctrl-C, the end of Python, forked children, and memory that stays allocated. Each call would take
many minutes; the time limit of all tests ends a test that hangs."""

import multiprocessing
import os
import signal
import subprocess
import sys

import pytest

import oblique
from conftest import BEGINNING, ended_script

SOLVE = "oblique.solve(1, 0.4, 1, integrator='generalized-alpha', dt_fall=1e-9)"
SOLVE_MANY = "oblique.solve_many(1, numpy.linspace(0, 2, 10**6), 1)"
LONG_FALLS = "oblique.solve_many(1, 0.4, 1, integrator=['generalized-alpha'], dt_fall=[1e-9, 2e-9])"
TRACE = SOLVE.replace("solve", "trace")
ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n"
QUERY = f"oblique.Database(sys.argv[1]).sql('{ENDLESS}')"


@pytest.mark.parametrize("work", [SOLVE, SOLVE_MANY, LONG_FALLS, TRACE, QUERY])
def test_ctrl_c_ends_work_with_keyboard_interrupt(work, database):
    script = f"import oblique, numpy\nprint(threads(), flush=True)\n{work}"
    with subprocess.Popen(
        [sys.executable, "-c", BEGINNING + script, database],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:
        before = int(process.stdout.readline())
        while len(os.listdir(f"/proc/{process.pid}/task")) <= before:
            os.sched_yield()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert process.returncode in (-signal.SIGINT, 130)


#: Delays the end of Python, so that other threads have time to take the global lock of Python.
ENDS_LATE = """
import time
class EndsLate:
    def __del__(self, sleep=time.sleep, write=os.write):
        sleep(0.3)
        write(1, b"done")
sys.ends_late = EndsLate()  # no module that a thread still uses may hold it
"""


@pytest.mark.parametrize("work", [SOLVE, SOLVE_MANY, QUERY])
def test_python_ends_well_while_a_daemon_thread_is_in_a_call(work, database):
    ended = ended_script(
        ENDS_LATE + "import oblique, numpy\n"
        "before = threads()\n"
        f"thread = threading.Thread(target=lambda: ({work}, print('it ended')), daemon=True)\n"
        "thread.start()\n"
        "wait_for_threads(before + 1, thread)\n",
        database,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "done", "")


SENTENCE = r'multiprocessing\.set_start_method\("spawn"\)'


def test_every_call_in_the_child_of_a_fork_says_how_to_start_processes_instead(database):
    opened = oblique.Database(database)
    calls = [
        lambda: oblique.solve(1, 0.4, 1),
        lambda: oblique.trace(1, 0.4, 1),
        lambda: oblique.solve_many(1, [0.4], 1),
        lambda: oblique.Database(database),
        lambda: opened.query("sweep"),
        lambda: opened.studies(),
    ]
    child = os.fork()
    if child == 0:
        try:
            for call in calls:
                with pytest.raises(RuntimeError, match=SENTENCE):
                    call()
            os._exit(0)
        finally:
            os._exit(1)
    assert os.waitpid(child, 0)[1] == 0
    assert len(opened.query("sweep")) == 36


def test_processes_of_a_spawned_pool_solve_and_send_results_back():
    here = oblique.solve_many(1, [0.4, 1.2], 1)
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        ones = pool.starmap(oblique.solve, [(1, 0.4, 1), (1, 1.2, 1)])
        many = pool.apply(oblique.solve_many, (1, [0.4, 1.2], 1))
        with pytest.raises(oblique.SolveError):
            pool.apply(oblique.solve, (1, 0.4, 1), {"dt": 1e-25})
    assert [one.fn_peak_N for one in ones] == here.fn_peak_N.tolist() == many.fn_peak_N.tolist()

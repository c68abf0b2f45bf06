"""What an answer to completion takes: its whole time and that of the processor, the least and the median of 40 each.

  tests/bench/python/completion.py build/release/bin
"""
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time

PROGRAMS = pathlib.Path(sys.argv[1]).resolve()


def taken(folder, *words):
    """Wall and processor time [ms] of each of some answers."""
    answers = []
    for _ in range(40):
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run([PROGRAMS / "oblique", "__complete", "fish", *words], cwd=folder, stdout=subprocess.DEVNULL, check=True)
        wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        answers.append((1e3 * wall, 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)))
    return zip(*answers)


def row(what, folder, *words):
    wall, cpu = (sorted(times) for times in taken(folder, *words))
    print(f"| {what} | {wall[0]:.1f} | {statistics.median(wall):.1f} | {cpu[0]:.1f} |", flush=True)


with tempfile.TemporaryDirectory() as full, tempfile.TemporaryDirectory() as empty:
    subprocess.run([PROGRAMS / "oblique", "run", "--H", "1", "--mu", "0.4", "--e", "1", "--name", "first", "--quiet"],
                   cwd=full, check=True, stdout=subprocess.DEVNULL)
    reading, writing = os.pipe()
    server = subprocess.Popen([PROGRAMS / "oblique-server", "--no-config", "--db", "served.db", "--worker-port", "0", "--client-port", "0",
                               "--http", "off", "--ready-fd", str(writing)], cwd=full, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as lines:
        address = re.search(r'"client": ?"([^"]*)"', lines.readlines()[-1])[1]
    try:
        print("| answer | wall, least [ms] | median | CPU, least [ms] |\n|---|---|---|---|")
        row("a verb (`oblique que`)", empty, "que")
        row("a flag (`query x --li`)", empty, "query", "x", "--li")
        row("a column (`--select mu,fn_`)", empty, "query", "x", "--select", "mu,fn_")
        row("a key of the model (`plot --at E`)", empty, "plot", "x", "--at", "E")
        row("a single length (`run --length6`)", empty, "run", "--length6")
        row("studies of a database", full, "query", "")
        row("studies of a server", empty, "query", "--server", address, "")
        row("studies, with neither", empty, "query", "--server", "tcp://127.0.0.1:1", "")
    finally:
        server.terminate()
        server.wait()

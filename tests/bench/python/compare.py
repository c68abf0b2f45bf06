#!/usr/bin/python3
"""What the Python module costs beside C++: 20,000 points over H, mu and e of the preset paper, solved by turns by
oblique.solve_many and by the same in C++, each in a process of its own. Prints each pair, and the
medians of the ratios.
    PYTHONPATH=build/release/python tests/bench/python/compare.py build/release/bin/oblique-many-points 5
"""

import statistics
import subprocess
import sys

POINTS = """
import resource, time
import numpy as np, oblique
H = np.linspace(0.3, 1.1, 20)[:, None, None]
mu = np.linspace(0, 2, 50)[None, :, None]
e = np.linspace(0.5, 1, 20)
before, begun = resource.getrusage(resource.RUSAGE_SELF).ru_utime, time.perf_counter()
sweep = oblique.solve_many(H, mu, e, preset="paper")
wall = time.perf_counter() - begun
user = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
print(wall, user, sweep.fn_peak_N.sum())
"""


def figures(command):
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [float(number) for number in said.split()]


def main(program, pairs):
    ratios = []
    for pair in range(pairs):
        runs = {"C++": [program], "Python": [sys.executable, "-c", POINTS]}
        order = list(runs) if pair % 2 == 0 else list(runs)[::-1]
        got = {name: figures(runs[name]) for name in order}
        assert abs(got["C++"][2] / got["Python"][2] - 1) < 1e-9, "other results"
        ratios.append([a / b for a, b in zip(got["Python"], got["C++"])])
        print(", ".join(f"{n} {got[n][0]:.3f} s wall {got[n][1]:.3f} s user" for n in runs))
    wall, user, _ = (statistics.median(column) for column in zip(*ratios))
    print(f"Python takes {wall:.3f} times the wall time and {user:.3f} times the user time")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5)

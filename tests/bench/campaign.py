#!/usr/bin/python3
"""Times samples whose points share falls, and prints ratios.

  PYTHONPATH=build/release/python tests/bench/campaign.py build/release/bin/oblique [quick]

First: points/s of a Latin hypercube of 1,000 points on 16 elements a link with E drawn from 21 values, over those with
12 values, beside the same ratio of (falls x time of a fall + points x time of a contact). Then: the time of a sample of 20,000 points with 500 falls over (falls x time of a fall + points x time of a
contact), on one worker process and on four. Both times are measured in the same run, by oblique.solve_many: many falls
with one point each, and one fall with many points. `quick` takes a tenth of the points and falls.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
import oblique

RANGES = {"H": (0.8, 1.1), "mu": (0.1, 2.0), "e": (0.5, 1.0), "E": (60e9, 80e9), "k": (1e7, 1e8)}


def run_s(program, points, falls, workers):
    """Seconds that `oblique run` takes for a sample of `points` points with `falls` values of E."""
    axes = "".join(
        f"{key} = {{ from = {low:g}, to = {high:g}{f', count = {falls}' if key == 'E' else ''} }}\n"
        for key, (low, high) in RANGES.items())
    with tempfile.TemporaryDirectory() as folder:
        study = pathlib.Path(folder, "sample.toml")
        study.write_text(f'name = "sample"\n[model]\nelements_per_link = 16\n[[block]]\n'
                         f'sample = {{ kind = "lhs", count = {points}, seed = 1 }}\n{axes}')
        began = time.monotonic()
        subprocess.run([program, "run", study, "--db", pathlib.Path(folder, "sample.db"), "--workers", str(workers),
                        "--limit", "0"], check=True, capture_output=True)
        return time.monotonic() - began


def solve_s(points, falls):
    """Seconds that this process takes to solve `points` points with `falls` values of E."""
    draw = np.random.default_rng(1)
    keys = {key: draw.uniform(*limits, points) for key, limits in RANGES.items()}
    keys["E"] = np.resize(np.linspace(*RANGES["E"], falls), points)
    began = time.monotonic()
    oblique.solve_many(elements_per_link=16, **keys)
    return time.monotonic() - began


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    part = 10 if "quick" in sys.argv[2:] else 1
    fall_s = (solve_s(160, 160) - solve_s(160, 1)) / 160
    contact_s = (solve_s(2000, 1) - solve_s(200, 1)) / 1800
    few, many = (run_s(program, 1000, falls, 1) for falls in (12, 21))
    sums = (12 * fall_s + 1000 * contact_s) / (21 * fall_s + 1000 * contact_s)
    print(f"1,000 points with 12 falls: {1000 / few:.0f} points/s; with 21: {1000 / many:.0f} points/s; "
          f"ratio {few / many:.2f}, of the sums {sums:.2f}", flush=True)
    points, falls = 20_000 // part, 500 // part
    expected_s = falls * fall_s + points * contact_s
    print(f"a fall {1e3 * fall_s:.1f} ms, a contact {1e3 * contact_s:.2f} ms, on all cores; {points} points with "
          f"{falls} falls: {expected_s:.1f} s", flush=True)
    for workers in (1, 4):
        taken_s = run_s(program, points, falls, workers)
        print(f"on {workers} worker process{'' if workers == 1 else 'es'}: {taken_s:.1f} s, "
              f"ratio {taken_s / expected_s:.2f}", flush=True)


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Compares the time that `oblique study check` predicts with that of `oblique run`, for each case, each with its
own database. Prints the times and predicted/measured. tests/bench/predicted_time.py build/release/bin [CASE
...]"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

POINT = ["--H", "0.8:1.1", "--mu", "0.1:2", "--e", "0.5:1"]
MESH = ["--elements-per-link", "16"]
CASES = {
    "grid": [*MESH, "--H", "0.8:1.1:20", "--mu", "0.1:2:20", "--e", "0.5:1:20"],
    "grid on 4 elements": ["--preset", "paper", "--H", "0.8:1.1:50", "--mu", "0.1:2:40", "--e", "0.5:1:40"],
    "21 values of E": [*MESH, "--sample", "lhs:20000:1", *POINT, "--E", "6e10:8e10:21"],
    "each its own E": [*MESH, "--sample", "lhs:400:1", *POINT, "--E", "6e10:8e10"],
    "converged": ["--preset", "converged", "--sample", "lhs:1000:1", *POINT, "--k", "1e7:1e8"],
    "errors": [*MESH, "--sample", "lhs:4000:1", *POINT, "--errors"],
}


def main(programs, names):
    oblique = str(pathlib.Path(programs).resolve() / "oblique")
    for name in names or CASES:
        with tempfile.TemporaryDirectory() as folder:
            check = subprocess.run([oblique, "study", "check", "--json", *CASES[name]],
                                   check=True, capture_output=True, text=True, cwd=folder)
            begun = time.perf_counter()
            subprocess.run([oblique, "run", "--limit", "0", *CASES[name]],
                           check=True, capture_output=True, cwd=folder)
            measured = time.perf_counter() - begun
        predicted = json.loads(check.stdout)
        print(f"{name}: {predicted['points']} points, {predicted['falls']} falls: predicted {predicted['time_s']:.1f} s, "
              f"measured {measured:.1f} s, ratio {predicted['time_s'] / measured:.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])

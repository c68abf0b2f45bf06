"""Draws a picture of a running study each second until it is done.

  oblique run first.toml &
  python3 running.py oblique.db first          draws first.png
"""
import sqlite3
import sys
import time

import matplotlib
matplotlib.use("Agg")  # draws into a file; for a window, remove this line and use pyplot.pause(1)
import pandas
from matplotlib import pyplot

file, study = sys.argv[1:3]
# Opens the file read-only. The server keeps writing; each connection sees the state at one instant.
database = sqlite3.connect(f"file:{file}?mode=ro", uri=True)


def look():
    """The state of the study, its number of points, and its results so far."""
    found = database.execute("SELECT state, points FROM studies WHERE name = ?", [study]).fetchone()
    if found is None:
        sys.exit(f"there is no study called {study} in {file}")
    runs = pandas.read_sql_query(
        "SELECT mu, e, duration_s, stick_total_s FROM runs WHERE study = ? AND status = 'solved' ORDER BY mu",
        database, params=[study])
    return *found, runs


figure, (lasting, sticking) = pyplot.subplots(2, sharex=True, layout="constrained")
while True:
    state, points, runs = look()
    for axes in lasting, sticking:
        axes.clear()
    for e, group in runs.groupby("e"):
        lasting.plot(group.mu, group.duration_s * 1e6, ".", label=f"e* = {e:g}")
        sticking.plot(group.mu, group.stick_total_s * 1e6, ".")
    lasting.set(ylabel="contact lasts [µs]", title=f"{study}: {len(runs)} of {points} points")
    sticking.set(xlabel="coefficient of friction", ylabel="time in stick [µs]")
    if len(runs):
        lasting.legend()
    figure.savefig(f"{study}.png", dpi=110)
    print(f"{len(runs)} of {points} points, {state}")
    if state != "running":
        break
    time.sleep(1)

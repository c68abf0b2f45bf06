#!/usr/bin/env python3
"""Checks a map that `oblique map --of major_mode --format json` printed, by solving points anew.

    PYTHONPATH=build/release/python tests/bench/map_check.py map.json --e 1 --preset paper [--points 100000]

Both sides of every vertex must have the modes that it names. Random points are compared with the regions
that the curves enclose, inside the box around all vertices; those within a bracket's width of a curve do
not count. Ends with 1 where a side is wrong. All flags behind the file but --points are keys that the points share.
"""

import argparse
import json
import sys

import numpy as np

import oblique


def modes(found, keys, x, y):
    return oblique.solve_many(**{found["x"]: x, found["y"]: y, **keys}).major_mode


def wrong_sides(found, keys):
    vertices = found["vertices"]
    along_x = np.array([vertex["along"] == "x" for vertex in vertices])
    x, y, width = (np.array([vertex[name] for vertex in vertices]) for name in ("x", "y", "width"))
    wrong = np.zeros(len(vertices), dtype=bool)
    for side, name in ((-0.5, "from"), (0.5, "to")):
        solved = modes(found, keys, x + np.where(along_x, side * width, 0), y + np.where(along_x, 0, side * width))
        wrong |= solved != np.array([vertex[name] for vertex in vertices], dtype=object)
    return int(wrong.sum())


def segments(found):
    """Chords as rows x0, y0, x1, y1, and the regions to the left and the right of each."""
    vertices = found["vertices"]
    at = np.array([(vertex["x"], vertex["y"]) for vertex in vertices])
    curves_of = np.bincount([vertex for curve in found["curves"] for vertex in set(curve)])
    rows, sides = [], []
    for curve in found["curves"]:
        inner = [i for i, vertex in enumerate(curve) if curves_of[vertex] == 1]
        if not inner:  # both its vertices belong to other borders too
            continue
        # Each vertex is inside a bracket along x or y, whose ends are in the regions `from` and
        # `to`. If the turn is positive, the end in `to` is on the left side of the curve.
        turns = []
        for i in inner:
            direction = at[curve[min(i + 1, len(curve) - 1)]] - at[curve[max(i - 1, 0)]]
            turns.append(-direction[1] if vertices[curve[i]]["along"] == "x" else direction[0])
        turn = max(turns, key=abs)
        if turn == 0:  # the border is inside one side of a cell
            continue
        vertex = vertices[curve[inner[turns.index(turn)]]]
        left, right = (vertex["to"], vertex["from"]) if turn > 0 else (vertex["from"], vertex["to"])
        for one, other in zip(curve, curve[1:]):
            rows.append((*at[one], *at[other]))
            sides.append((left, right))
    return np.array(rows), sides


def judged(found, x, y):
    """The region of each point: the region on its side of the nearest chord to its right or, without one, to its
    left."""
    rows, sides = segments(found)
    names = [region["name"] for region in found["regions"]]
    order = np.argsort(y)
    sorted_y = y[order]
    nearest = {1: np.full(len(x), np.inf), -1: np.full(len(x), np.inf)}
    region = {1: np.full(len(x), -1), -1: np.full(len(x), -1)}
    for (x0, y0, x1, y1), (left, right) in zip(rows, sides):
        begin, end = np.searchsorted(sorted_y, (min(y0, y1), max(y0, y1)))
        these = order[begin:end]
        if len(these) == 0:
            continue
        offset = x0 + (y[these] - y0) / (y1 - y0) * (x1 - x0) - x[these]
        for sign in (1, -1):
            # A chord towards higher y has its left side at lower x.
            name = left if (y1 > y0) == (sign == 1) else right
            closer = (sign * offset > 0) & (sign * offset < nearest[sign][these])
            nearest[sign][these[closer]] = sign * offset[closer]
            region[sign][these[closer]] = names.index(name)
    both = np.where(region[1] >= 0, region[1], region[-1])
    return both, names, np.minimum(nearest[1], nearest[-1])


def main():
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("map")
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    known, rest = parser.parse_known_args()
    keys = {name.removeprefix("--"): value for name, value in zip(rest[::2], rest[1::2])}
    keys = {name: value if name == "preset" else float(value) for name, value in keys.items()}
    with open(known.map, encoding="utf-8") as file:
        found = json.load(file)
    sides = wrong_sides(found, keys)
    print(f"{len(found['vertices'])} vertices, {sides} with a wrong side")
    random = np.random.default_rng(known.seed)
    low_x, high_x = np.quantile([vertex["x"] for vertex in found["vertices"]], (0, 1))
    low_y, high_y = np.quantile([vertex["y"] for vertex in found["vertices"]], (0, 1))
    x, y = random.uniform(low_x, high_x, known.points), random.uniform(low_y, high_y, known.points)
    regions, names, nearest = judged(found, x, y)
    solved = modes(found, keys, x, y)
    counts = (regions >= 0) & (nearest > found["bracket"] * (high_x - low_x))
    wrong = counts & (solved != np.array([*names, None], dtype=object)[regions])
    unknown = int((regions < 0).sum())
    print(f"{known.points} random points, {int(wrong.sum())} misjudged, {unknown} in rows without a border")
    for i in np.flatnonzero(wrong)[:20]:
        where = f"{found['x']} = {x[i]:.6f}, {found['y']} = {y[i]:.6f}"
        print(f"  {where}: {solved[i]}, not {names[regions[i]]}; {nearest[i]:.1e} from a chord")
    return 1 if sides else 0


if __name__ == "__main__":
    sys.exit(main())

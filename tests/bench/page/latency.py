#!/usr/bin/env python3
"""How long the page waits for a server's answers, seen by a browser that asks one thing at a time.

  latency.py PAGE slices STUDY [Z]    a study of a grid over mu, H and e: opening it, the first slice
                                           of a column, the next ones, 200 moves of a slider, conditions
  latency.py PAGE tabs COUNT SECONDS  holds so many event streams open, and tells what came
  latency.py PAGE share COUNT SECONDS PAIRS PID
                                           so many tabs open for so long, then closed for as long, and
                                           so on, while workers solve: what they cost the server, the
                                           process PID of this machine, and what is stored a second

PAGE is the address that the server prints, with its token. Times in ms.
"""

import http.client
import json
import os
import pathlib
import select
import statistics
import sys
import time
import urllib.parse


class Page:
    def __init__(self, address):
        url = urllib.parse.urlsplit(address)
        self.host, self.port = url.hostname, url.port
        answer, _ = self.ask("/?" + url.query)
        self.cookie = answer.getheader("Set-Cookie", "").split(";")[0]

    def connection(self, path):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=30)
        connection.request("GET", path, headers={"Cookie": getattr(self, "cookie", "")})
        return connection

    def ask(self, path):
        connection = self.connection(path)
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        if answer.status not in (200, 303):
            sys.exit(f"{path}: {answer.status} {body[:300]!r}")
        return answer, body

    def timed(self, path):
        began = time.monotonic()
        body = self.ask(path)[1]
        return (time.monotonic() - began) * 1e3, len(body)


def told(what, times, size=0):
    ranked = sorted(times)
    print(f"{what:58} median {ranked[len(ranked) // 2]:7.1f}   95 % {ranked[int(len(ranked) * 0.95)]:7.1f}"
          f"   most {ranked[-1]:7.1f}   {size:8} bytes", flush=True)


def slices(page, study, z):
    at = f"/api/studies/{study}"
    told("the study", [page.timed(at)[0] for _ in range(5)])
    held = next(axis["values"] for axis in json.loads(page.ask(at)[1])["blocks"][0]["axes"] if axis["key"] == "e")
    view = f"{at}/slice?z={z}&x=mu&y=H&nx=256&ny=256&at=e@"
    first, size = page.timed(view + "0")
    told("the first slice of a column", [first], size)
    second, size = page.timed(view + "1")
    told("the second, while the column may still be read", [second], size)
    time.sleep(5)
    told("the same slice 50 times", [page.timed(view + "1")[0] for _ in range(50)], size)
    told("200 moves of a slider", [page.timed(f"{view}{move % held}")[0] for move in range(200)], size)
    for where in ("fn_peak_N > 5", "mu < 0.5 AND fn_peak_N > 5", "major_mode LIKE '%SC%'"):
        asked = urllib.parse.quote(where)
        told(f"40 moves where {where}",
             [page.timed(f"{view}{move % held}&where={asked}")[0] for move in range(40)], size)
        told(f"bins where {where}, the first",
             [page.timed(f"{at}/bins?x={z}&nx=64&where={asked}")[0]], size)
        told(f"bins where {where}, the next five",
             [page.timed(f"{at}/bins?x={z}&nx={65 + i}&where={asked}")[0] for i in range(5)], size)


def watch(page, count, seconds):
    """Holds tabs open; the bytes that came."""
    connections = [page.connection("/api/events") for _ in range(count)]
    sockets = [connection.sock for connection in connections]
    came, until = 0, time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        for ready in select.select(sockets, [], [], left)[0]:
            came += len(ready.recv(1 << 20))
    for connection in connections:
        connection.close()
    return came


def tabs(page, count, seconds):
    print(f"{count} tabs took {watch(page, count, seconds)} bytes in {seconds} s", flush=True)


def processor_s(process):
    """Processor time of a process, by thread."""
    times = {}
    for thread in pathlib.Path(f"/proc/{process}/task").iterdir():
        times[thread.name] = int((thread / "schedstat").read_text().split()[0]) * 1e-9
    return times


def solved(page):
    for line in page.ask("/metrics")[1].decode().splitlines():
        if line.startswith("oblique_points_solved_total "):
            return float(line.split()[1])
    return 0.0


def share(page, count, seconds, pairs, process):
    found = {True: [], False: []}
    first = None
    for turn in range(2 * pairs):
        is_open = turn % 4 in (0, 3)  # open, closed, closed, open: what drifts meets both alike
        began, points, spent = time.monotonic(), solved(page), processor_s(process)
        first = first or spent
        watch(page, count if is_open else 0, seconds)
        took, stored = time.monotonic() - began, solved(page) - points
        after = processor_s(process)
        cost = {thread: (after[thread] - spent.get(thread, 0.0)) / took for thread in after}
        found[is_open].append((stored / took, sum(cost.values()), cost))
    name = {thread: pathlib.Path(f"/proc/{process}/task/{thread}/comm").read_text().strip() for thread in first}
    cores = len(os.sched_getaffinity(0))
    rates = {is_open: [rate for rate, _, _ in those] for is_open, those in found.items()}
    costs = {is_open: [cost for _, cost, _ in those] for is_open, those in found.items()}
    print(f"{cores} cores, {pairs} pairs of {seconds} s: {count} tabs and none, mean and its standard error")
    for what, values, scale in (("points stored a second", rates, 1.0), ("processor time of the server [ms a second]", costs, 1e3)):
        with_tabs, without = ([scale * value for value in values[is_open]] for is_open in (True, False))
        changes = [one - other for one, other in zip(with_tabs, without)]
        print(f"{what:45} {statistics.mean(with_tabs):9.1f} {statistics.mean(without):9.1f}   difference "
              f"{statistics.mean(changes):8.1f} ± {error_of(changes):.1f}")
    changes = [one - other for one, other in zip(costs[True], costs[False])]
    print(f"that is {100 * statistics.mean(changes) / cores:.2f} ± {100 * error_of(changes) / cores:.2f} % of all processor time; the rate "
          f"{100 * (statistics.mean(rates[True]) / statistics.mean(rates[False]) - 1):.1f} ± "
          f"{100 * error_of([one / other for one, other in zip(rates[True], rates[False])]):.1f} %")
    by_point = {is_open: sum(costs[is_open]) / max(sum(rates[is_open]), 1.0) for is_open in costs}
    print(f"processor time of the server a point [us]: {1e6 * by_point[True]:.2f} with, {1e6 * by_point[False]:.2f} without")
    for thread in sorted(first, key=int):
        means = {is_open: statistics.mean(cost.get(thread, 0.0) for _, _, cost in those) for is_open, those in found.items()}
        if means[True] + means[False] > 1e-4:
            print(f"  thread {thread} {name[thread]:16} {1e3 * means[True]:8.2f} {1e3 * means[False]:8.2f} ms a second")


def error_of(values):
    return statistics.stdev(values) / len(values) ** 0.5 if len(values) > 1 else float("nan")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    if sys.argv[2] == "tabs":
        tabs(Page(sys.argv[1]), int(sys.argv[3]), float(sys.argv[4]))
    elif sys.argv[2] == "share" and len(sys.argv) == 7:
        share(Page(sys.argv[1]), int(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5]), int(sys.argv[6]))
    else:
        slices(Page(sys.argv[1]), sys.argv[3], sys.argv[4] if len(sys.argv) > 4 else "fn_peak_N")

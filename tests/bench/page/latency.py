#!/usr/bin/env python3
"""How long the page waits for a server's answers, seen by a browser that asks one thing at a time.

  latency.py PAGE slices STUDY [Z]    a study of a grid over mu, H and e: opening it, slices, bins,
                                           conditions
  latency.py PAGE tabs COUNT SECONDS  holds so many event streams open, and tells what came
  latency.py PAGE share COUNT SECONDS PAIRS PID [LOOKING STUDY]
                                           so many tabs open for so long, then closed for as long, and
                                           so on, while workers solve: what they cost the server, the
                                           process PID of this machine with its children, and what is
                                           stored a second. LOOKING of the tabs show STUDY, a grid over
                                           mu and H that runs: a slice and rows each 1.5 s

PAGE is the address that the server prints, with its token. Times in ms.
"""

import concurrent.futures
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

    def connection(self, path, **headers):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=30)
        connection.request("GET", path, headers={"Cookie": getattr(self, "cookie", ""), **headers})
        return connection

    def ask(self, path, **headers):
        connection = self.connection(path, **headers)
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
    told("the first slice", [first], size)
    told("40 moves of a slider", [page.timed(f"{view}{move % held}")[0] for move in range(40)], size)
    told("bins of two columns", [page.timed(f"{at}/bins?x={z}&y=duration_s&z=slide_m&nx=96&ny=96")[0] for _ in range(5)])
    for where in ("fn_peak_N > 5", "mu < 0.5 AND fn_peak_N > 5", "major_mode LIKE '%SC%'"):
        asked = urllib.parse.quote(where)
        told(f"40 moves where {where}",
             [page.timed(f"{view}{move % held}&where={asked}")[0] for move in range(40)], size)
        told(f"bins where {where}", [page.timed(f"{at}/bins?x={z}&nx=64&where={asked}")[0] for _ in range(5)])


LOOK_AGAIN_S = 1.5  # study.js
LONGEST_SNAPSHOT_S = 2.0


def look(page, study, until):
    """Asks until then what a tab asks that shows a study which runs: the next time begins behind the answers."""
    slice_of = f"/api/studies/{study}/slice?z=fn_peak_N&x=mu&y=H&nx=256&ny=256"
    while time.monotonic() < until:
        page.ask(slice_of)
        page.ask(f"/api/studies/{study}/rows?order=point&limit=26")
        time.sleep(max(0.0, min(LOOK_AGAIN_S, until - time.monotonic())))


def watch(page, count, seconds, looking=0, study=0):
    """Holds tabs open, so many of which show a study that runs; the bytes of events that came."""
    threads = concurrent.futures.ThreadPoolExecutor(max(looking, 1))
    lookers = [threads.submit(look, page, study, time.monotonic() + seconds) for _ in range(looking)]
    connections = [page.connection("/api/events") for _ in range(count)]
    sockets = [connection.sock for connection in connections]
    came, until = 0, time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        for ready in select.select(sockets, [], [], left)[0]:
            came += len(ready.recv(1 << 20))
    for connection in connections:
        connection.close()
    for looker in lookers:
        looker.result()
    return came


def tabs(page, count, seconds):
    print(f"{count} tabs took {watch(page, count, seconds)} bytes in {seconds} s", flush=True)


def processor_s(process):
    """Processor time of a process, by thread, and of its children, which read rows and draw."""
    times, children = {}, 0.0
    for thread in pathlib.Path(f"/proc/{process}/task").iterdir():
        times[thread.name] = int((thread / "schedstat").read_text().split()[0]) * 1e-9
        for child in (thread / "children").read_text().split():
            try:
                children += sum(processor_s(child).values())
            except OSError:
                pass  # it ended, and is among those that were waited for
    ended = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[13:15]
    times["children"] = children + sum(map(int, ended)) / os.sysconf("SC_CLK_TCK")
    return times


def solved(page):
    for line in page.ask("/metrics")[1].decode().splitlines():
        if line.startswith("oblique_points_solved_total "):
            return float(line.split()[1])
    return 0.0


def solved_now(page):
    """(time [s], points that were solved until then): the number is of the server's last snapshot, half a second old at
    most while tabs are open, and so is waited for until it is another."""
    until, before = time.monotonic() + LONGEST_SNAPSHOT_S, solved(page)
    while (points := solved(page)) == before and time.monotonic() < until:
        time.sleep(0.005)
    return time.monotonic(), points


def alternated(page, count, seconds, pairs, process, looking=0, study=0):
    """(points stored a second, processor time of the server [s/s] by thread) of each turn, with tabs (True) and without, in pairs."""
    found = {True: [], False: []}
    for turn in range(2 * pairs):
        is_open = turn % 4 in (0, 3)  # open, closed, closed, open: what drifts meets both alike
        (began, points), spent = solved_now(page), processor_s(process)
        watch(page, count if is_open else 0, seconds, looking if is_open else 0, study)
        (ended, stored), after = solved_now(page), processor_s(process)
        took, stored = ended - began, stored - points
        found[is_open].append((stored / took, {thread: (after[thread] - spent.get(thread, 0.0)) / took for thread in after}))
    return found


def changes_of(found):
    """Mean and standard error of what the tabs take: processor time of the server, at the same points stored, and the rate; in % of all there is."""
    pairs = list(zip(found[True], found[False]))
    cores = len(os.sched_getaffinity(0))
    spent = [100 * (sum(one[1].values()) - sum(other[1].values()) * one[0] / other[0]) / cores for one, other in pairs]
    rates = [100 * (one[0] / other[0] - 1) for one, other in pairs]
    return [(statistics.mean(values), error_of(values)) for values in (spent, rates)]


def share(page, count, seconds, pairs, process, looking=0, study=0):
    found = alternated(page, count, seconds, pairs, process, looking, study)
    print(f"{len(os.sched_getaffinity(0))} cores, {pairs} pairs of {seconds} s: {count} tabs, {looking} of them at a study, and none; means")
    rates = {is_open: statistics.mean(rate for rate, _ in those) for is_open, those in found.items()}
    costs = {is_open: statistics.mean(sum(cost.values()) for _, cost in those) for is_open, those in found.items()}
    print(f"points stored a second                        {rates[True]:9.1f} {rates[False]:9.1f}")
    print(f"processor time of the server [ms a second]    {1e3 * costs[True]:9.1f} {1e3 * costs[False]:9.1f}")
    print(f"processor time of the server a point [us]     {1e6 * costs[True] / max(rates[True], 1.0):9.2f} {1e6 * costs[False] / max(rates[False], 1.0):9.2f}")
    (spent, spent_error), (rate, rate_error) = changes_of(found)
    print(f"at the same rate the tabs take {spent:.2f} ± {spent_error:.2f} % of all processor time; the rate {rate:.1f} ± {rate_error:.1f} %")
    for thread in sorted({thread for _, cost in found[True] for thread in cost}):
        means = {is_open: statistics.mean(cost.get(thread, 0.0) for _, cost in those) for is_open, those in found.items()}
        comm = pathlib.Path(f"/proc/{process}/task/{thread}/comm")
        if means[True] + means[False] > 1e-4:
            name = comm.read_text().strip() if comm.exists() else ""
            print(f"  {thread:9} {name:16} {1e3 * means[True]:8.2f} {1e3 * means[False]:8.2f} ms a second")


def error_of(values):
    return statistics.stdev(values) / len(values) ** 0.5 if len(values) > 1 else float("nan")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    if sys.argv[2] == "tabs":
        tabs(Page(sys.argv[1]), int(sys.argv[3]), float(sys.argv[4]))
    elif sys.argv[2] == "share" and len(sys.argv) in (7, 9):
        share(Page(sys.argv[1]), int(sys.argv[3]), float(sys.argv[4]), *map(int, sys.argv[5:]))
    else:
        slices(Page(sys.argv[1]), sys.argv[3], sys.argv[4] if len(sys.argv) > 4 else "fn_peak_N")

#!/usr/bin/env python3
"""How long the page waits for a server's answers, seen by a browser that asks one thing at a time.

  latency.py PAGE slices STUDY [Z]    a study of a grid over mu, H and e: opening it, the first slice
                                           of a column, the next ones, 200 moves of a slider, conditions
  latency.py PAGE tabs COUNT SECONDS  holds so many event streams open, and tells what came

PAGE is the address that the server prints, with its token. Times in ms.
"""

import http.client
import json
import select
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


def tabs(page, count, seconds):
    sockets = []
    for _ in range(count):
        connection = page.connection("/api/events")
        sockets.append(connection.sock)
    came, until = 0, time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        for ready in select.select(sockets, [], [], left)[0]:
            came += len(ready.recv(1 << 20))
    print(f"{count} tabs took {came} bytes in {seconds} s", flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    if sys.argv[2] == "tabs":
        tabs(Page(sys.argv[1]), int(sys.argv[3]), float(sys.argv[4]))
    else:
        slices(Page(sys.argv[1]), sys.argv[3], sys.argv[4] if len(sys.argv) > 4 else "fn_peak_N")

#!/bin/sh
# Submits a study, waits until it is solved and queries it. Needs a server and a worker, for example
#   oblique-server & oblique-worker &
# If the server runs on another machine, set OBLIQUE_SERVER and, with keys, OBLIQUE_KEYS.
# sh study.sh NAME
set -eu
study=${1:?"sh study.sh NAME"}
export OBLIQUE_SERVER="${OBLIQUE_SERVER:-tcp://127.0.0.1:7600}"

# Submitting the same study again continues it; with more points it grows.
oblique submit --name "$study" --H 1 --mu 0.2:1.6:8 --e 0.8,1 --quiet

# Waits for the end. Exit codes: 0 all points are solved, 1 some are not, 130 after Ctrl-C. After
# Ctrl-C the study continues.
code=0
oblique watch "$study" --quiet || code=$?
if [ "$code" = 1 ]; then
  echo "These points of $study have no result:" >&2
  oblique query "$study" --where "status <> 'solved'" --select point,mu,e,error >&2
fi
[ "$code" = 0 ] || exit "$code"

# Standard output contains only data.
oblique query "$study" --where "e = 1" --select mu,fn_peak_N,ft_peak_N --format csv > "$study.csv"
largest=$(oblique query "$study" --select "max(fn_peak_N)" --format csv | tail -n 1)
echo "largest normal force of $study: $largest N"

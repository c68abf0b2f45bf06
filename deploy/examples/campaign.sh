#!/bin/sh
# Runs a study on a Slurm cluster from its login node: starts a server on this node, and jobs with
# workers while points are open. After Ctrl-C the same command continues the study.
#   sh campaign.sh STUDY.toml [MOST-JOBS]
# HOST is the name under which the nodes reach this machine. The database must not be on a network
# disk.
set -eu
file=${1:?"sh campaign.sh STUDY.toml [MOST-JOBS]"} most=${2:-4}
host=${HOST:-$(hostname)}
client_port=${OBLIQUE_SERVER_CLIENT_PORT:-7600} worker_port=${OBLIQUE_SERVER_WORKER_PORT:-7601}

# Creates keys on the first run, so that nobody else on the cluster can read or write results.
[ -d keys ] || oblique keygen keys

# When this script ends, it ends the jobs first and then the server.
oblique-server --listen '*' --keys keys/server.key --db campaign.db 2> server.log &
server=$!
export OBLIQUE_SERVER="tcp://$host:$client_port" OBLIQUE_KEYS="$PWD/keys/client.key"
export OBLIQUE_WORKER_SERVER="tcp://$host:$worker_port" OBLIQUE_WORKER_KEYS="$PWD/keys/worker.key"
jobs="oblique@$host:$client_port" scaling=
end() {
  code=$?
  [ "$code" = 0 ] || tail -n 3 server.log >&2
  [ -z "$scaling" ] || kill "$scaling" 2> /dev/null || true
  # Cancelled workers deliver their results before they end.
  scancel --quiet --name="$jobs" || true
  while [ -n "$(squeue --noheader --me --name="$jobs")" ]; do sleep 1; done
  kill "$server" 2> /dev/null || true
  wait
}
trap end EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# `oblique` waits up to 10 s for the server, which may not answer yet.
study=$(basename "$file" .toml)
oblique submit "$file" --name "$study"

# Add more arguments of sbatch, such as a partition: --sbatch-args "--partition=short
# --account=lab7"
oblique autoscale slurm --name "$jobs" --max "$most" ${SBATCH_ARGS:+--sbatch-args "$SBATCH_ARGS"} 2> autoscale.log &
scaling=$!

# Exit codes: 0 all points are solved, 1 some are not. Those that are solved are exported.
code=0
oblique watch "$study" || code=$?
[ "$code" -le 1 ] || exit "$code"
oblique query "$study" --format csv > "$study.csv"
echo "$(tail -n +2 "$study.csv" | wc -l) results in $study.csv"
exit "$code"

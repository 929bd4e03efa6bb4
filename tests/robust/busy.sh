#!/usr/bin/env bash
# Runs a command while N busy loops take the machine; they end with it. usage: busy.sh N COMMAND...    e.g. tests/robust/busy.sh 16 ./test
set -u
n=$1
shift
loops=()
trap 'kill "${loops[@]}" 2>/dev/null' EXIT
for _ in $(seq "$n"); do
  (while :; do :; done) &
  loops+=($!)
done
"$@"

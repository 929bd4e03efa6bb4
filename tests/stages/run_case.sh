#!/usr/bin/env bash
# Runs one line of a .cases file in a fresh folder. usage: run_case.sh FILE NAME BIN_DIR FIXTURES SOURCE_DIR
# A line is "name | shell commands"; it passes when the commands exit with 0. Helpers:
#   fails CODE 'text' command...   the command must exit with CODE and print the text on standard error
#   same A B                       the files must be equal byte for byte
#   value FILE key                 a top-level key of a JSON file
#   soon command...                waits until the command succeeds, a minute at most
#   holds FILE bytes               the file is at least that long
#   nobody command...              as a user without rights; exits the case with 77 (skipped) where that cannot be tried
#   hears_interrupt PID            the process has its handler for SIGINT (bit 2 of the signals that it catches)
set -euo pipefail
export LANGUAGE=en  # what is compared is English, wherever it runs
file=$1 name=$2 bin=$3 fixtures=$4 source=$5
PATH=$bin:$PATH
exec </dev/null
line=$(grep -m 1 -E "^$name *\|" "$file")
[ -n "$line" ] || { echo "no case '$name' in $file"; exit 1; }
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-case-XXXXXX")
trap 'chmod -R u+rwx "$work" 2>/dev/null; rm -rf "$work" "$work.state"' EXIT
export XDG_STATE_HOME=$work.state # what prepare remembers of this user's files
cd "$work"
fails() {
  local code=$1 text=$2 got=0
  shift 2
  "$@" >stdout.txt 2>stderr.txt || got=$?
  [ "$got" -eq "$code" ] || { echo "exit code $got, not $code: $*"; cat stderr.txt; exit 1; }
  grep -qF -- "$text" stderr.txt || { echo "standard error does not say '$text':"; cat stderr.txt; exit 1; }
  ! grep -qE 'ERR\||terminate called|Segmentation' stderr.txt || { echo "noise on standard error:"; cat stderr.txt; exit 1; }
}
same() { cmp "$1" "$2"; }
value() { python3 -c 'import json,sys; print(json.load(open(sys.argv[1]))[sys.argv[2]])' "$1" "$2"; }
soon() {
  for _ in $(seq 600); do "$@" 2>/dev/null && return; sleep 0.1; done
  echo "never came: $*"
  return 1
}
holds() { [ "$(stat -c %s "$1" 2>/dev/null || echo 0)" -ge "$2" ]; }
nobody() {
  [ "$(id -u)" -eq 0 ] || { "$@"; return; }
  chmod a+rx . && setpriv --reuid=65534 --regid=65534 --clear-groups test -x "$(command -v osteo)" || exit 77
  setpriv --reuid=65534 --regid=65534 --clear-groups "$@"
}
# At the end of a pipe grep and head leave as soon as they know, and what still writes into it would fail: they read it out first.
grep() { read_out grep "$@"; }
head() { read_out head "$@"; }
read_out() {
  local code=0
  command "$@" || code=$?
  [ ! -p /dev/stdin ] || cat >/dev/null
  return $code
}
hears_interrupt() { grep -qE '^SigCgt:.*[2367abef]$' "/proc/$1/status"; }
export -f fails same value soon holds nobody hears_interrupt grep head read_out; export fixtures PATH
eval "${line#*|}"

#!/usr/bin/env bash
# What earlier versions wrote still opens and replays to the bit: cases and sessions in testdata/recorded, one folder a version.
# usage: check_recorded.sh BIN_DIR TESTDATA WORK
set -euo pipefail
bin=$1 testdata=$2 work=$3
rm -rf "$work" && mkdir -p "$work"
export XDG_STATE_HOME=$work/state
replayed=0
for version in "$testdata"/recorded/*/; do
  name=$(basename "$version")
  cp -r "$version" "$work/$name"
  "$bin/osteo" info "$work/$name/case" | grep -q "^Voxels" || { echo "$name: its case is not read"; exit 1; }
  for session in "$work/$name"/*/session.json; do
    folder=$(dirname "$session")
    "$bin/osteo" replay "$folder" >"$work/said" 2>&1 || { echo "$folder does not replay:"; cat "$work/said"; exit 1; }
    grep -q "bit for bit the same" "$work/said" || { cat "$work/said"; exit 1; }
    # The same bone as the version that recorded it ended with, by its own summary.
    hash=$(sed -nE 's/.*"bone_hash": "([0-9a-f]+)".*/\1/p' "$folder/summary.json")
    [ -n "$hash" ] && grep -q "bone $hash" "$work/said" || { echo "$folder: another bone than $hash"; cat "$work/said"; exit 1; }
    "$bin/osteo" score "$folder" --json >"$work/score.json" || { echo "$folder is not scored"; exit 1; }
    replayed=$((replayed + 1))
  done
done
[ "$replayed" -ge 3 ] || { echo "only $replayed sessions found"; exit 1; }
echo "$replayed recorded sessions replay to the bit"

#!/usr/bin/env bash
# What earlier versions wrote still opens, is scored and replays to the bit: cases and sessions in testdata/recorded, one folder a version.
# Where the arithmetic of contact has changed since (a file "older-arithmetic" says when), a replay is refused for that reason, and all else works.
# usage: check_recorded.sh BIN_DIR TESTDATA WORK
set -euo pipefail
bin=$1 testdata=$2 work=$3
rm -rf "$work" && mkdir -p "$work"
export XDG_STATE_HOME=$work/state
replayed=0 refused=0
for version in "$testdata"/recorded/*/; do
  name=$(basename "$version")
  cp -r "$version" "$work/$name"
done
for version in "$work"/*/; do
  name=$(basename "$version")
  [ "$name" != state ] || continue
  [ ! -d "$version/case" ] || "$bin/osteo" info "$work/$name/case" | grep -q "^Voxels" || { echo "$name: its case is not read"; exit 1; }
  for session in "$work/$name"/*/session.json; do
    folder=$(dirname "$session")
    "$bin/osteo" score "$folder" --json >"$work/score.json" || { echo "$folder is not scored"; exit 1; }
    if [ -e "$version/older-arithmetic" ]; then
      ! "$bin/osteo" replay "$folder" >"$work/said" 2>&1 || { echo "$folder replays: take 'older-arithmetic' away"; exit 1; }
      grep -q "replay it with 0.1.0 (commit $name" "$work/said" || { echo "$folder: refused without the program to use"; cat "$work/said"; exit 1; }
      "$bin/osteo" export "$folder" "$work/$name.csv" --force --quiet || { echo "$folder is not exported"; exit 1; }
      refused=$((refused + 1))
      continue
    fi
    "$bin/osteo" replay "$folder" >"$work/said" 2>&1 || { echo "$folder does not replay:"; cat "$work/said"; exit 1; }
    grep -q "bit for bit the same" "$work/said" || { cat "$work/said"; exit 1; }
    # The same bone as the version that recorded it ended with, by its own summary.
    hash=$(sed -nE 's/.*"bone_hash": "([0-9a-f]+)".*/\1/p' "$folder/summary.json")
    [ -n "$hash" ] && grep -q "bone $hash" "$work/said" || { echo "$folder: another bone than $hash"; cat "$work/said"; exit 1; }
    replayed=$((replayed + 1))
  done
done
[ "$replayed" -ge 3 ] || { echo "only $replayed sessions found"; exit 1; }
echo "$replayed recorded sessions replay to the bit, $refused of an older arithmetic are read, scored and exported"

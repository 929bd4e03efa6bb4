#!/usr/bin/env bash
# Rehearsals in real time on disks that stall, fill up, or do not know how large they are. usage: check_slow_disk.sh BIN_DIR FIXTURES SLOW_DISK WORK_DIR
set -euo pipefail
bin=$1 fixtures=$2 slow=$3 work=$4
rm -rf "$work" && mkdir -p "$work" && cd "$work"
PATH=$bin:$PATH

# Longer than a ring of 8192 ticks lasts at 5 kHz: nothing is lost.
OSTEO_STALL_AFTER_S=0.3 OSTEO_STALL_S=4 LD_PRELOAD=$slow osteo rehearse "$fixtures/case" --headless --rate-hz 5000 --seconds 4.5 -o s --quiet
python3 -c 'import json; s = json.load(open("s/summary.json")); assert "ticks_not_recorded" not in s and s["ticks"] == 22500, s'
osteo replay s --case-folder "$fixtures/case" --quiet

# Some file systems tell of no blocks: that is not full.
OSTEO_NO_BLOCKS=1 LD_PRELOAD=$slow osteo phantom p.nrrd --spacing-mm 4 --quiet
test -s p.nrrd
echo "a disk that stalls: nothing lost"

# A full disk ends a rehearsal in real time at once, long before its two minutes are over, and what was written replays.
unshare -rm true 2>/dev/null || { echo "no name spaces here: full disk not tried"; exit 0; }
mkdir -p d
unshare -rm bash -c '
  set -e
  mount -t tmpfs -o size=1000k none d
  code=0
  osteo rehearse "'"$fixtures"'/case" --headless --seconds 120 -o d/s --quiet 2> err.txt || code=$?
  test $code -eq 6 && grep -q "No space left" err.txt || { echo "exit code $code:"; cat err.txt; exit 1; }
  osteo replay d/s --case-folder "'"$fixtures"'/case" --quiet'
echo "a full disk: told at once"

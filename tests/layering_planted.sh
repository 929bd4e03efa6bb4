#!/usr/bin/env bash
# The wall between areas holds: layering.py refuses what is planted here. usage: layering_planted.sh SOURCE_DIR
set -euo pipefail
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-layering-XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/docs/developer"
cp -r "$1/libs" "$1/apps" "$work"
cp "$1/docs/developer/architecture.md" "$work/docs/developer"
python3 "$1/tests/layering.py" "$work" >/dev/null || { echo "the copy itself is refused"; exit 1; }
refused() { # FILE LINE WORDS: with LINE as its first the file is refused in these words
  cp "$work/$1" "$work/kept"
  { printf '%s\n' "$2"; cat "$work/kept"; } >"$work/$1"
  if python3 "$source/tests/layering.py" "$work" >"$work/said"; then echo "not refused: '$2' in $1"; exit 1; fi
  grep -qF -- "$3" "$work/said" || { echo "refused, but without '$3':"; cat "$work/said"; exit 1; }
  mv "$work/kept" "$work/$1"
}
source=$1
refused libs/geometry/mesh/src/mesh_info.cpp '#include "osteo/app/cli/command.h"' 'mesh may not include cli'
refused libs/core/data/include/osteo/core/data/frame.h '#include "osteo/geometry/grid/grid_io.h"' 'a public header of data may not include grid'
refused libs/session/scene/src/operation.cpp '#include "osteo/assessment/evidence/metric.h"' 'scene may not include evidence'
refused libs/imaging/image/src/crop.cpp 'namespace osteo::inline geometry { int planted(); }' "in imaging it is 'osteo::inline imaging'"
# A row that reaches into an area that may not be used.
sed -i 's/^sound        | base/sound        scene | base/' "$work/libs/layers.txt"
! python3 "$source/tests/layering.py" "$work" >"$work/said"
grep -q "sound lists scene" "$work/said"
echo "what is planted is refused"

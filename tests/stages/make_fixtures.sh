#!/usr/bin/env bash
# Small inputs that the cases share. usage: make_fixtures.sh BIN_DIR FIXTURES
set -euo pipefail
export LANGUAGE=en
bin=$1 out=$2
rm -rf "$out" && mkdir -p "$out" && cd "$out"
export XDG_STATE_HOME=$out/state
"$bin/osteo" phantom ct.nrrd --labels-out labels.nrrd --region temporal --spacing-mm 1.5 --quiet
"$bin/osteo" import ct.nrrd dicom --quiet
"$bin/osteo" threshold ct.nrrd mask.nrrd --lower 500 --quiet
"$bin/osteo" resample ct.nrrd mask.nrrd bone.vdb --lower 500 --spacing-mm 1 --quiet
"$bin/osteo" surface bone.vdb bone.ply --quiet
"$bin/osteo" prepare ct.nrrd -o case --lower 500 --spacing-mm 1 --quiet
"$bin/osteo" rehearse case --headless --fast --seconds 3 -o session --quiet

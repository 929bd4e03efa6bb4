#!/usr/bin/env bash
# Osteotome inside another project: as a folder (all components configured, one library built shared) and fetched as an archive (built static).
# usage: check_embedded.sh SOURCE_DIR WORK_DIR     what was built is kept in WORK_DIR for the next time
set -euo pipefail
source=$1 work=$2
mkdir -p "$work"
quietly() { "$@" >"$work/said" 2>&1 || { tail -30 "$work/said"; exit 1; }; }
refused() { # WORDS command... fails and says the words
  local words=$1; shift
  ! "$@" >"$work/said" 2>&1 || { echo "this was not refused: $*"; exit 1; }
  tr -s ' \n' ' ' <"$work/said" | grep -qF -- "$words" || { echo "refused without saying '$words':"; tail -20 "$work/said"; exit 1; }
}
common=(-G Ninja -DCMAKE_BUILD_TYPE=Release)

quietly cmake -S "$source/tests/setup/outside" -B "$work/folder" "${common[@]}" -DUSE=folder -DOSTEO_TREE="$source" -DBUILD_SHARED_LIBS=ON
ninja -C "$work/folder" -t targets all | cut -d: -f1 >"$work/targets"
! grep -qE '(^|/)(osteo-rehearse|test_base|osteo_cgal|osteo_tetgen|osteo_movie|osteo_window)$' "$work/targets" || { echo "programs, tests or copyleft parts came along unasked"; exit 1; }
quietly cmake --build "$work/folder" --target one_library
quietly "$work/folder/one_library"
grep -q 'kappa 0.6970' "$work/said" || { cat "$work/said"; exit 1; }
readelf -d "$(find "$work/folder/osteo" -name 'libosteo_statistics.so')" | grep -q 'SONAME.*\[libosteo_statistics.so.0.1\]' || { echo "the shared library's name says nothing of its version"; exit 1; }
# What is ours is shown, what headers of others brought (Boost, Eigen, the standard library) is not.
nm -D --defined-only "$(find "$work/folder/osteo" -name 'libosteo_statistics.so')" | awk '{print $3}' >"$work/shown"
[ "$(grep -c '^_ZN5osteo' "$work/shown")" -gt 40 ] || { echo "the shared library hides what is ours"; exit 1; }
! grep -v '^_Z[A-Z]*N*[A-Z]*5osteo' "$work/shown" || { echo "the shared library shows what is not ours"; exit 1; }
refused "OSTEO_TESTS=OFF" cmake -S "$source/tests/setup/outside" -B "$work/tests-on" "${common[@]}" -DUSE=folder -DOSTEO_TREE="$source" -DOSTEO_TESTS=ON

# As an archive: what would be committed, without what is built.
if command -v git >/dev/null && [ -e "$source/.git" ]; then
  (cd "$source" && git -c safe.directory='*' ls-files -co --exclude-standard | while read -r f; do [ ! -f "$f" ] || echo "$f"; done | grep -v '^docs/\|^testdata/' | tar --transform 's|^|osteotome/|' -cf "$work/new.tar" -T -)
  # A name of its own for each: what was fetched from a name is not fetched again.
  archive=$work/osteotome-$(sha256sum "$work/new.tar" | cut -c1-12).tar
  [ -e "$archive" ] || { rm -f "$work"/osteotome-*.tar; find "$work/fetched" -name 'libosteo_*' -delete 2>/dev/null || true; mv "$work/new.tar" "$archive"; }
  quietly cmake -S "$source/tests/setup/outside" -B "$work/fetched" "${common[@]}" -DUSE=fetched -DOSTEO_ARCHIVE="$archive" -DEXAMPLES=
  quietly cmake --build "$work/fetched" --target one_library
  quietly "$work/fetched/one_library"
  [ -z "$(find "$work/fetched" -name 'libosteo_*.so*' -o -name 'libosteo_view.a' -o -name 'libosteo_io.a')" ] || { echo "more was built than was asked for"; exit 1; }
fi
echo "as a folder and fetched: found, built and run"

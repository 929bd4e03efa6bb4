#!/usr/bin/env bash
# Makes the Debian packages: osteo, osteo-rehearse, osteo-camera, libosteo-dev and python3-osteo without copyleft options, osteo-full with them.
# usage: apps/packaging/debs.sh OUT [--free-only]      builds in build/deb-free and build/deb-full
set -euo pipefail
umask 022 # what is made while packing is for all to read
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
out=${1:?usage: apps/packaging/debs.sh OUT [--free-only]}
mkdir -p "$out"
out=$(cd "$out" && pwd)
: "${SOURCE_DATE_EPOCH:=$(git -c safe.directory='*' -C "$root" log -1 --format=%ct 2>/dev/null || echo 1767225600)}"
export SOURCE_DATE_EPOCH
# No path of the tree in what is packed: the same bytes wherever it is built.
: "${OSTEO_PACKAGER:=Osteotome developers <osteotome@example.org>}" # who gives packages away sets this
flags="-ffile-prefix-map=$root=."
make() { # FOLDER cmake-options...
  local build=$root/build/$1
  shift
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr "-DOSTEO_PACKAGER=$OSTEO_PACKAGER" -DCMAKE_SKIP_RPATH=ON -DOSTEO_TESTS=OFF -DCMAKE_CXX_FLAGS="$flags" "$@" >"$build.configure.log" ||
    { tail -20 "$build.configure.log" >&2; exit 1; }
  cmake --build "$build"
  (cd "$build" && rm -f ./*.deb && cpack -G DEB >"$build.pack.log" 2>&1) || { tail -20 "$build.pack.log" >&2; exit 1; }
  cp "$build"/*.deb "$out"
}
mkdir -p "$root/build"
# Two at once in one tree would take each other's half-made packages away.
exec 9>"$root/build/.debs.lock"
flock -n 9 || { echo "debs.sh is at work in this tree already" >&2; exit 1; }
make deb-free -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF -DOSTEO_MOVIE=OFF
[ "${2:-}" = --free-only ] || make deb-full -DOSTEO_WINDOW=OFF -DOSTEO_PYTHON=OFF
ls -l "$out"/*.deb

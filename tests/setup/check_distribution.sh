#!/usr/bin/env bash
# Another distribution, by hand before a release: everything is built in a root of it, and there the unit tests run and the recorded sessions are
# replayed; both print what is the same here. Wants root, a mirror and mmdebstrap, 6 GB, and the time of a first build.
# usage: check_distribution.sh SUITE ROOT [COMPILER]     SUITE as Debian names it (trixie); ROOT is made where it is not there, and kept
set -euo pipefail
suite=${1:?usage: check_distribution.sh SUITE ROOT [COMPILER]} root=${2:?where the root is, or is to be made} compiler=${3:-g++}
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
command -v mmdebstrap >/dev/null || { echo "mmdebstrap is not here"; exit 77; }
[ "$(id -u)" -eq 0 ] || { echo "a fresh root wants root"; exit 77; }
if [ ! -e "$root" ]; then
  # Names that the suite lacks only tests may want: setup.sh tells of those, and it stops at others.
  mmdebstrap --quiet --variant=apt --aptopt='APT::Install-Recommends "false"' --include=ca-certificates,git "$suite" "$root"
fi
root=$(cd "$root" && pwd)
[ "$(sed -n 's/^VERSION_CODENAME=//p' "$root/etc/os-release")" = "$suite" ] || { echo "$root is not $suite"; exit 2; }
trap 'for m in src/build src dev/pts dev proc; do ! mountpoint -q "$root/$m" || umount "$root/$m"; done' EXIT
mkdir -p "$root/src" "$root/built" "$source_dir/build"
mount --bind "$source_dir" "$root/src"
mount --bind "$root/built" "$root/src/build" # its own, so that nothing of this machine's build is taken
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
mount --bind /dev/pts "$root/dev/pts" # scripts of packages write to a terminal of apt's
cp /etc/resolv.conf "$root/etc" 2>/dev/null || true
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 bash -euo pipefail -c "cd /src && $1"; }
inside 'source libs/cmake/setup.sh && ensure_packages'
[ "$compiler" = g++ ] || inside "command -v $compiler >/dev/null || DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends ${compiler/clang++/clang}"
dir=build/$compiler
inside "cmake -G Ninja -S . -B $dir -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=$compiler >build/configure.log || { tail -20 build/configure.log; exit 1; }"
inside "cmake --build $dir"
inside "ctest --test-dir $dir --output-on-failure -j $(nproc) -L unit"
# It holds each bone's hash against the one that the recording version wrote down.
inside "ctest --test-dir $dir --output-on-failure -R '^robust.recorded$' -V" | grep 'replay to the bit'
echo "$suite, $(inside "$compiler --version" | head -1): built, tested, replayed"

#!/usr/bin/env bash
# The same bits on a processor of another make, by hand: the sums of same_bits (distance maps, contact, removal, vibration, tissue) and, with --sessions,
# the recorded sessions, by programs that a cross compiler makes for arm64 and qemu runs. Wants root, a mirror, mmdebstrap, g++-aarch64-linux-gnu,
# qemu-user-static, 3 GB; half an hour of two cores, with --sessions three times as long.
# usage: check_arm64.sh ROOT BIN_DIR [--sessions]    ROOT is made where it is not there, and kept; BIN_DIR holds this machine's programs
set -euo pipefail
root=${1:?usage: check_arm64.sh ROOT BIN_DIR [--sessions]} bin=$(cd "${2:?where the programs of this machine are}" && pwd) sessions=${3:-}
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
for tool in mmdebstrap aarch64-linux-gnu-g++ qemu-aarch64-static; do
  command -v "$tool" >/dev/null || { echo "$tool is not here"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "a root of another architecture wants root"; exit 77; }
triplet=aarch64-linux-gnu
if [ ! -e "$root" ]; then
  # What the libraries want; what runs on the building machine and what the window alone wants is left out.
  packages=$(sed '1,/^# for:/d;/^# tests/,$d' "$source_dir/libs/cmake/packages.txt" |
    grep -vE '^(build-essential|cmake|ninja-build|ccache|mold|pkg-config|fonts-.*|.*-dri|pybind11-dev|python3.*|libav.*|libsw.*|libsdl2.*|libglfw3.*|libimgui.*|libstb.*)$')
  # Extracted and not set up: nothing of it runs here, so that no emulation of a whole system is wanted.
  mmdebstrap --quiet --variant=extract --arch=arm64 --aptopt='APT::Install-Recommends "false"' \
    --include="$(echo $packages libc6-dev libstdc++-12-dev libgtest-dev | tr ' ' ',')" bookworm "$root"
  root=$(cd "$root" && pwd)
  find "$root/usr/lib" "$root/lib/" -type l -lname '/*' | while read -r link; do
    [ ! -e "$root$(readlink "$link")" ] || ln -sfn "$root$(readlink "$link")" "$link"
  done
  for name in blas lapack; do # as update-alternatives would
    ln -sfn "$name/lib$name.so.3" "$root/usr/lib/$triplet/lib$name.so.3"
  done
  sed -i -E "s#([;\"])(/usr/lib/$triplet/)#\1$root\2#g" "$root/usr/lib/$triplet/cmake/dcmtk/DCMTKTargets.cmake"
fi
root=$(cd "$root" && pwd)
build=$source_dir/build/arm64
mkdir -p "$build"
cat >"$build/toolchain.cmake" <<END
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER $triplet-gcc)
set(CMAKE_CXX_COMPILER $triplet-g++)
set(CMAKE_LIBRARY_ARCHITECTURE $triplet)
set(CMAKE_SYSROOT $root)
set(CMAKE_FIND_ROOT_PATH $root)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64-static -L $root)
set(PKG_CONFIG_EXECUTABLE $(command -v pkg-config) CACHE FILEPATH "")
END
export PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root/usr/lib/$triplet/pkgconfig:$root/usr/share/pkgconfig
cmake -G Ninja -S "$source_dir" -B "$build" -DCMAKE_TOOLCHAIN_FILE="$build/toolchain.cmake" -DCMAKE_BUILD_TYPE=Release -DOSTEO_WINDOW=OFF -DOSTEO_MOVIE=OFF \
  -DOSTEO_PYTHON=OFF -DOSTEO_CGAL=OFF -DOSTEO_TETGEN=OFF -DOSTEO_CERES=OFF >"$build/configure.log" 2>&1 || { tail -20 "$build/configure.log"; exit 1; }
cmake --build "$build" --target same_bits ${sessions:+osteo}
# The line of instructions says what ran, the line of the library that its own functions differ.
emulated() { qemu-aarch64-static -L "$root" "$@"; }
emulated "$build/bin/same_bits" >"$build/arm64.txt"
"$bin/same_bits" >"$build/here.txt"
grep -h '^instructions' "$build/here.txt" "$build/arm64.txt"
diff <(grep -v '^instructions\|^library' "$build/here.txt") <(grep -v '^instructions\|^library' "$build/arm64.txt")
echo "$(grep -vc '^instructions\|^library' "$build/here.txt") sums: the same bits on arm64"
if [ -n "$sessions" ]; then
  mkdir -p "$build/emulated"
  printf '#!/bin/sh\nexec qemu-aarch64-static -L %q %q "$@"\n' "$root" "$build/bin/osteo" >"$build/emulated/osteo"
  chmod +x "$build/emulated/osteo"
  "$source_dir/tests/robust/check_recorded.sh" "$build/emulated" "$source_dir/testdata" "$build/recorded"
fi

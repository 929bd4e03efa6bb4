#!/usr/bin/env bash
# What ./osteo and ./test say while they install and build, with stand-ins for apt, git, cmake and ninja. usage: check_setup.sh SOURCE_DIR
set -euo pipefail
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-setup-XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{bin,tree/libs/cmake,tree/apps,tree/pipelines,tree/tests}
cp "$1/libs/cmake/setup.sh" "$1/libs/cmake/packages.txt" "$work/tree/libs/cmake"
touch "$work/tree/CMakeLists.txt" "$work/tree/CMakePresets.json"
cd "$work/tree"
for tool in dpkg-query sudo apt-get cmake git; do
  printf '#!/usr/bin/env bash\n' >"$work/bin/$tool" && chmod +x "$work/bin/$tool"
done
echo 'exit 1' >>"$work/bin/dpkg-query" # no package is there
echo 'exec "$@"' >>"$work/bin/sudo"
cat >>"$work/bin/apt-get" <<'APT'
[ "$1" = install ] || exit 0
for n in $(seq 0 200); do echo "Reading database ... $n"; done
for n in $(seq 0 5 100); do echo "dlstatus:1:$n.5000:Fetching file $n"; done
for n in $(seq 0 5 100); do echo "pmstatus:libvtk9-dev:$n.0000:Unpacking libvtk9-dev"; done
exit "${APT_FAILS:-0}"
APT
cat >>"$work/bin/cmake" <<'CMAKE'
case $1 in
  --preset) mkdir -p build/release && echo configured ;;
  --build)
    [ "$NINJA_STATUS" = '[%f/%t] ' ] || exit 3
    echo "ninja: Entering directory"
    [ -z "${NOTHING:-}" ] || { echo "ninja: no work to do."; exit 0; }
    for n in $(seq 1 300); do echo "[$n/300] Building CXX object libs/CMakeFiles/x.dir/file_$n.cpp.o"; done
    [ -z "${BUILD_FAILS:-}" ] || { echo "file.cpp:3: error: no such thing"; exit 1; } ;;
esac
CMAKE
echo 'echo "${HEAD_NOW:-aaaa}"' >>"$work/bin/git"
export PATH=$work/bin:$PATH
setup() { bash -c 'set -euo pipefail; source libs/cmake/setup.sh; "$@"' bash "$@"; }
expect() { grep -qF -- "$1" "$work/said" || { echo "it does not say '$1':"; cat "$work/said"; exit 1; }; }
lines() { [ "$(wc -l <"$work/said")" -le "$1" ] || { echo "more than $1 lines:"; cat "$work/said"; exit 1; }; }

setup ensure_packages 2>"$work/said"
expect "Installing packages: 50 %" && expect "Unpacking libvtk9-dev" && lines 14
grep -q 'Reading database' build/packages.log
rm build/.packages
! APT_FAILS=100 setup ensure_packages 2>"$work/said" || { echo "a failed installation passes"; exit 1; }
expect "could not be installed" && test ! -e build/.packages

setup ensure_built release osteo 2>"$work/said"
expect "Building: 300 steps" && expect "[150/300]" && expect "100 %" && lines 14
setup ensure_built release osteo 2>"$work/said" && lines 0
sleep 1 && touch libs/new.cpp
setup ensure_built release osteo 2>"$work/said"
expect "Building what changed: 300 steps"
HEAD_NOW=bbbb NOTHING=1 setup ensure_built release osteo 2>"$work/said" && lines 0
grep -q bbbb build/release/.built-osteo
touch libs/newer.cpp
! BUILD_FAILS=1 setup ensure_built release osteo 2>"$work/said" || { echo "a failed build passes"; exit 1; }
expect "error: no such thing" && expect "release.build.log"
# On a terminal: one line, written over.
if command -v script >/dev/null; then
  script -qec "bash -c 'set -euo pipefail; source libs/cmake/setup.sh; ensure_built release osteo'" /dev/null >"$work/said" </dev/null
  expect "[299/300]" && lines 3
fi

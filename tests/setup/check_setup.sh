#!/usr/bin/env bash
# What ./osteo and ./test say while they install and build, with stand-ins for apt, git, cmake and ninja. usage: check_setup.sh SOURCE_DIR
set -euo pipefail
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-setup-XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir -p "$work"/{bin,tree/libs/cmake,tree/apps,tree/pipelines,tree/tests}
cp "$1/libs/cmake/setup.sh" "$1/libs/cmake/packages.txt" "$work/tree/libs/cmake"
touch "$work/tree/CMakeLists.txt" "$work/tree/CMakePresets.json"
cd "$work/tree"
for tool in dpkg-query sudo apt-get apt-cache cmake git; do
  printf '#!/usr/bin/env bash\n' >"$work/bin/$tool" && chmod +x "$work/bin/$tool"
done
echo 'exit 1' >>"$work/bin/dpkg-query" # no package is there
echo 'exec "$@"' >>"$work/bin/sudo"
echo '[ "$2" = "${NOT_HERE:-}" ] && echo "  Candidate: (none)" || echo "  Candidate: 1.0-1"' >>"$work/bin/apt-cache"
cat >>"$work/bin/apt-get" <<'APT'
[ "$1" = install ] || exit 0
case " $* " in *" ${NOT_HERE:-none} "*) echo "E: Package has no installation candidate"; exit 100 ;; esac
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
release() { printf '%s\n' "$@" >"$work/os-release"; } # what the machine says it is
export OSTEO_OS_RELEASE=$work/os-release
release 'PRETTY_NAME="Debian GNU/Linux 12 (bookworm)"' 'ID=debian' 'VERSION_ID="12"'
setup() { bash -c 'set -euo pipefail; source libs/cmake/setup.sh; "$@"' bash "$@"; }
expect() { grep -qF -- "$1" "$work/said" || { echo "it does not say '$1':"; cat "$work/said"; exit 1; }; }
lines() { [ "$(wc -l <"$work/said")" -le "$1" ] || { echo "more than $1 lines:"; cat "$work/said"; exit 1; }; }

setup ensure_packages 2>"$work/said"
expect "Installing packages: 50 %" && expect "Unpacking libvtk9-dev" && lines 14
grep -q 'Reading database' build/packages.log
rm build/.packages
# Another Debian may lack what tests need, and then they are skipped; what the program needs has to be there.
NOT_HERE=calculix-ccx setup ensure_packages 2>"$work/said"
expect "There is no package calculix-ccx" && rm build/.packages
! NOT_HERE=libvtk9-dev setup ensure_packages 2>"$work/said" || { echo "a package that is not there passes"; exit 1; }
! APT_FAILS=100 setup ensure_packages 2>"$work/said" || { echo "a failed installation passes"; exit 1; }
expect "packages could not be installed. Is there a network?" && expect "By hand: apt-get install" && test ! -e build/.packages
lines 32
# By its own file each distribution whose names are known is told from the others, and those are given the list instead of an installation.
installs() { # NAME os-release lines...
  local name=$1
  shift
  release "$@" && rm -f build/.packages
  setup ensure_packages 2>"$work/said" || { echo "$name is refused:"; cat "$work/said"; exit 1; }
  expect "packages of $name" && expect "100 %" && test -e build/.packages
}
installs debian-12 ID=debian VERSION_ID='"12"'
installs debian-13 'PRETTY_NAME="Debian GNU/Linux 13 (trixie)"' VERSION_ID='"13"' VERSION_CODENAME=trixie ID=debian
installs ubuntu-24.04 ID=ubuntu ID_LIKE=debian VERSION_ID='"24.04"'
installs ubuntu-26.04 ID=ubuntu ID_LIKE=debian VERSION_ID="'26.04'"
is_told() { # WHO os-release lines...
  local who=$1
  shift
  release "$@" && rm -f build/.packages
  ! setup ensure_packages 2>"$work/said" || { echo "packages are missing on $who, and it passes"; exit 1; }
  expect "This is $who." && expect "debian-12, debian-13, ubuntu-24.04, ubuntu-26.04" && expect "libvtk9-dev" && expect "VTK 9.1"
  expect "  apt-get install --no-install-recommends build-essential" && test ! -e build/.packages && lines 30
  ! grep -q "Installing" "$work/said" || { echo "on $who it installs all the same"; exit 1; }
}
is_told "Debian GNU/Linux forky/sid" 'PRETTY_NAME="Debian GNU/Linux forky/sid"' ID=debian # testing has no number
is_told "Debian GNU/Linux 11 (bullseye)" 'PRETTY_NAME="Debian GNU/Linux 11 (bullseye)"' ID=debian VERSION_ID='"11"'
is_told "Linux Mint 22" 'PRETTY_NAME="Linux Mint 22"' ID=linuxmint 'ID_LIKE="ubuntu debian"' VERSION_ID='"22"'
is_told "Ubuntu 4.10" 'PRETTY_NAME="Ubuntu 4.10"' ID=ubuntu VERSION_ID='"4.10"' # no part of a name is a name
OSTEO_OS_RELEASE=$work/none is_told "a system without $work/none" ID=debian VERSION_ID=12
# Where all is installed nobody is asked what it is.
sed -i 's/^exit 1$/echo "install ok installed"/' "$work/bin/dpkg-query"
release ID=linuxmint VERSION_ID=22
setup ensure_packages 2>"$work/said" && lines 0 && test -e build/.packages && rm build/.packages
# Without dpkg the list is given, and the build may find what it needs.
release 'PRETTY_NAME="Fedora Linux 44"' ID=fedora VERSION_ID=44
setup eval 'command() { [ "$2" != dpkg-query ] && builtin command "$@"; }; ensure_packages' 2>"$work/said" || { echo "without dpkg it stops"; exit 1; }
expect "This is Fedora Linux 44." && expect "libvtk9-dev" && expect "by this system's own means" && lines 30 && test ! -e build/.packages
sed -i 's/^echo "install ok installed"$/exit 1/' "$work/bin/dpkg-query"
release ID=debian VERSION_ID=12
# A user who is neither root nor has sudo is told the line for who is.
nobody() { setup eval 'id() { echo 1000; }; command() { [ "$2" != sudo ] && builtin command "$@"; }; ensure_packages'; }
! nobody 2>"$work/said" || { echo "no packages and no root passes"; exit 1; }
expect "As root:" && expect "  apt-get install --no-install-recommends " && lines 2

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
# In a clone used as the pages say each command builds the program that it starts, and then starts it.
cp "$1/osteo" .
sed -i 's|--build)|--build) shift 3; echo "$*" >>"$OSTEO_ASKED"; mkdir -p build/release/bin; printf "#!/bin/sh\\n" >build/release/bin/osteo; chmod +x build/release/bin/osteo|' "$work/bin/cmake"
export OSTEO_ASKED=$work/asked
builds() { # PROGRAM COMMAND...
  local program=$1
  shift
  rm -rf build/release && mkdir -p build && touch build/.packages && : >"$OSTEO_ASKED"
  ./osteo "$@" 2>"$work/said" || { echo "./osteo $* fails:"; cat "$work/said"; exit 1; }
  [ "$(cat "$OSTEO_ASKED")" = "osteo${program:+ $program}" ] || { echo "./osteo $* builds '$(cat "$OSTEO_ASKED")', not '$program'"; exit 1; }
}
# Which command starts which program, by the commands' own sources, which are called as they are.
declare -A starts=()
for source in $(grep -lE 'window_program\("osteo-' "$1"/apps/osteo/src/*.cpp); do
  command=$(basename "$source" .cpp)
  command=${command%_force} command=${command//_/-}
  [ -e "$1/docs/reference/command-$command.md" ] || { echo "$source is of no command"; exit 1; }
  starts[$command]=$(grep -oE 'window_program\("osteo-[a-z]+' "$source" | sed 's/.*"//')
done
[ "${#starts[@]}" -ge 5 ] || { echo "programs are known of ${!starts[*]} only"; exit 1; }
for command in "${!starts[@]}"; do builds "${starts[$command]}" "$command" SUBJECT; done
builds osteo-edit edit CASE
builds osteo-rehearse rehearse CASE
builds osteo-rehearse playback SESSION --mode guide
builds osteo-console nerve-console 18944
builds osteo-console console 18944 # its name in version 0.1
builds osteo-experiment experiment force-skill study
builds "" edit CASE --apply edits.json
builds "" rehearse CASE --headless -o SESSION
builds "" prepare SCAN -o CASE
grep -hoE '^(\./)?osteo [a-z][^#`]*' -r --include='*.md' --exclude-dir=reference "$1/README.md" "$1/docs" | sed 's/^[^ ]* //; s/ *$//' | sort -u >"$work/lines"
[ "$(wc -l <"$work/lines")" -gt 100 ]
while read -r command rest; do
  program=
  case " $rest " in
    *" --headless "* | *" --apply "* | *" --simulated "*) ;;
    *) program=${starts[$command]:-} ;;
  esac
  [ "$command" != experiment ] || case $rest in force-skill*) program=osteo-experiment ;; *) continue ;; esac
  [ -z "$program" ] || builds "$program" $command $rest
done <"$work/lines"

# Shared by ./osteo and ./test: installs what is missing and builds what is old. To be sourced.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

say() { printf '%s\n' "$*" >&2; }

# show_progress TITLE PERCENT TEXT: on a terminal one line that is written over, elsewhere a line each 10 %.
shown_tenth=-1
show_progress() {
  if [ -t 2 ]; then
    printf '\r%s: %s %%  %.60s\033[K' "$1" "$2" "$3" >&2
  elif [ $(($2 / 10)) -gt "$shown_tenth" ]; then
    shown_tenth=$(($2 / 10))
    say "$1: $2 %  $3"
  fi
}
end_progress() {
  [ ! -t 2 ] || printf '\r\033[K' >&2
  shown_tenth=-1
}

# What the compiler made once is taken from its cache again (ccache), in this clone and in another one beside it. Sloppiness: as precompiled headers need.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime

# minutes SECONDS: "about 3 minutes", for people.
minutes() {
  local n=$((($1 + 30) / 60))
  if [ "$n" -gt 1 ]; then printf 'about %s minutes' "$n"; elif [ "$1" -gt 20 ]; then printf 'about a minute'; else printf 'seconds'; fi
}

# Reads what ninja prints, keeps it in LOG and shows how far it is and, by the steps done so far, how long it still takes. show_build TITLE LOG
show_build() {
  local line begun= from=$SECONDS left
  while IFS= read -r line || [ -n "$line" ]; do
    printf '%s\n' "$line" >>"$2"
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\]\ (.*) ]] || continue
    [ "${BASH_REMATCH[2]}" -gt 2 ] || continue # looking whether there is anything to do is not building
    [ -n "$begun" ] || { begun=1; say "$1: ${BASH_REMATCH[2]} steps"; }
    left=
    [ $((SECONDS - from)) -lt 15 ] || left="$(minutes $(((SECONDS - from) * (BASH_REMATCH[2] - BASH_REMATCH[1]) / BASH_REMATCH[1]))) left  "
    show_progress "$1" $((BASH_REMATCH[1] * 100 / BASH_REMATCH[2])) "$left[${BASH_REMATCH[1]}/${BASH_REMATCH[2]}] ${BASH_REMATCH[3]##*/}"
  done
  [ -z "$begun" ] || end_progress
}

# Reads apt's status lines ("dlstatus:1:12.5:text", "pmstatus:package:40:text"): fetching is the first half, installing the second. show_apt TITLE
show_apt() {
  local kind name percent text
  while IFS=: read -r kind name percent text; do
    percent=${percent%%.*}
    [[ $percent =~ ^[0-9]+$ ]] || continue
    case $kind in
      dlstatus) show_progress "$1" $((percent / 2)) "$text" ;;
      pmstatus) show_progress "$1" $((50 + percent / 2)) "$text" ;;
    esac
  done
  end_progress
}

# Which distribution this is, by its own file: "debian-13". One without a number (Debian's testing) is "debian-".
os_release=${OSTEO_OS_RELEASE:-/etc/os-release}
distribution() {
  [ -r "$os_release" ] || { echo unknown-; return; }
  (ID=unknown VERSION_ID= && source "$os_release" && echo "$ID-$VERSION_ID")
}

# The distributions where a list's names mean the same packages: its line "# for: ...".
named_distributions() { sed -n 's/^# for: //p' "$1"; }

# needed_by_hand LIST: for who has another distribution, what is needed and what to do.
needed_by_hand() {
  local pretty
  pretty=$( (source "$os_release" && echo "${PRETTY_NAME:-$ID}") 2>/dev/null) || pretty="a system without $os_release"
  say "This is $pretty. Packages are known by name for $(named_distributions "$1" | sed 's/ /, /g'); here they are not installed for you."
  say "What is needed, by Debian's names (NAME-dev is the library NAME with its headers); what follows '# tests' only tests need:"
  sed '1,/^# for:/d' "$1" | paste -sd' ' | fold -s -w 118 | sed 's/^/  /' >&2
  say "Lowest versions: g++ 12, CMake 3.25, VTK 9.1, OpenVDB 10, OpenCV 4.6 with aruco, CGAL 5.5, Ceres 2.1, DCMTK 3.6.7, GDCM 3.0, Python 3.11."
}

# Installs the packages of a list (packages.txt) that are missing; asks nothing. Does nothing, quickly, when all are there.
ensure_packages() {
  local list=${1:-$root/libs/cmake/packages.txt} missing=() package here
  local stamp=$root/build/.$(basename "$list" .txt)
  [ "$stamp" -nt "$list" ] && return
  here=$(distribution)
  local known=1
  [[ " $(named_distributions "$list") " == *" $here "* ]] || known=
  if ! command -v dpkg-query >/dev/null; then
    needed_by_hand "$list"
    say "Install them by this system's own means; the build that follows says what it does not find."
    return
  fi
  for package in $(grep -v '^#' "$list"); do
    [[ $(dpkg-query -W -f '${Status}' "$package" 2>/dev/null) == *'ok installed'* ]] || missing+=("$package")
  done
  if [ ${#missing[@]} -gt 0 ] && [ -z "$known" ]; then
    # A name may stand for something else there: who owns the machine decides.
    needed_by_hand "$list"
    say "Missing here by these names: ${#missing[@]}. Install them, or what stands for them here, and run this again:"
    say "  apt-get install --no-install-recommends ${missing[*]}"
    say "If they have other names here, build without this script: cmake --preset release && ninja -C build/release osteo"
    exit 9
  fi
  if [ ${#missing[@]} -gt 0 ]; then
    local sudo=
    if [ "$(id -u)" -ne 0 ]; then
      command -v sudo >/dev/null || {
        say "${#missing[@]} packages are missing, and there is neither root nor sudo to install them. As root:"
        say "  apt-get install --no-install-recommends ${missing[*]}"
        exit 9
      }
      sudo=sudo
    fi
    mkdir -p "$root/build"
    local log=$root/build/packages.log
    say "Installing ${#missing[@]} packages of $here (2 to 4 minutes); what apt says goes to $log"
    $sudo apt-get update -qq >"$log" 2>&1 || say "apt-get update failed; trying with what is known"
    # What only tests need may be missing in one of the distributions: those tests are skipped.
    local wanted=()
    for package in "${missing[@]}"; do
      if sed '1,/^# tests/d' "$list" | grep -qx "$package" && [ -z "$(LC_ALL=C apt-cache policy "$package" 2>/dev/null | sed -n '/Candidate: [^(]/p')" ]; then
        say "There is no package $package in $here: what is tested with it is skipped"
      else
        wanted+=("$package")
      fi
    done
    missing=("${wanted[@]}")
    $sudo env LC_ALL=C DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends -o APT::Status-Fd=1 "${missing[@]}" </dev/null 2>&1 |
      tee -a "$log" | show_apt "Installing packages" || {
      sed -E '/^(dl|pm)status:/d' "$log" | tail -n 15 >&2
      say "${#missing[@]} packages could not be installed. Is there a network? All of it is in $log"
      say "By hand: apt-get install --no-install-recommends ${missing[*]}"
      exit 9
    }
  fi
  mkdir -p "$root/build" && touch "$stamp"
}

# Independent readers from PyPI, for the tests that read our outputs back. Without a network those tests are skipped, and say so.
ensure_readers() {
  local dir=$root/build/readers
  [ "$dir/.complete" -nt "$root/libs/cmake/setup.sh" ] && return
  say "Installing readers for the tests from PyPI (pydicom, highdicom, SimpleITK, nibabel, trimesh, h5py, mcap, zstandard, slicerio, neo, pyigtl, pycbsdk, pylsl, pynetdicom, cyclonedx) ..."
  if python3 -m venv "$dir" >/dev/null 2>&1 && "$dir/bin/pip" install -q --disable-pip-version-check --retries 1 --timeout 20 pydicom==3.0.1 highdicom==0.26.0 SimpleITK==2.5.0 nibabel==5.3.2 trimesh==4.6.8 networkx==3.4.2 lxml==5.4.0 jsonschema==4.26.0 "cyclonedx-python-lib[json-validation]==11.12.0" h5py==3.16.0 mcap==1.6.0 zstandard==0.25.0 slicerio==1.4.0 pynrrd==1.1.3 neo==0.14.6 pyigtl==0.3.4 pycbsdk==0.4.1 pylsl==1.18.6 pynetdicom==3.0.4 numpy >/dev/null 2>&1; then
    touch "$dir/.complete"
  else
    say "They cannot be had: tests that read outputs back are skipped."
  fi
}

# Processor time of a first build, roughly, in seconds: for what is told before it. cost TARGET
cost() {
  case $1 in
    osteo) echo 660 ;;
    osteo-*) echo 150 ;;
    *) echo 1500 ;;
  esac
}

# ensure_built PRESET TARGET...: builds the targets when a source is newer than their last build.
ensure_built() {
  local preset=$1 dir=$root/build/$1 target title="Building" head old=() seconds=0
  shift
  head=$(git -C "$root" rev-parse HEAD 2>/dev/null || true)
  for target in "$@"; do
    if [ ! -e "$dir/.built-$target" ]; then
      old+=("$target")
      seconds=$((seconds + $(cost "$target")))
    elif [ -n "$(find "$root/libs" "$root/apps" "$root/pipelines" "$root/tests" "$root/CMakeLists.txt" "$root/CMakePresets.json" -newer "$dir/.built-$target" -print -quit)" ] ||
      [ "$(cat "$dir/.built-$target")" != "$head" ]; then # a commit changes nothing but the version that the program tells; that counts too
      old+=("$target")
    fi
  done
  [ ${#old[@]} -gt 0 ] || return 0
  set -- "${old[@]}"
  if [ "$seconds" -gt 0 ]; then
    say "Building $* for the first time: $(minutes $((seconds / $(nproc)))) on $(nproc) processors ..."
  else
    title="Building what changed"
  fi
  local began
  began=$(mktemp)
  (cd "$root" && cmake --preset "$preset" >"$dir.configure.log" 2>&1) || { cat "$dir.configure.log" >&2; say "The build could not be set up."; rm -f "$began"; exit 1; }
  : >"$dir.build.log"
  (export NINJA_STATUS='[%f/%t] '; cmake --build "$dir" --target "$@" 2>&1) | show_build "$title" "$dir.build.log" || { grep -E 'error|FAILED|undefined' "$dir.build.log" | head -n 40 >&2; say "The build failed; all of it is in $dir.build.log"; rm -f "$began"; exit 1; }
  # The time before the build: what was changed meanwhile is built next time.
  for target in "$@"; do
    printf '%s\n' "$head" >"$dir/.built-$target"
    touch -r "$began" "$dir/.built-$target"
  done
  rm -f "$began"
}

# Shared by ./osteo and ./test: installs what is missing and builds what is old. To be sourced.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

say() { printf '%s\n' "$*" >&2; }

# Installs the Debian packages that are missing; asks nothing. Does nothing, quickly, when all are there.
ensure_packages() {
  local list=$root/libs/cmake/packages.txt stamp=$root/build/.packages missing=() package
  [ "$stamp" -nt "$list" ] && return
  if ! command -v dpkg-query >/dev/null; then
    say "This is not Debian: install what $list names, then build with cmake --preset release."
    return
  fi
  for package in $(grep -v '^#' "$list"); do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  if [ ${#missing[@]} -gt 0 ]; then
    local sudo=
    if [ "$(id -u)" -ne 0 ]; then
      command -v sudo >/dev/null || { say "These packages are missing, and there is neither root nor sudo to install them: ${missing[*]}"; exit 9; }
      sudo=sudo
    fi
    say "Installing ${#missing[@]} Debian packages (2 to 4 minutes): ${missing[*]}"
    $sudo apt-get update -qq >&2 || say "apt-get update failed; trying with what is known"
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2 || { say "The packages could not be installed. Is there a network?"; exit 9; }
  fi
  mkdir -p "$root/build" && touch "$stamp"
}

# Independent readers from PyPI, for the tests that read our outputs back. Without a network those tests are skipped, and say so.
ensure_readers() {
  local dir=$root/build/readers
  [ "$dir/.complete" -nt "$root/libs/cmake/setup.sh" ] && return
  say "Installing readers for the tests from PyPI (pydicom, highdicom, SimpleITK, nibabel, trimesh, h5py, mcap) ..."
  if python3 -m venv "$dir" >/dev/null 2>&1 && "$dir/bin/pip" install -q --disable-pip-version-check --retries 1 --timeout 20 pydicom==3.0.1 highdicom==0.26.0 SimpleITK==2.5.0 nibabel==5.3.2 trimesh==4.6.8 networkx==3.4.2 lxml==5.4.0 jsonschema==4.24.0 h5py==3.16.0 mcap==1.6.0 numpy >/dev/null 2>&1; then
    touch "$dir/.complete"
  else
    say "They cannot be had: tests that read outputs back are skipped."
  fi
}

# ensure_built PRESET TARGET...: builds when a source is newer than the last build.
ensure_built() {
  local preset=$1 dir=$root/build/$1 newer
  shift
  if [ -e "$dir/.built-$1" ]; then
    newer=$(find "$root/libs" "$root/apps" "$root/pipelines" "$root/tests" "$root/CMakeLists.txt" "$root/CMakePresets.json" -newer "$dir/.built-$1" -print -quit)
    [ -z "$newer" ] && return
  else
    say "Building (the first time takes some minutes) ..."
  fi
  local began
  began=$(mktemp)
  (cd "$root" && cmake --preset "$preset" >"$dir.configure.log" 2>&1) || { cat "$dir.configure.log" >&2; say "The build could not be set up."; rm -f "$began"; exit 1; }
  cmake --build "$dir" --target "$@" >"$dir.build.log" 2>&1 || { grep -E 'error|FAILED|undefined' "$dir.build.log" | head -n 40 >&2; say "The build failed; all of it is in $dir.build.log"; rm -f "$began"; exit 1; }
  # The time before the build: what was changed meanwhile is built next time.
  touch -r "$began" "$dir/.built-$1"
  rm -f "$began"
}

#!/usr/bin/env bash
# What version.cmake tells in a repository, with changes, in a tarball and in a bare copy; and that it costs nothing when nothing changed.
# usage: check_version.sh SOURCE_DIR
set -euo pipefail
command -v git >/dev/null || exit 77
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-version-XXXXXX")
trap 'rm -rf "$work"' EXIT
repo=$work/repo
mkdir -p "$repo/libs/cmake" "$repo/docs"
cp "$1/libs/cmake/version.cmake" "$1/libs/cmake/commit.txt" "$repo/libs/cmake"
cp "$1/.gitattributes" "$repo"
cp "$1/CMakeLists.txt" "$repo"
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null GIT_AUTHOR_NAME=x GIT_AUTHOR_EMAIL=x@y GIT_COMMITTER_NAME=x GIT_COMMITTER_EMAIL=x@y
git -C "$repo" init -q && git -C "$repo" add -A && git -C "$repo" commit -qm x
commit=$(git -C "$repo" rev-parse --short=12 HEAD)
tell() { cmake -DSOURCE="$1" -DOUT="$work/commit.cpp" -P "$1/libs/cmake/version.cmake"; }
expect() { grep -qF "\"$1\"" "$work/commit.cpp" || { echo "not '$1' but:"; cat "$work/commit.cpp"; exit 1; }; }
tell "$repo" && expect "commit $commit"
touch -d '1 hour ago' "$work/commit.cpp" && before=$(stat -c %Y "$work/commit.cpp")
echo page >"$repo/docs/page.md"
tell "$repo" && expect "commit $commit"
[ "$(stat -c %Y "$work/commit.cpp")" = "$before" ] || { echo "written again though nothing changed"; exit 1; }
touch "$repo/libs/new.cpp"
tell "$repo" && expect "commit $commit, changed"
mkdir "$work/tar" && git -C "$repo" archive HEAD | tar -x -C "$work/tar"
tell "$work/tar" && expect "commit $commit"
mkdir -p "$repo/third/copy" && cp -r "$repo/libs" "$repo/third/copy" # inside another repository
tell "$repo/third/copy" && expect "unknown commit"

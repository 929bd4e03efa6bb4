#!/usr/bin/env bash
# The same commit built again in another folder, by another umask and time zone and without the compiler's cache, gives the same packages, byte for
# byte. What differs is named, file by file. Takes as long as a build from nothing: by hand, before packages are given away.
# usage: check_same_debs.sh DEBS [FOLDER]      DEBS: made by debs.sh of this commit, with --free-only or without; FOLDER: where to build (a new one)
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
debs=$(cd "${1:?usage: check_same_debs.sh DEBS [FOLDER]}" && pwd)
work=${2:-$(mktemp -d "${TMPDIR:-/tmp}/osteo-same-XXXXXX")}
mkdir -p "$work"
[ -n "${2:-}" ] || trap 'rm -rf "$work"' EXIT
[ -z "$(git -C "$root" status --porcelain -uno)" ] || { echo "what is changed and not committed would not be in the second build"; exit 2; }
# Another length of path as well, so that nothing happens to fit.
again=$work/the/same/sources/again
[ -d "$again" ] || git clone -q --no-hardlinks "$root" "$again"
[ "$(git -C "$again" rev-parse HEAD)" = "$(git -C "$root" rev-parse HEAD)" ] || { echo "$again is another commit"; exit 2; }
free=
ls "$debs"/osteo-full_*.deb >/dev/null 2>&1 || free=--free-only
rm -rf "$work/debs"
(umask 027 && CCACHE_DISABLE=1 TZ=Pacific/Auckland "$again/apps/packaging/debs.sh" "$work/debs" $free)
different=0
for deb in "$debs"/*.deb; do
  name=$(basename "$deb")
  cmp -s "$deb" "$work/debs/$name" && { echo "same bytes: $name"; continue; }
  different=1
  [ -e "$work/debs/$name" ] || { echo "not made again: $name"; continue; }
  echo "different: $name"
  for side in a b; do
    rm -rf "$work/$side"
    mkdir "$work/$side"
  done
  dpkg-deb -R "$deb" "$work/a"
  dpkg-deb -R "$work/debs/$name" "$work/b"
  # Names, rights and times as the archive has them, then what is in the files.
  diff <(dpkg-deb -c "$deb") <(dpkg-deb -c "$work/debs/$name") | head -8 | sed 's/^/  /' || true
  diff -rq "$work/a" "$work/b" | sed "s|$work/||g; s/^/  /" | head -20 || true
done
exit $different

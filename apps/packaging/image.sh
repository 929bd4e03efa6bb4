#!/usr/bin/env bash
# Builds the container for servers from Debian packages, as an archive that podman, docker and apptainer read.
# usage: apps/packaging/image.sh DEBS OUT.tar [free|full]      BASE=image to begin with; without a registry a Debian made by mmdebstrap
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
debs=${1:?usage: apps/packaging/image.sh DEBS OUT.tar [free|full]} out=${2:?where to, as OUT.tar} target=${3:-free}
case $target in free | full) ;; *) echo "the target is free or full, not '$target'" >&2; exit 2 ;; esac
[ ! -e "$out" ] || { echo "$out is there already" >&2; exit 6; }
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-image-XXXXXX")
storage=(--root "$work/store" --runroot "$work/run" --storage-driver vfs) # nothing is left on this machine but the archive
b() { local verb=$1; shift; buildah "${storage[@]}" "$verb" "$@"; }
trap 'rm -rf --one-file-system "$work"' EXIT
suite=$(source /etc/os-release && echo "$VERSION_CODENAME") # packages are for the distribution that made them
base=${BASE:-docker.io/library/debian:$suite-slim}
if ! timeout 60 buildah "${storage[@]}" pull -q "$base" >/dev/null 2>"$work/pull"; then
  echo "no registry ($(tail -1 "$work/pull" | cut -c1-120)): a base is made by mmdebstrap" >&2
  mmdebstrap --quiet --variant=apt --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' "$suite" "$work/base.tar"
  container=$(b from scratch)
  b add -q "$container" "$work/base.tar" /
  b commit -q "$container" localhost/osteo-base >/dev/null
  b rm "$container" >/dev/null
  rm "$work/base.tar"
  base=localhost/osteo-base
fi
mkdir "$work/context"
cp "$debs"/osteo_*.deb "$debs"/osteo-full_*.deb "$root/apps/packaging/closure.sh" "$work/context" 2>/dev/null || [ -s "$work/context/closure.sh" ]
b bud -q --isolation chroot --layers=false --target "$target" --build-arg BASE="$base" -t "localhost/osteo:$target" -f "$root/apps/packaging/Containerfile" "$work/context" >/dev/null
b push -q "localhost/osteo:$target" "docker-archive:$out:osteo:$target"
echo "$out: $(($(stat -c %s "$out") / 1000000)) MB"

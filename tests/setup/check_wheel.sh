#!/usr/bin/env bash
# Wheels of apps/packaging/wheel.sh in fresh roots of distributions that hold Python, Mesa and no library of ours, as an ordinary user: the program and the
# module do there what they do here, to the byte. Wants root, mirrors of Debian and PyPI, and mmdebstrap.
# usage: check_wheel.sh WHEELS [SUITE...]      SUITE as Debian names it; bookworm (Python 3.11) and trixie (3.13) where none is given
set -euo pipefail
wheels=$(cd "${1:?usage: check_wheel.sh WHEELS [SUITE...]}" && pwd)
shift
[ $# -gt 0 ] || set -- bookworm trixie
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
osteo=$root/build/wheel/bin/osteo
command -v mmdebstrap >/dev/null || { echo "mmdebstrap is not here"; exit 77; }
[ "$(id -u)" -eq 0 ] || { echo "a fresh root wants root"; exit 77; }
[ -x "$osteo" ] || { echo "build/wheel holds no program: apps/packaging/wheel.sh makes it"; exit 77; }
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-wheel-XXXXXX")
trap 'for r in "$work"/*/proc; do umount "$r" 2>/dev/null || true; done; rm -rf --one-file-system "$work"' EXIT
chmod 755 "$work"
for wheel in "$wheels"/*.whl; do
  mb=$(($(stat -c %s "$wheel") / 1000000))
  echo "$(basename "$wheel"): $mb MB"
  [ "$mb" -le 100 ] || { echo "more than PyPI takes"; exit 1; }
done
cat >"$work/try.sh" <<'TRY'
set -eu
osteo phantom ct.nrrd --region temporal --spacing-mm 1 --labels-out labels.nrrd --quiet
osteo prepare ct.nrrd -o case --lower 500 --spacing-mm 1 --quiet
osteo rehearse case --headless --fast --script "$1/sessions/mastoid.json" -o session --quiet
{ sha256sum case/surface.ply; osteo replay session --json | grep _hash; } >same.txt
TRY
(mkdir "$work/here" && cd "$work/here" && PATH=$(dirname "$osteo"):$PATH sh "$work/try.sh" "$root/pipelines" >/dev/null)
for suite; do
  fresh=$work/$suite
  mmdebstrap --quiet --variant=apt --aptopt='APT::Install-Recommends "false"' --include=passwd,python3-venv,libegl1,libgl1-mesa-dri "$suite" "$fresh"
  mount -t proc proc "$fresh/proc"
  inside() { chroot "$fresh" env -i PATH=/home/someone/env/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LC_ALL=C.UTF-8 "$@"; }
  as_user() { inside su -s /bin/sh someone -c "export PATH=/home/someone/env/bin:\$PATH; cd ~ && $*"; }
  inside useradd -m someone
  version=$(inside python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  mkdir "$fresh/wheels"
  cp "$wheels"/*-cp"${version/./}"-*.whl "$fresh/wheels"
  python3 -m pip download -q --only-binary :all: --no-deps --python-version "$version" --platform manylinux_2_28_x86_64 --platform manylinux2014_x86_64 \
    -d "$fresh/wheels" numpy
  cp "$work/try.sh" "$fresh/wheels"
  as_user python3 -m venv env
  as_user env/bin/pip install -q --no-index --find-links /wheels osteotome
  as_user sh /wheels/try.sh /home/someone/env/share/osteo/pipelines >/dev/null
  diff "$work/here/same.txt" "$fresh/home/someone/same.txt"
  # Letters are in the report, though the machine has none; DICOM's attributes have names.
  [ ! -e "$fresh/usr/share/fonts" ] || [ -z "$(find "$fresh/usr/share/fonts" -name '*.ttf')" ] || { echo "the root has letters of its own"; exit 1; }
  grep -qa LiberationSans "$fresh/home/someone/case.report.pdf" || { echo "no letters in the report"; exit 1; }
  as_user "osteo convert labels.nrrd labels.dcm --quiet" >"$work/said" 2>&1 || { cat "$work/said"; exit 1; }
  ! grep -i dictionary "$work/said" || exit 1
  as_user "env/bin/python - case session" <"$root/tests/setup/try_module.py"
  # Uninstalled, no file stays (pip leaves empty folders of share).
  as_user env/bin/pip uninstall -q -y osteotome
  left=$(cd "$fresh/home/someone/env" && find . -ipath '*osteo*' -type f | head)
  [ -z "$left" ] || { echo "left behind: $left"; exit 1; }
  umount "$fresh/proc"
  echo "$suite, Python $version: installed, run as a user, the same bytes, removed"
done

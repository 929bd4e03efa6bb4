#!/usr/bin/env bash
# Debian packages judged by lintian, then installed into a fresh Debian root, run there as a user, and removed. Wants root, a mirror and mmdebstrap.
# usage: check_debs.sh FOLDER_OF_DEBS
# With OSTEO_DEBS_OUTSIDE=1 another project is also built there against libosteo-dev and run: a compiler comes along, and minutes.
set -euo pipefail
debs=$(cd "${1:?usage: check_debs.sh FOLDER_OF_DEBS}" && pwd)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
for tool in lintian mmdebstrap; do
  command -v $tool >/dev/null || { echo "$tool is not here"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "a fresh root wants root"; exit 77; }
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-debs-XXXXXX")
trap 'umount "$work/root/proc" 2>/dev/null || true; rm -rf --one-file-system "$work"' EXIT
chmod 755 "$work"
suite=$(source /etc/os-release && echo "$VERSION_CODENAME") # packages are for the distribution that made them
for deb in "$debs"/*.deb; do
  echo "lintian: $(basename "$deb")"
  lintian --fail-on error --tag-display-limit 3 "$deb" >"$work/lintian" 2>&1 || { grep '^E:' "$work/lintian"; exit 1; }
  sed 's/ .*//' "$work/lintian" | sort | uniq -c | sed 's/^/  /'
done
mmdebstrap --quiet --variant=apt --aptopt='APT::Install-Recommends "false"' "$suite" "$work/root"
base=$(du -sxm "$work/root" | cut -f1)
mkdir "$work/root/debs"
cp "$debs"/*.deb "$work/root/debs"
cp /etc/resolv.conf "$work/root/etc" 2>/dev/null || true
mount -t proc proc "$work/root/proc"
inside() { chroot "$work/root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"; }
install() { inside apt-get install -y -qq --no-install-recommends "$@" >"$work/apt" 2>&1 || { tail -20 "$work/apt"; exit 1; }; }
deb() { (cd "$debs" && ls "$1"_*.deb 2>/dev/null | sed 's|^|/debs/|'); }
installed() { [[ $(inside dpkg-query -W -f '${Status}' "$1" 2>/dev/null) == 'install ok installed' ]]; }
# mmdebstrap leaves no lists of packages behind: without them apt knows of no dependency and calls ours "held broken packages".
inside apt-get update -qq >"$work/apt" 2>&1 || { tail -20 "$work/apt"; echo "the mirror's lists cannot be had"; exit 1; }
install $(deb osteo)
inside apt-get clean
echo "osteo alone: $(($(du -sxm "$work/root" --exclude=debs | cut -f1) - base)) MB more than a bare Debian of $base MB"
inside useradd -m someone
inside osteo --version | grep -q 'osteo 0' || { echo "osteo does not start"; exit 1; }
! inside osteo --version | grep -q 'as a whole it falls under' || { echo "the package osteo says that it is copyleft"; exit 1; }
as_user() { inside su -s /bin/sh someone -c "cd ~ && $*"; }
as_user "osteo phantom ct.nrrd --region temporal --spacing-mm 1 --quiet"
as_user "osteo prepare ct.nrrd -o case --lower 500 --spacing-mm 1 --quiet"
as_user "osteo rehearse case --headless --fast --script /usr/share/osteo/pipelines/sessions/mastoid.json -o session --quiet"
as_user "osteo replay session"
for f in /usr/share/man/man1/osteo-prepare.1.gz /usr/share/bash-completion/completions/osteo /usr/lib/udev/rules.d/70-osteotome.rules /usr/share/doc/osteo/osteo.spdx.json /usr/share/doc/osteo/osteo.vex.json /usr/share/doc/osteo/copyright \
  /usr/lib/systemd/system/osteo-receive.service /usr/lib/systemd/system/osteo-watch.service /usr/lib/systemd/system/osteo-watch-orthanc@.service; do
  [ -s "$work/root$f" ] || [ -s "$work/root${f#/usr}" ] || { echo "$f is not there"; exit 1; }
done
install $(deb osteo-rehearse)
for program in osteo-rehearse osteo-edit osteo-console osteo-experiment; do
  inside $program --version | grep -q osteo || { echo "$program does not start"; exit 1; }
done
[ -s "$work/root/usr/share/applications/osteo.desktop" ] || { echo "no desktop entry"; exit 1; }
# Without osteo-camera no codec is loaded, and who wants a camera is told what to install.
! inside ldd /usr/bin/osteo | grep -E 'libgdal|libavcodec|libx26|libpoppler' || { echo "osteo loads codecs"; exit 1; }
as_user "osteo markers 1.png --page 1 --quiet && mkdir -p pages && mv 1.png pages"
as_user "osteo calibrate-camera pages" >"$work/said" 2>&1 && { echo "a camera calibrated by one picture"; exit 1; }
grep -q 'install the package osteo-camera' "$work/said" || { cat "$work/said"; exit 1; }
install $(deb osteo-camera)
as_user "osteo calibrate-camera pages" >"$work/said" 2>&1 && { echo "a camera calibrated by one picture"; exit 1; }
grep -q '10 are needed' "$work/said" || { cat "$work/said"; exit 1; }
if [ -n "$(deb python3-osteo)" ]; then
  install $(deb python3-osteo)
  as_user "python3 - case session" <"$root/tests/setup/try_module.py"
  [ -s "$work/root/usr/share/doc/python3-osteo/examples/drilled_hole.py" ] || { echo "no examples for Python"; exit 1; }
fi
if [ -n "$(deb osteo-full)" ]; then
  install $(deb osteo-full)
  ! installed osteo || { echo "osteo and osteo-full are both there"; exit 1; }
  installed osteo-rehearse || { echo "osteo-full has thrown out osteo-rehearse"; exit 1; }
  inside osteo --version | grep -q AGPL || { echo "osteo-full does not say that it is AGPL"; exit 1; }
  as_user "osteo prepare ct.nrrd -o case-full --lower 500 --spacing-mm 1 --quiet"
  # The same case by either: the copyleft parts add commands and change none.
  as_user "cmp case/surface.ply case-full/surface.ply"
fi
install $(deb libosteo-dev)
[ -s "$work/root/usr/include/osteo/core/data/tri_mesh.h" ] && ls "$work"/root/usr/lib/*/osteo/libosteo_base.a >/dev/null || { echo "libosteo-dev holds no library"; exit 1; }
if [ -n "${OSTEO_DEBS_OUTSIDE:-}" ]; then
  install g++ cmake make
  cp -r "$root/tests/setup/outside" "$work/root/outside"
  chmod -R a+rX "$work/root/outside"
  as_user "cmake -S /outside -B built -DCMAKE_BUILD_TYPE=Release '-DEXAMPLES=import;haptics' && cmake --build built && ctest --test-dir built" >"$work/said" 2>&1 || { tail -30 "$work/said"; exit 1; }
  grep -q '100% tests passed' "$work/said" || { tail -20 "$work/said"; exit 1; }
  echo "another project is built against libosteo-dev and runs"
fi
# Removed with all that came for them, nothing of theirs may stay.
ours=$(cd "$debs" && for f in *.deb; do dpkg-deb -f "$f" Package; done)
inside apt-get purge -y -qq $ours >"$work/apt" 2>&1 || { tail -20 "$work/apt"; exit 1; }
for package in $ours; do
  ! installed "$package" || { echo "$package is still installed"; exit 1; }
done
left=$(cd "$work/root" && find usr etc var/lib -xdev \( -ipath '*osteo*' \) ! -path 'var/lib/apt/*' ! -path 'var/lib/dpkg/*' | head)
[ -z "$left" ] || { echo "left behind: $left"; exit 1; }
echo "installed, run as a user, replaced and removed"

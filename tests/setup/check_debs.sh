#!/usr/bin/env bash
# Debian packages judged by lintian, then installed into a fresh Debian root and run there as a user. Wants root, a mirror and mmdebstrap.
# usage: check_debs.sh FOLDER_OF_DEBS
set -euo pipefail
debs=$(cd "${1:?usage: check_debs.sh FOLDER_OF_DEBS}" && pwd)
for tool in lintian mmdebstrap; do
  command -v $tool >/dev/null || { echo "$tool is not here"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "a fresh root wants root"; exit 77; }
work=$(mktemp -d "${TMPDIR:-/tmp}/osteo-debs-XXXXXX")
trap 'umount "$work/root/proc" 2>/dev/null || true; rm -rf --one-file-system "$work"' EXIT
chmod 755 "$work"
for deb in "$debs"/*.deb; do
  echo "lintian: $(basename "$deb")"
  lintian --fail-on error --tag-display-limit 3 "$deb" >"$work/lintian" 2>&1 || { grep '^E:' "$work/lintian"; exit 1; }
  sed 's/ .*//' "$work/lintian" | sort | uniq -c | sed 's/^/  /'
done
mmdebstrap --quiet --variant=apt --aptopt='APT::Install-Recommends "false"' bookworm "$work/root"
base=$(du -sxm "$work/root" | cut -f1)
mkdir "$work/root/debs"
cp "$debs"/*.deb "$work/root/debs"
cp /etc/resolv.conf "$work/root/etc" 2>/dev/null || true
mount -t proc proc "$work/root/proc"
inside() { chroot "$work/root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"; }
install() { inside apt-get install -y -qq --no-install-recommends "$@" >"$work/apt" 2>&1 || { tail -20 "$work/apt"; exit 1; }; }
install $(cd "$debs" && ls osteo_*.deb | sed 's|^|/debs/|')
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
for f in /usr/share/man/man1/osteo-prepare.1.gz /usr/share/bash-completion/completions/osteo /usr/lib/udev/rules.d/70-osteotome.rules /usr/share/doc/osteo/osteo.spdx.json /usr/share/doc/osteo/copyright; do
  [ -s "$work/root$f" ] || { echo "$f is not there"; exit 1; }
done
install $(cd "$debs" && ls osteo-rehearse_*.deb | sed 's|^|/debs/|')
inside osteo-rehearse --version | grep -q osteo || { echo "osteo-rehearse does not start"; exit 1; }
[ -s "$work/root/usr/share/applications/osteo.desktop" ] || { echo "no desktop entry"; exit 1; }
if ls "$debs"/osteo-full_*.deb >/dev/null 2>&1; then
  install $(cd "$debs" && ls osteo-full_*.deb | sed 's|^|/debs/|')
  ! inside dpkg -s osteo 2>/dev/null | grep -q '^Status: install ok installed' || { echo "osteo and osteo-full are both there"; exit 1; }
  inside osteo --version | grep -q AGPL || { echo "osteo-full does not say that it is AGPL"; exit 1; }
fi
inside apt-get remove -y -qq osteo-rehearse >/dev/null 2>&1
echo "installed, run as a user, replaced and removed"

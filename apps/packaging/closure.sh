#!/bin/sh
# Of what is installed on this Debian, copies into a folder what a program of one package can load: the package itself, the shared libraries that the
# loader gives it, Mesa's drawing in memory (loaded by name), letters and DICOM's dictionary. What the packages listed in BEFORE already hold is left out.
# Each package of which something is copied comes with its copyright file and its record in dpkg's status.d, where scanners look.
# usage: closure.sh PACKAGE TO BEFORE      BEFORE: `dpkg-query -W` of what is there without it
set -eu
package=$1 to=$2 before=$3
mkdir "$to"
list=$(mktemp)
dpkg-query -W >"$list.now"
# Packages that came along, or in another version.
sort "$before" >"$list.a"; sort "$list.now" | comm -13 "$list.a" - | cut -f1 >"$list.new"
loaded() { # the libraries that loading FILE loads, and it itself
  for file; do
    echo "$file"
    ldd "$file" | sed -nE 's/.*=> (\/[^ ]+) .*/\1/p'
  done
}
folder=$(dirname "$(find /usr/lib -name libEGL_mesa.so.0)")
{
  dpkg -L "$package" | grep -vE '^/usr/share/(man|lintian|doc/osteotome/images)(/|$)'
  loaded /usr/bin/osteo "$folder/libEGL_mesa.so.0" "$folder/dri/swrast_dri.so" "$folder/dri/kms_swrast_dri.so"
  for data in fonts-liberation fonts-dejavu-core fontconfig-config; do dpkg -L $data | grep -vE '^/usr/share/(man|bug|lintian)(/|$)'; done
  dpkg -L "$(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' 'libdcmtk*' | awk '/^ii/ { print $2 }')" | grep -vE '\.so|/doc/|/man/|/bug/'
  ls /usr/share/glvnd/egl_vendor.d/* /usr/share/drirc.d/*
  find /etc/fonts
} | sort -u >"$list"
# A name, and what each link on its way leads to, as they are below /usr (Debian's /lib is a link).
while read -r file; do
  while [ -e "$file" ] || [ -L "$file" ]; do
    file=$(realpath "$(dirname "$file")")/$(basename "$file")
    [ -d "$file" ] && [ ! -L "$file" ] || echo "$file"
    [ -L "$file" ] || break
    next=$(readlink "$file")
    case $next in /*) file=$next ;; *) file=$(dirname "$file")/$next ;; esac
  done
done <"$list" | sort -u >"$list.files"
# Whose each is: Debian 12 knows a library below /lib or below /usr/lib.
{ cat "$list.files"; sed 's|^/usr/lib/|/lib/|' "$list.files"; } | xargs dpkg -S 2>/dev/null | sed -E 's/^([^:, ]+)[^/]*: (\/.*)/\2 \1/; s|^/lib/|/usr/lib/|' | sort -u >"$list.owner"
mkdir -p "$to/var/lib/dpkg/status.d"
# Of what nobody owns (links of alternatives) all, of what the base has nothing.
awk -v new="$list.new" -v owners="$list.owner" -v packages="$list.packages" '
  BEGIN { while ((getline < new) > 0) { sub(/:.*/, "", $1); came[$1] = 1 } while ((getline < owners) > 0) owner[$1] = $2 }
  !($0 in owner) { print; next }
  owner[$0] in came { print; if (!seen[owner[$0]]++) print owner[$0] > packages }' "$list.files" >"$list.copied"
# In one call: names of one file stay one.
tr '\n' '\0' <"$list.copied" | xargs -0 -n 100000 cp -a --parents -t "$to"
while read -r owner; do
  dpkg-query -s "$owner" >"$to/var/lib/dpkg/status.d/$owner"
  [ -e "/usr/share/doc/$owner/copyright" ] && mkdir -p "$to/usr/share/doc/$owner" && cp -L "/usr/share/doc/$owner/copyright" "$to/usr/share/doc/$owner/"
done <"$list.packages"
echo "$(wc -l <"$list.packages") packages of $(wc -l <"$list.new") that came, $(du -sm "$to" | cut -f1) MB" >&2

#!/usr/bin/env bash
# The window's Chinese letters: of Noto Sans CJK those that the catalogue has. Wants Debian's fonts-noto-cjk and fontTools (pyftsubset), or another
# place of the font as argument.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
from=${1:-/usr/share/fonts/opentype/noto/NotoSansCJK-Regular.ttc}
letters=$(mktemp)
trap 'rm -f "$letters"' EXIT
cat "$here/../../../core/base/po/zh_CN.po" > "$letters"
printf '简体中文' >> "$letters"
# Font 2 of the collection is Noto Sans CJK SC.
pyftsubset "$from" --font-number=2 --text-file="$letters" --output-file="$here/NotoSansSC-Catalogue.otf" --layout-features= --no-hinting \
  --desubroutinize --drop-tables+=GSUB,GPOS,GDEF,BASE,vhea,vmtx,VORG --name-IDs=0,1,2,13,14

#!/usr/bin/env bash
# The window's Chinese, Japanese and Korean letters: of Noto Sans CJK those that the catalogue has, and those of names: GB 2312, level 1 of
# JIS X 0208, kana, the Hangul of KS X 1001. Wants Debian's fonts-noto-cjk and fontTools (pyftsubset), or another place of the font as argument.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
from=${1:-/usr/share/fonts/opentype/noto/NotoSansCJK-Regular.ttc}
letters=$(mktemp)
trap 'rm -f "$letters"' EXIT
cat "$here/../../../core/base/po/zh_CN.po" > "$letters"
printf '简体中文' >> "$letters"
python3 - >> "$letters" <<'PYTHON'
def rows(encoding, first, last):
    for row in range(first, last + 1):
        for cell in range(0xA1, 0xFF):
            yield bytes([row, cell]).decode(encoding, "ignore")
print("".join([*rows("gb2312", 0xA1, 0xA3), *rows("gb2312", 0xB0, 0xF7), *rows("euc_jp", 0xA4, 0xA5), *rows("euc_jp", 0xB0, 0xCF),
               *rows("euc_kr", 0xB0, 0xC8)]))
PYTHON
# Font 2 of the collection is Noto Sans CJK SC.
pyftsubset "$from" --font-number=2 --text-file="$letters" --output-file="$here/NotoSansSC.otf" --layout-features= --no-hinting \
  --desubroutinize --drop-tables+=GSUB,GPOS,GDEF,BASE,vhea,vmtx,VORG --name-IDs=0,1,2,13,14

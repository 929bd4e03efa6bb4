#!/usr/bin/env python3
"""Outlines of the window's icons as short lines, for a draw list at any size. usage: make_icons.py > ../src/icon_lines.h (needs fontTools)

Sources: docs/design/tabler.json (Tabler Icons, MIT: LICENSES/MIT.txt) and the instruments of docs/design/sketches.py.
"""

import ast, json, math, pathlib
from fontTools.pens.basePen import BasePen
from fontTools.svgLib.path import parse_path

design = pathlib.Path(__file__).resolve().parents[4] / "docs/design"
ICONS = json.loads((design / "tabler.json").read_text())
source = (design / "sketches.py").read_text()
own = source[source.index("ICONS |= {") + 9 :]
ICONS |= ast.literal_eval(own[: own.index("\n}") + 2])
USED = """drill saw plate fragments suction droplet arrow-bar-to-down arrow-bar-up arrow-back-up versions ruler-measure note camera command
menu-2 search x chevron-down chevron-right plus minus check alert-triangle info-circle bone folder-open history power settings
maximize layout-grid target help player-play player-pause player-track-prev player-track-next eye eye-off
adjustments-horizontal crosshair scissors list-check""".split()


class Lines(BasePen):
    """Curves in steps small enough for an icon of 64 pixels."""

    def __init__(self):
        super().__init__(None)
        self.lines = []

    def _moveTo(self, p):
        self.lines.append([p])

    def _lineTo(self, p):
        self.lines[-1].append(p)

    def _curveToOne(self, b, c, d):
        a = self.lines[-1][-1]
        n = max(2, min(10, math.ceil(2.2 * math.sqrt(math.dist(a, b) + math.dist(b, c) + math.dist(c, d)))))
        for k in range(1, n + 1):
            t = k / n
            w = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3)
            self.lines[-1].append(tuple(sum(f * p[i] for f, p in zip(w, (a, b, c, d))) for i in (0, 1)))

    def _closePath(self):
        self.lines[-1].append(self.lines[-1][0])


print(
    "// Made by libs/app/window/icons/make_icons.py: not edited by hand. Tabler Icons, https://tabler.io/icons, MIT, Copyright (c)"
)
print("// 2020-2026 Pawel Kuna; drill, saw, plate, fragments and suction are our own.")
print("#pragma once\n#include <cstdint>\n#include <string_view>\n\nnamespace osteo::inline app {\n")
print("/// Lines one after another in tenths of a unit of 24 x 24: a count of points, then x and y of each; 0 ends.")
print("struct IconLines {\n  std::string_view name;\n  const std::uint8_t* lines;\n};\n\n// clang-format off")
rows = []
for name in USED:
    pen = Lines()
    for d in ICONS[name]:
        parse_path(d, pen)
    out = []
    for line in pen.lines:
        points = [tuple(max(0, min(255, round(10 * v))) for v in p) for p in line]
        points = [p for n, p in enumerate(points) if n == 0 or p != points[n - 1]]
        if len(points) == 1:
            points.append((points[0][0] + 1, points[0][1]))  # a dot
        out += [len(points), *(v for p in points for v in p)]
    variable = "kIcon_" + name.replace("-", "_")
    print(f"inline constexpr std::uint8_t {variable}[] = {{{','.join(map(str, out + [0]))}}};")
    rows.append(f'    {{"{name}", {variable}}},')
print(
    "inline constexpr IconLines kIcons[] = {\n"
    + "\n".join(rows)
    + "\n};\n// clang-format on\n\n}  // namespace osteo::inline app"
)

#!/usr/bin/env python3
"""Draws the plots of docs/validation/geometry.md from the tables that 'osteo bench geometry' prints.

usage: build/peers/bin/python3 docs/images/plot.py TABLES.md
"""

import pathlib, sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = pathlib.Path(__file__).resolve().parent


def table(text, heading):
    rows = text.split("### " + heading, 1)[1].split("###")[0]
    lines = [l.strip().strip("|").split("|") for l in rows.splitlines() if l.startswith("|")]
    cells = [[c.strip() for c in l] for l in lines]
    return cells[0], cells[2:]


text = pathlib.Path(sys.argv[1]).read_text()
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})

head, rows = table(text, "Distance maps of the inside")
names = list(dict.fromkeys(r[0] for r in rows))
figure, axes = plt.subplots(1, len(names), figsize=(3 * len(names), 3.2), sharey=True, squeeze=False)
methods = {
    "ours": ("#c0392b", "-"),
    "Embree + hint": ("#2c7fb8", "-"),
    "CGAL AABB": ("#41ab5d", "-"),
    "thesis corrected": ("#888888", "-"),
    "thesis as printed": ("#888888", ":"),
    "published 2006": ("#bbbbbb", "--"),
}
for ax, name in zip(axes[0], names):
    mine = [r for r in rows if r[0] == name]
    x = [int(r[1]) for r in mine]
    for method, (colour, style) in methods.items():
        y = [float(r[head.index(method)]) if r[head.index(method)] else None for r in mine]
        if None not in y:
            ax.loglog(
                x,
                y,
                style,
                color=colour,
                marker="o",
                markersize=3,
                linewidth=1.8 if method == "ours" else 1.1,
                label=method,
            )
    ax.set_title(name)
    ax.set_xlabel("voxels along the longest extent")
    ax.set_xticks(x, [str(v) for v in x])
    ax.minorticks_off()
axes[0][0].set_ylabel("CPU s, one thread")
axes[0][0].legend(fontsize=7, frameon=False)
figure.tight_layout()
figure.savefig(here / "geometry-time.png", dpi=110)

head, rows = table(text, "Time against error")
figure, ax = plt.subplots(figsize=(8.5, 4.2))
for n, r in enumerate(sorted(rows, key=lambda r: float(r[1]))):
    seconds, error = float(r[1]), max(float(r[3]), 1e-15)
    ours = r[0].startswith("ours")
    ax.loglog(seconds, error, "o", color="#c0392b" if ours else "#2c7fb8", markersize=8 if ours else 6)
    ax.annotate(
        r[0].split(" (")[0].split(", from")[0].split(", CPU")[0],
        (seconds, error),
        xytext=(6, 6 + 11 * (n % 5) if error < 1e-12 and not ours else 4),
        textcoords="offset points",
        fontsize=7,
    )
ax.set_xlabel("CPU s (bunny, 195 voxels along, 1.56 million voxels inside)")
ax.set_ylabel("largest error, voxels")
ax.set_xlim(0.1, 400)
figure.tight_layout()
figure.savefig(here / "geometry-error.png", dpi=110)

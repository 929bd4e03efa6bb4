#!/usr/bin/env python3
"""Draws the plots of docs/validation/haptics.md from the tables that 'osteo bench haptics' prints.

usage: build/peers/bin/python3 docs/images/plot_haptics.py TABLES.md
"""

import pathlib, sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = pathlib.Path(__file__).resolve().parent
text = pathlib.Path(sys.argv[1]).read_text()
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
colours = {"overlap": "#c0392b", "proxy": "#e08e0b", "volume": "#2c7fb8", "rays": "#41ab5d"}


def table(heading):
    rows = text.split("### " + heading, 1)[1].split("###")[0]
    cells = [[c.strip() for c in l.strip().strip("|").split("|")] for l in rows.splitlines() if l.startswith("|")]
    return cells[2:]


# Time against error, one panel a body; size of the marker: voxels.
rows = table("Contact models against the truth")
bodies = list(dict.fromkeys(r[0] for r in rows))
figure, axes = plt.subplots(1, len(bodies), figsize=(3 * len(bodies), 3.2), sharey=True)
for ax, body in zip(axes, bodies):
    for method, colour in colours.items():
        mine = [r for r in rows if r[0] == body and r[2] == method]
        ax.loglog([float(r[7]) for r in mine], [float(r[4]) for r in mine], "-", color=colour, linewidth=0.8, alpha=0.6)
        for r in mine:
            ax.loglog(
                float(r[7]),
                float(r[4]),
                "o",
                color=colour,
                markersize=3 + 5 * float(r[1]),
                label=method if r[1] == "0.5" else None,
            )
    ax.set_title(body)
    ax.set_xlabel("us a contact, median")
    ax.set_xticks([2, 5, 10, 20], ["2", "5", "10", "20"])
    ax.minorticks_off()
axes[0].set_ylabel("mean force error, N")
axes[0].legend(fontsize=7, frameon=False)
figure.tight_layout()
figure.savefig(here / "haptics-error.png", dpi=110)

# God-object: error against time.
rows = [r for r in table("God-object on a closed smooth shape") if r[2] == "0.0"]
figure, ax = plt.subplots(figsize=(7, 3.8))
for r in rows:
    kind = "cubic" if r[0].startswith("cubic") else "shaded" if "shaded" in r[0] else "flat"
    ax.loglog(float(r[7]), float(r[3]), "o", color={"cubic": "#c0392b", "shaded": "#2c7fb8", "flat": "#41ab5d"}[kind])
    ax.annotate(
        r[0].replace(" triangles", ""),
        (float(r[7]), float(r[3])),
        xytext=(6, 3),
        textcoords="offset points",
        fontsize=7,
    )
published = [
    (0.8, 0.46),
    (0.8, 0.155),
    (0.8, 0.083),
    (0.95, 0.033),
    (1.0, 0.019),
    (1.35, 0.015),
    (1.85, 0.011),
    (2.6, 0.012),
]
ax.loglog(*zip(*published), "x", color="#888888", label="CHAI3D 3.3, published, shaded, tolerance 1 um")
ax.legend(fontsize=7, frameon=False)
ax.set_xlabel("us an update, median")
ax.set_ylabel("mean force error, N")
figure.tight_layout()
figure.savefig(here / "haptics-god-object.png", dpi=110)

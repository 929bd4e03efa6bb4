#!/usr/bin/env python3
"""Draws the plots of docs/validation/tissue.md from the tables that 'osteo bench tissue' prints.

usage: build/peers/bin/python3 docs/images/plot_tissue.py TABLES.md
"""

import pathlib, sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

here = pathlib.Path(__file__).resolve().parent
text = pathlib.Path(sys.argv[1]).read_text()
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})


def table(heading):
    rows = text.split("### " + heading, 1)[1].split("###")[0]
    cells = [[c.strip() for c in l.strip().strip("|").split("|")] for l in rows.splitlines() if l.startswith("|")]
    return cells[2:]


# Error against the size of the elements, one panel a problem.
problems = {
    "a bent beam": "bent beam, energy",
    "Cook's membrane": "Cook's membrane, rise",
    "Lame's tube, nu 0.3": "Lame's tube, nu 0.3",
    "Lame's tube, nu 0.499": "Lame's tube, nu 0.499",
}
figure, axes = plt.subplots(1, len(problems), figsize=(11, 3), sharey=True)
for ax, (heading, title) in zip(axes, problems.items()):
    rows = table("Finite elements: " + heading + "\n")
    n = [float(r[0]) for r in rows]
    for column, name, colour in ((1, "linear (t4)", "#c0392b"), (4, "quadratic (t10)", "#2c7fb8")):
        error = [float(r[column]) for r in rows]
        ax.loglog(n, error, "o-", color=colour, markersize=4, label=f"{name}: order {rows[-1][column + 1]}")
    first = float(rows[0][1])
    ax.loglog(n, [first * (n[0] / k) ** 2 for k in n], ":", color="#888", linewidth=1, label="order 2")
    ax.set_title(title, fontsize=9)
    ax.set_xlabel("elements along")
    ax.set_xticks(n, [f"{k:g}" for k in n])
    ax.minorticks_off()
    ax.legend(fontsize=6.5, frameon=False)
axes[0].set_ylabel("relative error")
figure.tight_layout()
figure.savefig(here / "tissue-orders.png", dpi=110)

# Seconds of computing for a second of motion, against how far off it is.
figure, axes = plt.subplots(1, 3, figsize=(11, 3.3))
for ax, nu in zip(axes, ("0.450", "0.499")):
    rows = [
        r
        for h in text.split("### ")[1:]
        if h.startswith("A plucked post") and "nu " + nu in h.split("\n")[0]
        for r in [[c.strip() for c in l.strip().strip("|").split("|")] for l in h.splitlines() if l.startswith("|")][2:]
    ]
    for name, colour in (
        ("explicit, 0", "#2c7fb8"),
        ("explicit, heavier", "#e08e0b"),
        ("implicit, one iteration", "#41ab5d"),
        ("implicit, to its end", "#c0392b"),
    ):
        mine = [r for r in rows if r[0].startswith(name)]
        ax.loglog(
            [float(r[3]) for r in mine],
            [float(r[2]) for r in mine],
            "o-",
            color=colour,
            markersize=4,
            linewidth=0.8,
            label=name if name != "explicit, 0" else "explicit, certified steps",
        )
    ax.set_title(f"a plucked post, nu {float(nu):g}", fontsize=9)
    ax.set_xlabel("s a simulated second")
    ax.set_ylabel("off after 0.1 s")
    ax.legend(fontsize=6.5, frameon=False)
rows = table("Resolution")
for column, name, colour in ((2, "fast model, closed form", "#2c7fb8"), (4, "t4", "#c0392b"), (6, "t10", "#41ab5d")):
    mine = [r for r in rows if r[column]]
    axes[2].loglog(
        [float(r[column + 1]) + 1e-3 for r in mine],
        [float(r[column]) for r in mine],
        "o-",
        color=colour,
        markersize=4,
        linewidth=0.8,
        label=name,
    )
axes[2].set_title("a cube at rest under load, 4 to 16 voxels along", fontsize=9)
axes[2].set_xlabel("s to rest")
axes[2].set_ylabel("off t10 at 16")
axes[2].legend(fontsize=6.5, frameon=False)
figure.tight_layout()
figure.savefig(here / "tissue-time.png", dpi=110)

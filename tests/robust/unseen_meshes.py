#!/usr/bin/env python3
"""Fourteen closed surfaces of the kinds that meshers die of, through every method of tetrahedralize, with and without repair.

usage: unseen_meshes.py OSTEO [--methods grid,tetgen] [--table]

Passes when nothing crashes (exit codes 0, 7: the method says why it cannot, 9: out of its limits) and every mesh that is written has no inverted
tetrahedron and the volume that the non-zero rule gives the surface: to 0.5 % by tetgen, 5 % by cgal and grid-conforming, and for the staircases of
grid and graded to 12 %, or with a warning that it is off.
"""

import json, math, os, subprocess, sys, tempfile


def box(lo, hi):
    p = [(hi[0] if c & 1 else lo[0], hi[1] if c & 2 else lo[1], hi[2] if c & 4 else lo[2]) for c in range(8)]
    t = [
        (0, 2, 1),
        (1, 2, 3),
        (4, 5, 6),
        (5, 7, 6),
        (0, 1, 4),
        (1, 5, 4),
        (2, 6, 3),
        (3, 6, 7),
        (0, 4, 2),
        (2, 4, 6),
        (1, 3, 5),
        (3, 7, 5),
    ]
    return p, t


def ball(centre, radius, n=16):
    p = [(centre[0], centre[1], centre[2] - radius)]
    for i in range(1, n):
        for j in range(2 * n):
            a, b = math.pi * i / n, math.pi * j / n
            p.append(
                (
                    centre[0] + radius * math.sin(a) * math.cos(b),
                    centre[1] + radius * math.sin(a) * math.sin(b),
                    centre[2] - radius * math.cos(a),
                )
            )
    p.append((centre[0], centre[1], centre[2] + radius))
    t, at = [], lambda i, j: 1 + (i - 1) * 2 * n + j % (2 * n)
    for j in range(2 * n):
        t.append((0, at(1, j + 1), at(1, j)))
        for i in range(1, n - 1):
            t += [(at(i, j), at(i, j + 1), at(i + 1, j)), (at(i, j + 1), at(i + 1, j + 1), at(i + 1, j))]
        t.append((len(p) - 1, at(n - 1, j), at(n - 1, j + 1)))
    return p, t


def joined(*parts):
    p, t = [], []
    for q, u in parts:
        t += [tuple(i + len(p) for i in f) for f in u]
        p += q
    return p, t


def turned(part):
    return part[0], [(a, c, b) for a, b, c in part[1]]


def volume(part):
    p, t = part
    det = (
        lambda a, b, c: a[0] * (b[1] * c[2] - b[2] * c[1])
        - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
    return sum(det(p[a], p[b], p[c]) for a, b, c in t) / 6


def star():
    """A box whose lid is pushed through its floor: it intersects itself."""
    p, t = ball((0, 0, 0), 10)
    return [(x, y, z - 16 if z > 8 else z) for x, y, z in p], t


ten, one = ball((0, 0, 0), 10), ball((0, 0, 0), 4)
lens = 5 / 12 * math.pi * 1000
MESHES = {  # name: (surface, volume by the non-zero rule; None: as mesh-repair finds it)
    "one ball": (ten, volume(ten)),
    "ball in a ball, a body": (joined(ten, one), volume(ten)),
    "ball in a ball, a cavity": (joined(ten, turned(one)), volume(ten) - volume(one)),
    "three nested": (
        joined(ten, turned(ball((0, 0, 0), 7)), one),
        volume(ten) - volume(ball((0, 0, 0), 7)) + volume(one),
    ),
    "two boxes, one face": (joined(box((0, 0, 0), (10, 10, 10)), box((10, 0, 0), (20, 10, 10))), 2000),
    "two boxes, part of a face": (joined(box((0, 0, 0), (10, 10, 10)), box((10, 2, 2), (16, 7, 7))), 1150),
    "two boxes, one edge": (joined(box((0, 0, 0), (10, 10, 10)), box((10, 10, 0), (20, 20, 10))), 2000),
    "eight boxes, all touching": (
        joined(
            *[
                box((i * 8, j * 8, k * 8), (i * 8 + 8, j * 8 + 8, k * 8 + 8))
                for i in (0, 1)
                for j in (0, 1)
                for k in (0, 1)
            ]
        ),
        4096,
    ),
    "two balls, overlapping": (joined(ten, ball((10, 0, 0), 10)), None),
    "a row of balls, overlapping": (joined(*[ball((7 * i, i, 0), 5, 10) for i in range(5)]), None),
    "three bars through each other": (
        joined(
            box((-2, -2, -12), (2, 2, 12)), box((-2, -12, -2.1), (2, 12, 1.9)), box((-12, -2.2, -2), (12, 1.8, 2.3))
        ),
        None,
    ),
    "a ball through itself": (star(), None),
    "slivers": (joined(box((0, 0, 0), (100, 1, 0.1)), box((0, 3, 0), (100, 3.02, 5))), 20),
    "a sheet of a ten millionth": (box((0, 0, 0), (20, 20, 1e-7)), 4e-5),
}


def write_obj(path, part):
    with open(path, "w") as f:
        f.writelines("v %.9g %.9g %.9g\n" % p for p in part[0])
        f.writelines("f %d %d %d\n" % tuple(i + 1 for i in t) for t in part[1])


def main():
    osteo = os.path.abspath(sys.argv[1])
    methods = "grid,grid-conforming,graded,tetgen,cgal".split(",")
    if "--methods" in sys.argv:
        methods = sys.argv[sys.argv.index("--methods") + 1].split(",")
    bad, rows = [], []
    with tempfile.TemporaryDirectory() as work:
        for number, (name, (surface, expected)) in enumerate(MESHES.items()):
            path = f"{work}/{number}.obj"
            write_obj(path, surface)
            row = [name]
            for method in methods:
                for clean in (False, True):
                    if clean and method not in ("tetgen", "cgal"):
                        continue
                    out = f"{work}/{number}-{method}-{clean}.vtu"
                    run = subprocess.run(
                        [
                            osteo,
                            "tetrahedralize",
                            path,
                            out,
                            "--method",
                            method,
                            "--resolution",
                            "24",
                            "--json",
                            "--time-limit-s",
                            "5",
                        ]
                        + (["--clean"] if clean else []),
                        capture_output=True,
                        text=True,
                    )
                    what = f"{name}, {method}{' --clean' if clean else ''}"
                    if run.returncode == 0:
                        report = json.loads(run.stdout)["stages"][0]["report"]
                        true = expected if expected is not None else report["surface_volume_mm3"]
                        off = report["volume_mm3"] / true - 1
                        most = {"tetgen": 0.005, "cgal": 0.05, "grid-conforming": 0.05}.get(method, 0.12)
                        warned = "the tetrahedra fill" in run.stderr
                        if report["inverted"] or (abs(off) > most and not warned):
                            bad.append(f"{what}: {report['inverted']} inverted, volume off by {100 * off:.2f} %")
                        row.append(f"{100 * off:+.2f} %")
                    elif run.returncode in (7, 9):
                        row.append("refused: " + run.stderr.strip().splitlines()[0].replace("osteo: ", "")[:60])
                    else:
                        bad.append(f"{what}: exit code {run.returncode}\n{run.stderr}")
                        row.append(f"EXIT {run.returncode}")
            rows.append(row)
    if "--table" in sys.argv:
        print(
            "| surface | "
            + " | ".join(m + s for m in methods for s in (["", " --clean"] if m in ("tetgen", "cgal") else [""]))
            + " |"
        )
        print("|---" * len(rows[0]) + "|")
        for row in rows:
            print("| " + " | ".join(row) + " |")
    print("\n".join(bad) or "all right", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Hard surfaces that nobody chose, made from a seed, through voxelize, mesh-repair and the methods of tetrahedralize.

usage: hard_meshes.py OSTEO [--count 100] [--seed 1] [--first 0] [--methods grid,grid-conforming,graded,tetgen,cgal] [--limit-s 60] [--table]

Surface i of a seed is always the same. Passes when every command ends in --limit-s (or says it will not: exit codes 7 and 9), voxels are inside where
the winding number (solid angles of all triangles) says so, mesh-repair's count of what intersects is what mesh-info finds in the file, a body that a step
changes by over 3 % is told, and no mesh has an inverted tetrahedron or, untold, another volume (5 %).
"""

import argparse, json, math, os, random, subprocess, sys, tempfile, time, zlib

from unseen_meshes import ball, box, joined, turned, write_obj


def moved(part, rng, reach=1.0, grow=(0.3, 1.0)):
    """Turned at random, made larger or smaller, and put somewhere."""
    q = [rng.gauss(0, 1) for _ in range(4)]
    n = math.sqrt(sum(x * x for x in q))
    w, x, y, z = (v / n for v in q)
    turn = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    size, at = rng.uniform(*grow), [rng.uniform(-reach, reach) for _ in range(3)]
    return [tuple(at[a] + size * sum(turn[a][b] * p[b] for b in range(3)) for a in range(3)) for p in part[0]], part[1]


def solid(rng):
    a, b, c = (rng.uniform(0.3, 1) for _ in range(3))
    return box((-a, -b, -c), (a, b, c)) if rng.random() < 0.5 else ball((0, 0, 0), a, rng.randint(4, 10))


def crossing(rng):
    return joined(*[moved(solid(rng), rng) for _ in range(rng.randint(2, 5))])


def shell(rng):
    """A ball's wall, a hundredth to a ten thousandth of it thick."""
    n, thick = rng.randint(5, 12), 10 ** rng.uniform(-4, -2)
    return joined(ball((0, 0, 0), 1, n), turned(ball((0, 0, 0), 1 - thick, n)))


def needles(rng):
    return joined(
        *[
            moved(box((-1, -w, -w), (1, w, w)), rng, 0.5)
            for w in (10 ** rng.uniform(-4, -1) for _ in range(rng.randint(2, 6)))
        ]
    )


def nested(rng):
    parts, radius = [], 1.0
    for _ in range(rng.randint(2, 5)):
        part = ball((0, 0, 0), radius, rng.randint(5, 9))
        parts.append(turned(part) if rng.random() < 0.5 else part)
        radius *= rng.uniform(0.4, 0.8)
    return joined(*parts)


def touching(rng):
    """Boxes of a lattice: they share faces, edges and points."""
    places = [(i, j, k) for i in range(3) for j in range(3) for k in range(3)]
    return joined(*[box(p, tuple(x + 1 for x in p)) for p in rng.sample(places, rng.randint(3, 9))])


def flipped(rng):
    points, triangles = moved(ball((0, 0, 0), 1, rng.randint(5, 10)), rng)
    share = rng.uniform(0.05, 0.3)
    return points, [(a, c, b) if rng.random() < share else (a, b, c) for a, b, c in triangles]


def cracked(rng):
    """Every triangle has points of its own, moved a little, and some are not there."""
    points, triangles = ball((0, 0, 0), 1, rng.randint(5, 10))
    by, p, t = 10 ** rng.uniform(-6, -3), [], []
    for face in triangles:
        if rng.random() < 0.03:
            continue
        t.append((len(p), len(p) + 1, len(p) + 2))
        p += [tuple(x + rng.uniform(-by, by) for x in points[v]) for v in face]
    return p, t


def soup(rng):
    """Triangles that have nothing to do with each other."""
    n = rng.randint(10, 100)
    return [tuple(rng.uniform(0, 1) for _ in range(3)) for _ in range(3 * n)], [
        (3 * i, 3 * i + 1, 3 * i + 2) for i in range(n)
    ]


KINDS = [crossing, shell, needles, nested, touching, flipped, cracked, soup]


def surface(seed, number):
    rng = random.Random(f"{seed} {number}")
    kind = KINDS[number % len(KINDS)]
    points, triangles = kind(rng)
    # Coordinates of a surface are kept in single precision, and so are those that are judged here.
    scale = 10 ** rng.uniform(-6, 6) if rng.random() < 0.5 else 10.0
    return f"{number} {kind.__name__}", ([tuple(float("%.9g" % (x * scale)) for x in p) for p in points], triangles)


def winding(part, q):
    sum_of = 0.0
    for face in part[1]:
        a, b, c = ([part[0][v][i] - q[i] for i in range(3)] for v in face)
        la, lb, lc = (math.sqrt(sum(x * x for x in v)) for v in (a, b, c))
        dot = lambda u, v: u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
        up = (
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )
        sum_of += math.atan2(up, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
    return sum_of / (2 * math.pi)


def wrong_voxels(path, part, rng, trials=60):
    data = open(path, "rb").read()
    head, body = data.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    dims = [int(x) for x in fields["sizes"].split()]
    vectors = lambda key: [[float(x) for x in v.strip("()").split(",")] for v in fields[key].split()]
    steps, origin = vectors("space directions"), vectors("space origin")[0]
    voxels = zlib.decompress(body, 31)
    wrong = 0
    for _ in range(trials):
        at = [rng.randrange(n) for n in dims]
        q = [origin[a] + sum(at[b] * steps[b][a] for b in range(3)) for a in range(3)]
        w = abs(winding(part, q))
        if abs(w - 0.5) < 0.05:
            continue  # within what rounding of the file's coordinates moves
        inside = voxels[at[0] + dims[0] * (at[1] + dims[1] * at[2])] != 0
        wrong += inside != (w > 0.5)
    return wrong


def main():
    args = argparse.ArgumentParser()
    args.add_argument("osteo")
    for name, value in (("--count", 100), ("--seed", 1), ("--first", 0)):
        args.add_argument(name, type=int, default=value)
    args.add_argument("--methods", default="grid,grid-conforming,graded,tetgen,cgal")
    args.add_argument("--limit-s", type=float, default=60)
    args.add_argument("--table", action="store_true")
    args = args.parse_args()
    osteo, bad = os.path.abspath(args.osteo), []
    with tempfile.TemporaryDirectory() as work:
        for number in range(args.first, args.first + args.count):
            name, part = surface(args.seed, number)
            path, took = f"{work}/{number}.obj", []
            write_obj(path, part)

            def run(*words, may_refuse=(7, 9)):
                begin = time.monotonic()
                try:
                    r = subprocess.run(
                        [osteo, *words, "--json", "--force"], capture_output=True, text=True, timeout=args.limit_s
                    )
                except subprocess.TimeoutExpired:
                    bad.append(f"{name}: {' '.join(words)} had not ended after {args.limit_s:g} s")
                    took.append(f"{words[0]} >{args.limit_s:g}")
                    return None, ""
                took.append(f"{words[0]} {time.monotonic() - begin:.1f}")
                if r.returncode == 0:
                    return json.loads(r.stdout)["stages"][0]["report"], r.stderr
                if r.returncode not in may_refuse:
                    bad.append(f"{name}: {' '.join(words)}: exit code {r.returncode}\n{r.stderr}")
                return None, r.stderr

            voxels = f"{work}/{number}.nrrd"
            report, _ = run("voxelize", path, voxels, "--resolution", "20")
            if report is not None and (wrong := wrong_voxels(voxels, part, random.Random(number))):
                bad.append(f"{name}: {wrong} voxels on the wrong side")
            mended = f"{work}/{number}.ply"
            report, said = run("mesh-repair", path, mended)
            if report is not None:
                for step in ("turning", "holes", "self_intersections"):
                    if (
                        abs(report.get(f"{step}_volume_percent", 0)) > 3
                        and step != "holes"
                        and "would have changed" not in said
                    ):
                        bad.append(f"{name}: {step} changed {report[f'{step}_volume_percent']} % and nothing was said")
                found, _ = run("mesh-info", mended, f"{work}/{number}.json")
                if found is not None and found["self_intersections"] != report["self_intersections_after"]:
                    bad.append(
                        f"{name}: {report['self_intersections_after']} self-intersections told, {found['self_intersections']} in the file"
                    )
            for method in filter(None, args.methods.split(",")):
                report, said = run(
                    "tetrahedralize",
                    path,
                    f"{work}/{number}.vtu",
                    "--method",
                    method,
                    "--resolution",
                    "20",
                    "--time-limit-s",
                    "10",
                )
                if report is not None and (
                    report["inverted"] or (abs(report["volume_off_percent"]) > 5 and "the tetrahedra fill" not in said)
                ):
                    bad.append(
                        f"{name}, {method}: {report['inverted']} inverted, volume off by {report['volume_off_percent']} %"
                    )
            if args.table:
                print(f"| {name} | {len(part[1])} | {', '.join(took)} |", flush=True)
    print("\n".join(bad) or "all right", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""What a surface's distances, winding numbers and volumes are, by brute force in double precision.

usage: surface_oracle.py    holds each against a closed form
"""

import math, random, sys

import numpy as np

CHUNK = 2_000_000  # pairs of a point and a triangle at a time


def pieces(points, triangles):
    step = max(1, CHUNK // max(1, len(points)))
    for begin in range(0, len(triangles), step):
        yield begin, triangles[begin : begin + step]


def winding(points, triangles, at):
    """How often a surface winds about places: solid angles of all triangles (A. van Oosterom, J. Strackee 1983)."""
    total = np.zeros(len(at))
    for _, part in pieces(at, triangles):
        a, b, c = (points[part[:, k]][None] - at[:, None] for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("ijk,ijk->ij", x, x)) for x in (a, b, c))
        dot = lambda x, y: np.einsum("ijk,ijk->ij", x, y)
        up = dot(a, np.cross(b, c))
        total += np.arctan2(up, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb).sum(axis=1)
    return total / (2 * math.pi)


def to_triangles(at, a, b, c):
    """Squared distances of places to triangles: pairs, broadcast."""
    dot = lambda x, y: np.einsum("...k,...k->...", x, y)

    def to_segment(p, q):
        d = q - p
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.clip(np.nan_to_num(dot(at - p, d) / dot(d, d)), 0, 1)
        off = at - (p + t[..., None] * d)
        return dot(off, off)

    best = np.minimum(np.minimum(to_segment(a, b), to_segment(b, c)), to_segment(c, a))
    n = np.cross(b - a, c - a)
    nn = dot(n, n)
    over = np.ones(best.shape, bool)
    for p, q in ((a, b), (b, c), (c, a)):
        over &= dot(np.cross(q - p, at - p), n) >= 0
    with np.errstate(invalid="ignore", divide="ignore"):
        high = dot(at - a, n) ** 2 / nn
    return np.where(over & (nn > 0), np.minimum(best, high), best)


def distances(points, triangles, at):
    """Of each place to the nearest triangle."""
    # In units of the surface, so that squares of tiny surfaces do not vanish.
    unit = max(float(np.ptp(points, axis=0).max()), 1e-300)
    points, at = points / unit, at / unit
    best = np.full(len(at), np.inf)
    for _, part in pieces(at, triangles):
        a, b, c = (points[part[:, k]][None] for k in range(3))
        best = np.minimum(best, to_triangles(at[:, None], a, b, c).min(axis=1))
    return np.sqrt(best) * unit


def inside_volume(points, triangles, seed=0):
    """Volume where a closed surface's winding number is not zero, and its standard error: lengths inside along jittered rays."""
    rows, grids = int(np.clip(math.sqrt(2e6 / len(triangles)), 60, 250)), 6 if len(triangles) < 200_000 else 2
    size = np.ptp(points, axis=0)
    up = int(np.argmin(size))  # along the shortest side: the most of the surface is met
    u, v = [k for k in range(3) if k != up]
    lo, cell = points.min(axis=0), np.maximum(size, 1e-300) / rows
    rng, found = np.random.default_rng(seed), []
    corner = points[triangles]
    # Which cells a triangle can be met in.
    first = np.clip(np.floor((corner.min(axis=1) - lo) / cell - 1e-9).astype(int), 0, rows - 1)
    last = np.clip(np.floor((corner.max(axis=1) - lo) / cell + 1e-9).astype(int), 0, rows - 1)
    wide, high = last[:, u] - first[:, u] + 1, last[:, v] - first[:, v] + 1
    which = np.repeat(np.arange(len(triangles)), wide * high)
    place = np.arange(len(which)) - np.repeat(np.cumsum(wide * high) - wide * high, wide * high)
    i, j = first[which, u] + place % wide[which], first[which, v] + place // wide[which]
    for _ in range(grids):
        jitter = rng.random((rows, rows, 2))
        x = lo[u] + (i + jitter[i, j, 0]) * cell[u]
        y = lo[v] + (j + jitter[i, j, 1]) * cell[v]
        side = []
        for k in range(3):
            p, q = corner[which, k], corner[which, (k + 1) % 3]
            # The same number for an edge from both its triangles.
            swap = (p[:, u] > q[:, u]) | ((p[:, u] == q[:, u]) & (p[:, v] > q[:, v]))
            p, q = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
            e = (q[:, u] - p[:, u]) * (y - p[:, v]) - (q[:, v] - p[:, v]) * (x - p[:, u])
            side.append(np.where(swap, -e, e))
        side = np.array(side)
        met = (side > 0).all(axis=0) | (side < 0).all(axis=0)
        weight = side[:, met]
        share = weight / weight.sum(axis=0)  # of edge k: that of the corner across from it
        c = corner[which[met]]
        at = share[1] * c[:, 0, up] + share[2] * c[:, 1, up] + share[0] * c[:, 2, up]
        step = np.where(weight[0] > 0, 1, -1)
        ray = i[met] * rows + j[met]
        order = np.lexsort((at, ray))
        at, step, ray = at[order], step[order], ray[order]
        total = np.cumsum(step)
        begins = np.flatnonzero(np.diff(ray, prepend=-1))
        before = np.repeat(total[begins] - step[begins], np.diff(np.append(begins, len(ray))))
        turns = total - before
        same = ray[1:] == ray[:-1]
        found.append(float((np.diff(at) * same * (turns[:-1] != 0)).sum() * cell[u] * cell[v]))
    return float(np.mean(found)), float(np.std(found, ddof=1) / math.sqrt(grids))


def signed_volumes(points, tets):
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def open_edges(triangles):
    """Edges that are not used as often one way as the other."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, of = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return int(np.count_nonzero(np.bincount(of.ravel(), np.where(edges[:, 0] < edges[:, 1], 1, -1))))


def main():
    from hard_surfaces import KINDS, box, joined, large, read_ply, read_tets, surface, turned, write_ply, write_tets
    import os, tempfile

    bad = []

    def holds(what, found, wanted, off):
        if not np.all(np.abs(np.asarray(found, float) - wanted) <= off):
            bad.append(f"{what}: {found}, not {wanted}")

    array = lambda part: (np.array(part[0], float), np.array(part[1]))
    cube, triangles = array(box((0, 0, 0), (2, 2, 2)))
    at = np.array([(1, 1, 1), (1, 1, 1.9), (3, 1, 1), (3, 3, 3), (1, 3, 3), (5, 1, 0.5)], float)
    holds("distance to a cube", distances(cube, triangles, at), [1, 0.1, 1, math.sqrt(3), math.sqrt(2), 3], 1e-14)
    holds(
        "of a cube of 2e-6",
        distances(cube * 1e-6, triangles, at * 1e-6),
        [1e-6, 1e-7, 1e-6, 3**0.5 * 1e-6, 2**0.5 * 1e-6, 3e-6],
        1e-20,
    )
    holds("winding about a cube", winding(cube, triangles, at), [1, 1, 0, 0, 0, 0], 1e-14)
    holds("about one inside out", winding(cube, triangles[:, [0, 2, 1]], at), [-1, -1, 0, 0, 0, 0], 1e-14)
    holds("a face is a sixth", winding(cube, triangles[:2], np.array([(1, 1, 1.0)])), 1 / 6, 1e-14)
    flat = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0)], float)
    holds("a triangle without area", distances(flat, np.array([(0, 1, 2)]), np.array([(1, 3, 4.0)])), 5, 1e-14)
    holds("a triangle that is a point", distances(flat, np.array([(1, 1, 1)]), np.array([(1, 3, 4.0)])), 5, 1e-14)
    holds(
        "beside a triangle", distances(flat, np.array([(0, 2, 3)]), np.array([(1, 3, 0.0), (1, 0.5, 2)])), [2, 2], 1e-14
    )

    def volume(what, part, wanted):
        v, error = inside_volume(*array(part))
        holds("volume of " + what, v, wanted, 4 * error + 1e-3 * wanted)
        if error > 0.02 * wanted:
            bad.append(f"volume of {what}: known to {error} of {wanted} only")

    volume("a cube", (cube, triangles), 8)
    volume("two that overlap", joined(box((0, 0, 0), (2, 2, 2)), box((1, 1, 1), (3, 3, 3))), 15)
    volume("one in another", joined(box((0, 0, 0), (2, 2, 2)), box((0.5,) * 3, (1,) * 3)), 8)
    volume("a cavity", joined(box((0, 0, 0), (2, 2, 2)), turned(box((0.5,) * 3, (1,) * 3))), 7.875)
    volume("one inside out", turned(box((0, 0, 0), (2, 2, 2))), 8)
    points, triangles = large(random.Random(1), 20_000)
    signed = (
        np.einsum("ij,ij->i", points[triangles[:, 0]], np.cross(points[triangles[:, 1]], points[triangles[:, 2]])).sum()
        / 6
    )
    volume("20,000 triangles", (points, triangles), signed)
    tets = np.array([(0, 1, 2, 4), (0, 2, 1, 4)])
    holds("volumes of tetrahedra", signed_volumes(cube, tets), [8 / 6, -8 / 6], 1e-14)
    with tempfile.TemporaryDirectory() as work:
        write_ply(f"{work}/a.ply", points, triangles)
        p, t = read_ply(f"{work}/a.ply")
        holds("points of a .ply", p, points.astype(np.float32), 0)
        holds("triangles of a .ply", t, triangles, 0)
        write_tets(f"{work}/a", cube, tets)
        p, t = read_tets(f"{work}/a")
        holds("points of a .node", p, cube, 0)
        holds("tetrahedra of an .ele", t, tets, 0)
    sizes = []
    for number in range(3 * len(KINDS)):
        s, again = surface(7, number, 20_000), surface(7, number, 20_000)
        sizes.append(len(s.triangles))
        holds(f"surface {s.name} again", s.points, again.points, 0)
        if (open_edges(s.truth) == 0) != s.closed or s.triangles.max() >= len(s.points):
            bad.append(f"surface {s.name}: {open_edges(s.truth)} open edges")
    print("\n".join(bad) or f"all right; surfaces of {min(sizes)} to {max(sizes)} triangles")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

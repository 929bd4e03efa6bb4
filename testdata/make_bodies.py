#!/usr/bin/env python3
"""Closed surfaces for the tissue's cases, as STL in mm: python3 make_bodies.py gear|cube WIDTH_MM OUT.stl

The gear has a hub's hole and ten teeth and is 0.19 of its width thick; its hub is in the origin, its base at height 0. The cube begins in
the origin."""
import math
import struct
import sys


def quad(triangles, a, b, c, d):
    triangles.append((a, b, c))
    triangles.append((a, c, d))


def gear(width, teeth=10, steps=120):
    radius, root, thick, hole = 0.5 * width, 0.39 * width, 0.19 * width, 0.125 * width
    outer, inner = [], []
    for i in range(steps):
        a = 2 * math.pi * i / steps
        r = radius if math.cos(teeth * (a - 0.01)) > 0 else root
        outer.append((r * math.cos(a), r * math.sin(a)))
        inner.append((hole * math.cos(a), hole * math.sin(a)))
    triangles = []
    for i in range(steps):
        o, p, q, r = outer[i], outer[(i + 1) % steps], inner[i], inner[(i + 1) % steps]
        quad(triangles, (*o, 0.0), (*p, 0.0), (*p, thick), (*o, thick))
        quad(triangles, (*r, 0.0), (*q, 0.0), (*q, thick), (*r, thick))
        quad(triangles, (*o, thick), (*p, thick), (*r, thick), (*q, thick))
        quad(triangles, (*p, 0.0), (*o, 0.0), (*q, 0.0), (*r, 0.0))
    return triangles


def cube(width):
    triangles = []
    for axis in range(3):
        for high in (0.0, width):
            corners = []
            for u, v in ((0, 0), (width, 0), (width, width), (0, width)):
                p = [0.0, 0.0, 0.0]
                p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = high, float(u), float(v)
                corners.append(tuple(p))
            quad(triangles, *(corners if high else corners[::-1]))
    return triangles


def main():
    what, width, path = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    triangles = {"gear": gear, "cube": cube}[what](width)
    with open(path, "wb") as f:
        f.write(f"{what} of osteotome's testdata, mm".encode().ljust(80, b"\0") + struct.pack("<I", len(triangles)))
        for t in triangles:
            f.write(struct.pack("<3f", 0, 0, 0))
            for p in t:
                f.write(struct.pack("<3f", *p))
            f.write(b"\0\0")


if __name__ == "__main__":
    main()

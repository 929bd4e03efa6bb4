#!/usr/bin/env python3
"""A gear 100 mm wide, 19 mm thick, with a hub's hole and ten teeth, as STL: python3 make_gear.py gear.stl"""
import math
import struct
import sys


def gear(radius=50.0, root=39.0, thick=19.0, hole=12.5, teeth=10, steps=120):
    outer, inner = [], []
    for i in range(steps):
        a = 2 * math.pi * i / steps
        r = radius if math.cos(teeth * (a - 0.01)) > 0 else root
        outer.append((r * math.cos(a), r * math.sin(a)))
        inner.append((hole * math.cos(a), hole * math.sin(a)))
    triangles = []

    def quad(a, b, c, d):
        triangles.append((a, b, c))
        triangles.append((a, c, d))

    for i in range(steps):
        o, p, q, r = outer[i], outer[(i + 1) % steps], inner[i], inner[(i + 1) % steps]
        quad((*o, 0.0), (*p, 0.0), (*p, thick), (*o, thick))
        quad((*r, 0.0), (*q, 0.0), (*q, thick), (*r, thick))
        quad((*o, thick), (*p, thick), (*r, thick), (*q, thick))
        quad((*p, 0.0), (*o, 0.0), (*q, 0.0), (*r, 0.0))
    return triangles


def main():
    triangles = gear()
    with open(sys.argv[1], "wb") as f:
        f.write(b"gear of osteotome's testdata, mm".ljust(80, b"\0") + struct.pack("<I", len(triangles)))
        for t in triangles:
            f.write(struct.pack("<3f", 0, 0, 0))
            for p in t:
                f.write(struct.pack("<3f", *p))
            f.write(b"\0\0")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Cutting guides judged by manifold3d and trimesh: guides_reference.py FOLDER, as OSTEO_GUIDES_OUT=FOLDER has it.

Manifold by both; least gap to the bone; and with the guide lifted along its approach step by step, what it has in
common with the bone. pip install manifold3d trimesh scipy
"""

import pathlib
import sys

import manifold3d
import numpy as np
import trimesh


def solid(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    points = np.array([r[1:] for r in rows if r[0] == "v"], np.float32)
    triangles = np.array([r[1:] for r in rows if r[0] == "f"], np.uint32) - 1
    mesh = trimesh.Trimesh(points, triangles.astype(int), process=True)  # joins equal points, as readers of STL do
    made = manifold3d.Manifold(manifold3d.Mesh(points, triangles))
    return made, mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, mesh.body_count


guides = sorted(pathlib.Path(sys.argv[1]).glob("* guide.obj"))
good, gaps = 0, []
for path in guides:
    guide, trimesh_likes, bodies = solid(path)
    bone, _, _ = solid(path.with_name(path.name.replace("guide.obj", "bone.obj")))
    approach = np.array(path.with_name(path.name.replace("guide.obj", "approach.txt")).read_text().split(), float)
    manifold = guide.status() == manifold3d.Error.NoError and guide.volume() > 0
    common = max((guide.translate(tuple(approach * mm)) ^ bone).volume() for mm in (0, 0.05, 0.2, 0.5, 1, 2, 4, 8, 16))
    gap = guide.min_gap(bone, 1)
    ok = manifold and trimesh_likes and bodies == 1 and common == 0 and abs(gap - 0.1) <= 0.02
    good += ok
    gaps.append(gap)
    if not ok:
        print(path.name, "manifold3d", manifold, "trimesh", trimesh_likes, bodies, "common mm3", common, "gap", gap)
print(good, "of", len(guides), "guides; gap", min(gaps), "to", max(gaps), "mm")
sys.exit(good != len(guides))

#!/usr/bin/env python3
"""Makes the pictures of docs/validation/tissue.md: the thesis' cube, soft tissue on the phantom's bone pressed and cut, and a flap that a second hand holds aside.

usage: build/peers/bin/python3 docs/images/make_tissue.py build/release/bin
"""

import json, math, pathlib, struct, subprocess, sys, tempfile

from PIL import Image

bin_dir = pathlib.Path(sys.argv[1]).resolve()
here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
work = pathlib.Path(tempfile.mkdtemp())


def osteo(*args):
    subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work)


def small(path, name, width):
    picture = Image.open(path).convert("RGB")
    picture.resize((width, picture.height * width // picture.width), Image.LANCZOS).save(here / name, optimize=True)


(work / "cube").mkdir()
osteo(
    "run",
    root / "pipelines/thesis-cube.json",
    "--set",
    f"surface={root}/testdata/cube.stl",
    "--set",
    f"problem={root}/pipelines/tissue/two-materials.json",
    "--set",
    "out=cube",
)
small(work / "cube/map.png", "tissue-map.png", 620)
(here / "tissue-course.svg").write_text((work / "cube/nonhomogeneous.svg").read_text())

# A lens of tissue that has grown on the outside of the temporal bone.
centre, radii, around, up = (68.5, 37.6, -39.9), (5, 9, 9), 72, 48


def point(i, j):
    t, a = math.pi * j / up, 2 * math.pi * i / around
    return (
        centre[0] + radii[0] * math.cos(t),
        centre[1] + radii[1] * math.sin(t) * math.cos(a),
        centre[2] + radii[2] * math.sin(t) * math.sin(a),
    )


def write_stl(path, triangles):
    with open(path, "wb") as f:
        f.write(bytes(80) + struct.pack("<I", len(triangles)))
        for t in triangles:
            f.write(struct.pack("<12f", 0, 0, 0, *t[0], *t[1], *t[2]) + bytes(2))


triangles = []
for i in range(around):
    for j in range(up):
        a, b, c, d = point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)
        triangles += [(a, b, c)] if j == 0 else [(a, c, d)] if j == up - 1 else [(a, b, c), (a, c, d)]
write_stl(work / "lens.stl", triangles)
osteo("phantom", "ct.nrrd", "--region", "temporal", "--spacing-mm", 0.7)
osteo("prepare", "ct.nrrd", "-o", "case")
osteo("tetrahedralize", "lens.stl", "case/tissue.vtu", "--method", "grid", "--spacing-mm", 1.5)
osteo("convert", "lens.stl", "case/tissue.ply")
(work / "case/tissue.json").write_text(
    json.dumps(
        {
            "osteotome_tissue": 1,
            "material": {"young_kpa": 20, "poisson": 0.45},
            "fixed": [{"box_mm": [[50, 20, -60], [65.5, 60, -20]]}],
        }
    )
)
camera = {"centre_mm": [68.5, 38, -40], "radius_mm": 16, "eye": [0.9, -0.35, 0.3]}


def strokes(name, kind, diameter_mm, *points, case="case", axis=(0.75, 0.5, 0.43), camera=camera, hands=()):
    way = [{"t_s": t, "at_mm": [x, y, z], "drill": drill} for t, x, y, z, drill in points]
    (work / f"{name}.json").write_text(
        json.dumps(
            {
                "osteotome_strokes": 1,
                "burr": {"kind": kind, "diameter_mm": diameter_mm},
                "axis": axis,
                "camera": camera,
                "waypoints": way,
                "hands": list(hands),
            }
        )
    )
    osteo("rehearse", case, "--headless", "--fast", "--script", f"{name}.json", "-o", name)


strokes(
    "press", "diamond", 6.0, (0, 79, 37.6, -39.9, False), (1, 74.5, 37.6, -39.9, False), (1.5, 74.5, 37.6, -39.9, False)
)
strokes(
    "cut",
    "cutting",
    4.0,
    (0, 78, 37.6, -39.9, False),
    (0.5, 74, 36, -44, True),
    (2, 71, 36, -44, True),
    (4, 71, 38, -36, True),
    (6, 69, 38, -36, True),
    (8, 69, 36, -44, True),
    (8.5, 80, 38, -40, False),
)


def side_by_side(name, *paths):
    pictures = [Image.open(work / p).convert("RGB") for p in paths]
    wide = Image.new("RGB", (sum(p.width for p in pictures), pictures[0].height))
    for n, p in enumerate(pictures):
        wide.paste(p, (n * p.width, 0))
    wide.resize((1260, wide.height * 1260 // wide.width), Image.LANCZOS).save(here / name, optimize=True)


side_by_side("tissue-scene.png", "press/before.png", "press/after.png", "cut/after.png")

# Two bodies: a muscle at the tip of the mastoid, and a flap of skin over it, held at its upper edge.
flap_lo, flap_hi = (66.5, 9, -39), (69.5, 24, -18)
corner = [tuple((flap_hi if n >> a & 1 else flap_lo)[a] for a in range(3)) for n in range(8)]
sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
write_stl(work / "flap.stl", [tuple(corner[n] for n in t) for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
write_stl(
    work / "muscle.stl",
    [
        tuple(tuple(m + (x - c) * s for x, c, m, s in zip(p, centre, (60, 14, -48), (1.2, 0.67, 0.78))) for p in t)
        for t in triangles
    ],
)
osteo("prepare", "ct.nrrd", "-o", "two")
for body, surface, young_kpa, fixed in (
    ("skin flap", "flap.stl", 30, [{"box_mm": [[60, 0, -19.6], [80, 60, -10]]}]),
    ("muscle", "muscle.stl", 20, []),
):
    folder = work / "two/tissue" / body
    folder.mkdir(parents=True)
    osteo("tetrahedralize", surface, folder / "tissue.vtu", "--method", "grid", "--spacing-mm", 1.5)
    (folder / "tissue.json").write_text(
        json.dumps({"osteotome_tissue": 1, "material": {"young_kpa": young_kpa, "poisson": 0.45}, "fixed": fixed})
    )
osteo("convert", "muscle.stl", work / "two/tissue/muscle/tissue.ply")
sucker = {
    "instrument": "suction tube 12 Fr",
    "axis": [0.1, 0.1, -0.98],
    "waypoints": [
        {"t_s": t, "at_mm": at}
        for t, at in (
            (0, [64.8, 17, -45]),
            (0.5, [65.2, 17, -40]),
            (1, [70, 17, -37.5]),
            (2, [80, 17, -28]),
            (7.5, [80, 17, -28]),
        )
    ],
}
for name, hands in (("alone", ()), ("held", (sucker,))):
    strokes(
        name,
        "cutting",
        4.0,
        (0, 84, 17, -32, True),
        (2.2, 84, 17, -32, True),
        (3, 67, 17, -32, True),
        (4, 63.5, 17, -32, True),
        (7, 62.5, 15, -30, True),
        (7.5, 76, 17, -40, False),
        case="two",
        axis=(0.85, 0.2, 0.3),
        hands=hands,
        camera={"centre_mm": [66, 17, -33], "radius_mm": 21, "eye": [0.8, -0.5, -0.25]},
    )
side_by_side("tissue-hands.png", "held/before.png", "alone/after.png", "held/after.png")

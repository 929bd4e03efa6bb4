#!/usr/bin/env python3
"""A case out to 3D Slicer and back. Slicer itself is not at hand: what it writes is written here from the published description of its
format (slicer.readthedocs.io, developer guide, "Segmentations"), by code that shares nothing with ours: another order of fields, cropped
extents, other label values and order of segments, layers that overlap, RAS, an oversampled lattice, and files without marks.

usage: check_slicer.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) without numpy; reads our files with slicerio too where it is at hand
"""

import gzip, json, pathlib, shutil, subprocess, sys

try:
    import numpy as np
except ImportError as e:
    print(f"skipped: {e}")
    sys.exit(77)

bin_dir, _, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, code=0):
    r = subprocess.run([bin_dir / "osteo", *map(str, args)], cwd=work, capture_output=True, text=True)
    assert r.returncode == code, f"{args}: exit code {r.returncode}, wanted {code}\n{r.stdout}{r.stderr}"
    return r.stdout + r.stderr


def read(path):
    """Fields, keys and values[k, j, i] (or [k, j, i, layer]) of an NRRD."""
    raw = path.read_bytes()
    head, _, body = raw.partition(b"\n\n")
    fields, keys = {}, {}
    for line in head.decode().splitlines()[1:]:
        if line.startswith("#"):
            continue
        if (
            ":=" in line.split(": ")[0] + ":="
            and ":=" in line
            and (": " not in line or line.index(":=") < line.index(": "))
        ):
            k, v = line.split(":=", 1)
            keys[k] = v
        else:
            k, v = line.split(": ", 1)
            fields[k] = v
    sizes = [int(n) for n in fields["sizes"].split()]
    kind = {"uint8": np.uint8, "int16": np.int16}[fields["type"]]
    return fields, keys, np.frombuffer(gzip.decompress(body), kind).reshape(sizes[::-1])


def vectors(text):
    return [np.array([float(n) for n in v.strip("()").split(",")]) for v in text.split()]


class Seg:
    def __init__(self, name, mask, tags="", colour="0.5 0.5 0.5", id=None):
        self.name, self.mask, self.tags, self.colour, self.id = name, mask, tags, colour, id or f"Segment_{name}"


def segments_of(path):
    fields, keys, values = read(path)
    out = []
    n = 0
    while f"Segment{n}_Name" in keys:
        k = f"Segment{n}_"
        out.append(
            Seg(
                keys[k + "Name"],
                values == int(keys[k + "LabelValue"]),
                keys[k + "Tags"],
                keys[k + "Color"],
                keys[k + "ID"],
            )
        )
        n += 1
    return out, vectors(fields["space origin"])[0], vectors(fields["space directions"])


def write(
    path, segments, origin, directions, ras=False, crop=True, layers=None, labels=None, old=False, start=(0, 0, 0)
):
    """As Slicer writes: cropped to what is there, compressed, keys in the order of the alphabet after the fields."""
    shape = segments[0].mask.shape
    lo, hi = np.zeros(3, int), np.array(shape)
    used = np.any([s.mask for s in segments], axis=0)
    if crop and used.any():
        at = np.argwhere(used)
        lo, hi = at.min(0), at.max(0) + 1
    box = tuple(slice(a, b) for a, b in zip(lo, hi))
    origin = origin + sum(d * float(n) for d, n in zip(directions, lo[::-1]))
    layers = layers or [0] * len(segments)
    labels = labels or list(range(1, len(segments) + 1))
    count = max(layers) + 1
    values = np.zeros((*(hi - lo), count), np.uint8)
    for s, layer, label in zip(segments, layers, labels):
        values[..., layer][s.mask[box]] = label
    turn = np.array([-1, -1, 1]) if ras else np.ones(3)
    text = lambda v: "(" + ",".join(repr(float(x)) for x in v * turn) + ")"
    nx, ny, nz = (hi - lo)[::-1]
    head = [
        "NRRD0004",
        "# Complete NRRD file format specification at:",
        "# http://teem.sourceforge.net/nrrd/format.html",
        "type: unsigned char",
    ]
    if count > 1:
        head += [
            "dimension: 4",
            f"space: {'right-anterior-superior' if ras else 'left-posterior-superior'}",
            f"sizes: {count} {nx} {ny} {nz}",
            "space directions: none " + " ".join(map(text, directions)),
            "kinds: list domain domain domain",
        ]
    else:
        head += [
            "dimension: 3",
            f"space: {'right-anterior-superior' if ras else 'left-posterior-superior'}",
            f"sizes: {nx} {ny} {nz}",
            "space directions: " + " ".join(map(text, directions)),
            "kinds: domain domain domain",
        ]
    head += ["encoding: gzip", "space origin: " + text(origin)]
    keys = {}
    for n, (s, layer, label) in enumerate(zip(segments, layers, labels)):
        at = np.argwhere(s.mask[box])
        extent = [0, -1] * 3 if not len(at) else [v for a in (2, 1, 0) for v in (at[:, a].min(), at[:, a].max())]
        k = f"Segment{n}_"
        keys |= {
            k + "Color": s.colour,
            k + "ColorAutoGenerated": "1",
            k + "Extent": " ".join(map(str, extent)),
            k + "ID": s.id,
            k + "Name": s.name,
            k + "NameAutoGenerated": "0",
            k + "Tags": s.tags,
        }
        if not old:
            keys |= {k + "LabelValue": str(label), k + "Layer": str(layer)}
    keys |= {
        "Segmentation_ContainedRepresentationNames": "Binary labelmap|Closed surface|",
        "Segmentation_ConversionParameters": "Decimation factor|0.0|Desired reduction&Smoothing factor|0.5|More smooth&",
        "Segmentation_MasterRepresentation": "Binary labelmap",
        "Segmentation_ReferenceImageExtentOffset": " ".join(map(str, np.array(lo[::-1]) + start)),
    }
    head += [f"{k}:={v}" for k, v in sorted(keys.items())]
    path.write_bytes("\n".join(head).encode() + b"\n\n" + gzip.compress(values.tobytes(), 6))


def changes(text):
    return {c["name"] or c["was"]: c for c in json.loads(text[text.index("{") : text.rindex("}") + 1])["structures"]}


def back(folder, *flags, code=0):
    return osteo("import-slicer", "CASE", folder, "--check", "--json", *flags, code=code)


# Out.
osteo("phantom", "ct.nrrd", "--labels-out", "labels.nrrd", "--region", "temporal", "--spacing-mm", 2, "--quiet")
osteo(
    "prepare",
    "ct.nrrd",
    "-o",
    "CASE",
    "--structures",
    "labels.nrrd",
    "--names",
    "3=sigmoid sinus, 4=labyrinth, 7=dura: upper|part",
    "--quiet",
)
osteo("export-slicer", "CASE", "OUT", "--quiet")
bone, origin, directions = segments_of(work / "OUT/bone.seg.nrrd")
parts, origin2, _ = segments_of(work / "OUT/structures.seg.nrrd")
names = [s.name for s in parts]
assert [s.name for s in bone] == ["bone"] and len(parts) == 3 and np.allclose(origin, origin2), names
assert all(
    "|" in s.tags and all(":" in t for t in s.tags.strip("|").split("|")) for s in bone + parts
), "tags that Slicer cannot read"
fields, _, ct = read(work / "OUT/ct.nrrd")
assert fields["space"] == "left-posterior-superior" and np.allclose(vectors(fields["space origin"])[0], origin)
try:
    import slicerio

    seen = slicerio.read_segmentation(str(work / "OUT/structures.seg.nrrd"))
    assert [s["name"] for s in seen["segments"]] == names, "slicerio reads other names"
    print("ok  slicerio reads what goes out")
except ImportError:
    print("slicerio is not at hand: our own reader of the format alone has read what goes out")

# Back as it was.
assert "nothing changed" in osteo("import-slicer", "CASE", "OUT")
forms = {
    "cropped, renumbered, turned round": dict(labels=[9, 200, 31]),
    "RAS": dict(ras=True),
    "three layers": dict(layers=[0, 1, 2], labels=[1, 1, 1]),
    "layers shared by two": dict(layers=[1, 0, 1], labels=[5, 1, 6], ras=True),
    "whole extent": dict(crop=False),
    "a file of an old Slicer, without layers and labels": dict(layers=[0, 1, 2], labels=[1, 1, 1], old=True),
    "an extent that begins below 0": dict(start=(-7, 3, 0)),
}
for name, how in forms.items():
    folder = work / "again"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write(folder / "Segmentation.seg.nrrd", parts[::-1], origin, directions, **how)
    write(folder / "bone.seg.nrrd", bone, origin, directions, ras=how.get("ras", False))
    said = changes(back(folder))
    assert len(said) == 4 and all(
        c["added_mm3"] == c["removed_mm3"] == 0 and c["name"] == c["was"] for c in said.values()
    ), (name, said)
    print(f"ok  {name}: all four come back as they were")

# Edited: bone with a hole drilled and a lump added, one structure renamed and grown, one gone, one new, all in one file, overlapping.
voxel = 8.0
edited = bone[0].mask.copy()
at = np.argwhere(edited)
hole = tuple(at[len(at) // 2])
edited[hole[0] - 1 : hole[0] + 2, hole[1] - 1 : hole[1] + 2, hole[2] - 1 : hole[2] + 2] = False
free = np.argwhere(~bone[0].mask)[1000]
edited[tuple(free)] = True
lost, won = int((bone[0].mask & ~edited).sum()), int((edited & ~bone[0].mask).sum())
grown = parts[0].mask.copy()
grown[:, :, 1:] |= parts[0].mask[:, :, :-1]
new = np.zeros_like(grown)
new[5:9, 5:8, 5:7] = True
folder = work / "edited"
folder.mkdir()
segments = [
    Seg("tumour", new, "Segmentation.Status:completed|"),
    Seg("sinus", grown, parts[0].tags),
    parts[1],
    Seg("bone", edited, bone[0].tags),
]
write(folder / "all.seg.nrrd", segments, origin, directions, layers=[0, 1, 2, 3], labels=[1, 1, 1, 1])
before = (work / "CASE/manifest.json").read_text()
said = changes(back(folder))
assert (
    abs(said["bone"]["added_mm3"] - won * voxel) < 1e-6 and abs(said["bone"]["removed_mm3"] - lost * voxel) < 1e-6
), said["bone"]
assert said["sinus"]["was"] == "sigmoid sinus" and abs(said["sinus"]["after_mm3"] - grown.sum() * voxel) < 1e-6, said[
    "sinus"
]
assert said["tumour"]["was"] == "" and abs(said["tumour"]["after_mm3"] - 24 * voxel) < 1e-6
gone = [c for c in said.values() if not c["name"]]
assert len(gone) == 1 and gone[0]["after_mm3"] == 0, said
assert before == (work / "CASE/manifest.json").read_text()
assert "left out" not in osteo("import-slicer", "CASE", folder)  # the report has its cuts, with the corrected bone
after, _, _ = segments_of(work / "CASE/structures.seg.nrrd")
assert sorted(s.name for s in after) == sorted(["tumour", "sinus", parts[1].name]), [s.name for s in after]
osteo("export-slicer", "CASE", "OUT2", "--quiet")
again, _, _ = segments_of(work / "OUT2/bone.seg.nrrd")
assert np.array_equal(again[0].mask, edited), "the corrected bone is not what goes out the next time"
assert "nothing changed" in osteo("import-slicer", "CASE", "OUT2")
osteo("prepare", "-o", "CASE", "--spacing-mm", 1, "--quiet")  # keeps the correction
osteo("export-slicer", "CASE", "OUT3", "--quiet")
assert np.array_equal(segments_of(work / "OUT3/bone.seg.nrrd")[0][0].mask, edited)
text = (work / "CASE/corrected-pipeline.json").read_text()
assert str(work) not in text, "the case holds the name of its folder"
(work / "CASE").rename(work / "MOVED")  # a case may be moved
osteo("export-slicer", "MOVED", "OUT-MOVED", "--quiet")
assert np.array_equal(segments_of(work / "OUT-MOVED/bone.seg.nrrd")[0][0].mask, edited)
osteo("prepare", "-o", "MOVED", "--spacing-mm", 1.5, "--quiet")
(work / "MOVED").rename(work / "CASE")
osteo("prepare", "-o", "CASE", "--no-pipeline", "--quiet")  # back to the threshold
osteo("export-slicer", "CASE", "OUT4", "--quiet")
assert np.array_equal(segments_of(work / "OUT4/bone.seg.nrrd")[0][0].mask, bone[0].mask)
print("ok  edited bone and structures are in the case, stay there, and go again when asked")

# A finer lattice, as of Slicer's oversampling.
folder = work / "fine"
folder.mkdir()
fine = Seg("bone", bone[0].mask.repeat(2, 0).repeat(2, 1).repeat(2, 2), bone[0].tags)
write(folder / "bone.seg.nrrd", [fine], origin - sum(directions) / 4, [d / 2 for d in directions])
text = back(folder)
assert "other voxels" in text and changes(text)["bone"]["removed_mm3"] == changes(text)["bone"]["added_mm3"] == 0, text
print("ok  an oversampled segmentation comes back to the voxel, and it is said")


# What is refused, each for its reason.
def refused(reason, segments, *flags, ct_file=None, code=4, shift=(0, 0, 0)):
    folder = work / "refused"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    if segments:
        write(
            folder / "s.seg.nrrd",
            segments,
            origin + np.array(shift),
            directions,
            layers=list(range(len(segments))),
            labels=[1] * len(segments),
        )
    if ct_file:
        shutil.copy(ct_file, folder / "ct.nrrd")
    text = osteo("import-slicer", "CASE", folder, *flags, code=code)
    assert reason in text, text
    print(f"ok  refused: {reason}")


osteo("phantom", "other.nrrd", "--region", "temporal", "--spacing-mm", 2, "--seed", 77, "--quiet")
osteo("prepare", "other.nrrd", "-o", "OTHER", "--quiet")
osteo("export-slicer", "OTHER", "OUT-OTHER", "--quiet")
manifest = (work / "CASE/manifest.json").read_bytes()
foreign, _, _ = segments_of(work / "OUT-OTHER/bone.seg.nrrd")
bare = Seg("bone", edited)
refused("another scan than that of the case", foreign)
refused("another scan than that of the case", [bone[0], Seg("nerve", new, foreign[0].tags)])
refused("bear no mark", [bare])
refused("holds other voxels", [bare], ct_file=work / "OUT-OTHER/ct.nrrd")
refused("moved, mirrored", [Seg("bone", bone[0].mask[:, :, ::-1], bone[0].tags)])
refused("lies outside the scan", [Seg("nerve", new, parts[0].tags)], shift=(900, 0, 0))
refused("two segments 'bone'", [bone[0], bone[0]])
refused("is empty", [Seg("bone", np.zeros_like(edited), bone[0].tags), parts[0]])
refused("holds no segmentation", None, code=3)
refused("another scan", [bone[0]], "--source", work / "other.nrrd")
assert (work / "CASE/manifest.json").read_bytes() == manifest, "a refusal has changed the case"

# Without marks: by the CT that lies beside, or by place when asked for.
folder = work / "bare"
folder.mkdir()
write(folder / "bone.seg.nrrd", [bare], origin, directions)
assert changes(back(folder, "--match-by-position"))["bone"]["added_mm3"] == won * voxel
shutil.copy(work / "OUT/ct.nrrd", folder)
assert changes(back(folder))["bone"]["added_mm3"] == won * voxel
print("ok  without a mark: by the CT beside it, or by place when asked for")
osteo("export-slicer", "CASE", "OUT", code=6)
print("ok  what was handed over is never written over")

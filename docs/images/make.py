#!/usr/bin/env python3
"""Makes the pictures of docs/validation/hard-cases.md and docs/guides/imaging.md from the project's own phantom.

usage: build/readers/bin/python3 docs/images/make.py build/release/bin
"""

import pathlib, shutil, subprocess, sys, tempfile

import numpy as np, pydicom, SimpleITK as sitk

bin_dir = pathlib.Path(sys.argv[1]).resolve()
here = pathlib.Path(__file__).resolve().parent
work = pathlib.Path(tempfile.mkdtemp())


def osteo(*args):
    subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work)


def picture(subject, name, *more):
    osteo("snapshot", subject, here / name, "--force", "--width", 760, "--height", 540, "--bone-hu", 500, *more)


def itk(folder, name):
    """What a reader does that stacks slices at one distance: SimpleITK, as it comes."""
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(work / folder)))
    sitk.WriteImage(sitk.Cast(reader.Execute(), sitk.sitkInt16), str(work / name))


def variant(folder, change):
    (work / folder).mkdir()
    for i, f in enumerate(sorted((work / "head").iterdir())):
        d = pydicom.dcmread(f)
        if change(d, i) is not False:
            d.save_as(work / folder / f.name)


osteo("phantom", "ct.nrrd", "--labels-out", "labels.nrrd", "--spacing-mm", 1)
osteo("import", "ct.nrrd", "head")


# Hard cases: what a plain stack of slices shows, and what import shows.
def tilt(d, i):
    # The gantry leans, not the head: each slice sees the head further back, and says so in its position.
    x, y, z = map(float, d.ImagePositionPatient)
    rows = round(0.3346 * z / float(d.PixelSpacing[0]))
    p = np.full_like(d.pixel_array, d.pixel_array.min())
    n = p.shape[0]
    p[max(0, -rows) : n - max(0, rows)] = d.pixel_array[max(0, rows) : n - max(0, -rows)]
    d.PixelData = p.tobytes()
    d.ImagePositionPatient = [x, y + rows * float(d.PixelSpacing[0]), z]


def uneven(d, i):
    return i < 110 or i % 3 == 0


for name, change in (("tilt", tilt), ("uneven", uneven)):
    variant(name, change)
    itk(name, name + "-others.nrrd")
    picture(name + "-others.nrrd", f"hard-{name}-others.png", "--view", "left")
    osteo("import", name, name + ".nrrd")
    picture(name + ".nrrd", f"hard-{name}-ours.png", "--view", "left")

# Thresholds and regions.
ct = sitk.ReadImage(str(work / "ct.nrrd"))
a = sitk.GetArrayFromImage(ct)
z, y, x = np.indices(a.shape)
mm = np.array([ct.TransformIndexToPhysicalPoint((0, 0, 0))[i] for i in range(3)])
wx, wy, wz = x + mm[0], y + mm[1], z + mm[2]
scene = a.copy()
# A head holder behind the head, and a filling with streaks in its slices.
holder = np.abs(np.hypot(wx, wy - wy.max() + 113) - 112) < 1.2
scene[holder & (wy > wy.max() - 45) & (a < -500)] = 700
jaw = np.argwhere(sitk.GetArrayFromImage(sitk.ReadImage(str(work / "labels.nrrd"))) == 4)  # Tissue::mandible
top = jaw[jaw[:, 0] > jaw[:, 0].max() - 4]
tooth = top[np.argmin(top[:, 1] - 0.3 * top[:, 2])]
dz, dy, dx = z - tooth[0], y - tooth[1] - 3, x - tooth[2]
for k in range(8):
    angle = k * np.pi / 8
    ray = np.abs(dx * np.sin(angle) - dy * np.cos(angle)) < 1
    scene[ray & (np.abs(dz) < 3) & (np.hypot(dx, dy) < 45) & (a > -500)] += 650
scene[np.sqrt(dx**2 + dy**2 + dz**2) < 4] = 3500
out = sitk.GetImageFromArray(scene)
out.CopyInformation(ct)
sitk.WriteImage(out, str(work / "scene.nrrd"))
at = ",".join(
    str(round(v, 1))
    for v in ct.TransformContinuousIndexToPhysicalPoint([float(tooth[2]), float(tooth[1]) + 3, float(tooth[0])])
)
osteo("threshold", "scene.nrrd", "plain.nrrd", "--lower", 500)
osteo("threshold", "scene.nrrd", "table.nrrd", "--lower", 500, "--remove-table")
osteo("threshold", "scene.nrrd", "clean.nrrd", "--lower", 500, "--remove-table", "--metal-mm", 50, "--metal-lower", 900)
picture("scene.nrrd", "guide-table-before.png", "--mask", "plain.nrrd", "--view", "left")
picture("scene.nrrd", "guide-table-after.png", "--mask", "table.nrrd", "--view", "left")
picture("scene.nrrd", "guide-metal-before.png", "--mask", "table.nrrd", "--view", "front", "--centre-mm", at)
picture("scene.nrrd", "guide-metal-after.png", "--mask", "clean.nrrd", "--view", "front", "--centre-mm", at)
# There and back: the holder erased outside, as Slicer's segment editor would, in what was handed over.
osteo("prepare", "scene.nrrd", "-o", "case", "--lower", 500, "--spacing-mm", 1)
osteo("export-slicer", "case", "slicer")
mask = sitk.ReadImage(str(work / "slicer/bone.seg.nrrd"))
kept = sitk.GetArrayFromImage(mask)
kept[holder & (wy > wy.max() - 45)] = 0
edited = sitk.GetImageFromArray(kept)
edited.CopyInformation(mask)
for key in mask.GetMetaDataKeys():
    edited.SetMetaData(key, mask.GetMetaData(key))
sitk.WriteImage(edited, str(work / "slicer/bone.seg.nrrd"), useCompression=True)
shutil.copy(work / "case/preview.png", here / "guide-slicer-out.png")
osteo("import-slicer", "case", "slicer")
shutil.copy(work / "case/preview.png", here / "guide-slicer-back.png")

# A refusal with its picture: the same head without its offset.
shifted = sitk.Cast(ct + 1024, sitk.sitkInt16)
sitk.WriteImage(shifted, str(work / "shifted.nrrd"))
subprocess.run([bin_dir / "osteo", "import", "shifted.nrrd", "o.nrrd", "--quiet"], cwd=work)
shutil.copy(work / "o.nrrd.verdict.svg", here / "guide-refused.svg")

for preset in ("cortical", "thin"):
    osteo("threshold", "ct.nrrd", preset + ".nrrd", "--preset", preset)
    osteo(
        "crop",
        "ct.nrrd",
        "ear.nrrd",
        "--region",
        "left_temporal",
        "--labels",
        preset + ".nrrd",
        "--labels-out",
        "ear-mask.nrrd",
        "--force",
    )
    picture("ear.nrrd", f"guide-preset-{preset}.png", "--mask", "ear-mask.nrrd", "--view", "left")

# Structures: the phantom's own labels beside its bone.
osteo("phantom", "ear-ct.nrrd", "--labels-out", "ear-labels.nrrd", "--region", "temporal", "--spacing-mm", 0.6)
labels = sitk.ReadImage(str(work / "ear-labels.nrrd"))
inside = sitk.GetArrayFromImage(labels)
inside[~np.isin(inside, (5, 6, 7))] = 0
only = sitk.GetImageFromArray(inside)
only.CopyInformation(labels)
sitk.WriteImage(only, str(work / "inside.nrrd"))
osteo(
    "structures",
    "inside.nrrd",
    "inside.seg.nrrd",
    "--image",
    "ear-ct.nrrd",
    "--names",
    "5=ossicles, 6=facial nerve, 7=sigmoid sinus",
)
osteo("threshold", "ear-ct.nrrd", "ear-bone.nrrd", "--lower", 500)
osteo("resample", "ear-ct.nrrd", "ear-bone.nrrd", "ear.vdb")
osteo("surface", "ear.vdb", "ear.ply")
picture("ear-ct.nrrd", "guide-structures.png", "--mask", "inside.seg.nrrd", "--surface", "ear.ply", "--view", "left")
# The phantom itself (docs/validation/phantom.md, README).
osteo("phantom", "fine-ear.nrrd", "--region", "temporal", "--spacing-mm", 0.4, "--noise-hu", 5)
osteo(
    "snapshot",
    "fine-ear.nrrd",
    here / "phantom-ear.png",
    "--force",
    "--centre-mm",
    "42.6,3,-15.5",
    "--view",
    "left",
    "--bone-hu",
    500,
)
osteo(
    "snapshot",
    "ct.nrrd",
    here / "phantom-head.png",
    "--force",
    "--centre-mm",
    "50,10,-19",
    "--view",
    "front",
    "--bone-hu",
    500,
)
osteo("snapshot", "ct.nrrd", here / "preview.png", "--force", "--bone-hu", 500)

# A temporal bone's surface as tetrahedra that follow it.
osteo("phantom", "temporal.nrrd", "--region", "temporal", "--spacing-mm", 1.5)
osteo("threshold", "temporal.nrrd", "temporal-mask.nrrd", "--lower", 500)
osteo("resample", "temporal.nrrd", "temporal-mask.nrrd", "temporal.vdb", "--lower", 500, "--spacing-mm", 1)
osteo("surface", "temporal.vdb", "temporal.ply")
osteo("tetrahedralize", "temporal.ply", "temporal.vtu", "--spacing-mm", 2.5)
picture("temporal.vtu", "guide-tetrahedra.png", "--view", "left")

for record in here.glob("*.prov.json"):
    record.unlink()
shutil.rmtree(work)

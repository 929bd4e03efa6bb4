#!/usr/bin/env python3
"""What osteo writes, read back by readers that are not ours: pydicom, highdicom, SimpleITK, nibabel, trimesh, dciodvfy.

usage: check_outputs.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""

import io, json, pathlib, shutil, subprocess, sys

try:
    import highdicom, jsonschema, nibabel, numpy as np, pydicom, SimpleITK as sitk, trimesh
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args):
    subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work)


def same(what, a, b, tolerance):
    difference = np.max(np.abs(np.asarray(a, float) - np.asarray(b, float)))
    assert difference <= tolerance, f"{what}: {a} and {b} differ by {difference}"
    print(f"ok  {what}: off by at most {difference:.2g}")


def world_of(mask, affine):
    """Number and centre of the voxels, in the world of the affine."""
    index = np.argwhere(mask)
    return len(index), affine[:3, :3] @ index.mean(0) + affine[:3, 3]


def itk_mask(path):
    image = sitk.ReadImage(str(path))
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    affine[:3, 3] = image.GetOrigin()
    return sitk.GetArrayFromImage(image).transpose(2, 1, 0), affine


def seg_planes(path):
    """Segment number, position, pixels and orientation of each frame, by pydicom; highdicom must accept the object."""
    highdicom.seg.segread(str(path))
    d = pydicom.dcmread(path)
    shared = d.SharedFunctionalGroupsSequence[0]
    iop = np.array(shared.PlaneOrientationSequence[0].ImageOrientationPatient, float)
    spacing = np.array(shared.PixelMeasuresSequence[0].PixelSpacing, float)
    pixels = d.pixel_array.reshape(-1, d.Rows, d.Columns)
    for frame, picture in zip(d.PerFrameFunctionalGroupsSequence, pixels):
        yield (
            frame.SegmentIdentificationSequence[0].ReferencedSegmentNumber,
            np.array(frame.PlanePositionSequence[0].ImagePositionPatient, float),
            picture,
            iop,
            spacing,
            frame,
        )


def seg_world(path):
    points = []
    for _, position, picture, iop, spacing, _ in seg_planes(path):
        rows, columns = np.nonzero(picture)
        points.append(position + np.outer(columns * spacing[1], iop[:3]) + np.outer(rows * spacing[0], iop[3:]))
    points = np.concatenate(points)
    return len(points), points.mean(0)


def valid_dicom(path):
    checker = shutil.which("dciodvfy")
    if checker is None:
        print("dciodvfy is not installed: the DICOM module check is left out")
        return
    said = subprocess.run([checker, path], capture_output=True, text=True)
    errors = [line for line in (said.stdout + said.stderr).splitlines() if line.startswith("Error")]
    assert not errors, f"{path}: {errors}"
    print(f"ok  {path.name}: dciodvfy finds no error")


# A label map: one mask, every format, one place.
mask, affine = itk_mask(fixtures / "mask.nrrd")
count, centre = world_of(mask, affine)
for name in ("m.seg.nrrd", "m.nii.gz", "m.mha", "m.dcm"):
    osteo("convert", fixtures / "mask.nrrd", name)
for name in ("m.seg.nrrd", "m.mha"):
    n, c = world_of(*itk_mask(work / name))
    assert n == count
    same(name + " in SimpleITK", c, centre, 1e-3)
header = (work / "m.seg.nrrd").read_bytes().split(b"\n\n")[0].decode()
for key in (
    "Segment0_ID:=",
    "Segment0_Name:=",
    "Segment0_LabelValue:=1",
    "Segment0_Layer:=0",
    "Segment0_Extent:=",
    "Segmentation_MasterRepresentation:=",
):
    assert key in header, key
nii = nibabel.load(work / "m.nii.gz")
n, c = world_of(np.asarray(nii.dataobj), nii.affine)
assert n == count
same("m.nii.gz in nibabel (RAS)", c * [-1, -1, 1], centre, 1e-3)
n, c = seg_world(work / "m.dcm")
assert n == count
same("m.dcm (SEG) in highdicom and pydicom", c, centre, 1e-3)
valid_dicom(work / "m.dcm")
osteo("convert", "m.dcm", "back.nrrd")
n, c = world_of(*itk_mask(work / "back.nrrd"))
assert n == count
same("SEG back to NRRD", c, centre, 1e-3)

# A tilted source: sheared by pydicom, segmented in its own frame and on its own slices.
tilted = work / "tilted"
tilted.mkdir()
for i, f in enumerate(sorted((fixtures / "dicom").iterdir())):
    d = pydicom.dcmread(f)
    x, y, z = map(float, d.ImagePositionPatient)
    d.ImagePositionPatient = [x, y + 0.3 * z, z]
    d.PatientName, d.PatientID = "ROENTGEN^ANNA", "PAT-4711"
    d.save_as(tilted / f.name)
osteo("import", "tilted", "tilted.nrrd")
osteo("threshold", "tilted.nrrd", "tmask.nrrd", "--lower", "500")
osteo("convert", "tmask.nrrd", "own.dcm", "--source", "tilted")
osteo("convert", "tmask.nrrd", "onto.dcm", "--source", "tilted", "--onto-source")
source = {d.SOPInstanceUID: d for d in map(pydicom.dcmread, sorted(tilted.iterdir()))}
any_source = next(iter(source.values()))
tmask, taffine = itk_mask(work / "tmask.nrrd")
n, c = seg_world(work / "own.dcm")
assert n == world_of(tmask, taffine)[0]
same("SEG in its own frame after tilt repair", c, world_of(tmask, taffine)[1], 1e-3)
both = missed = 0
for _, position, picture, _, _, frame in seg_planes(work / "onto.dcm"):
    uid = frame.DerivationImageSequence[0].SourceImageSequence[0].ReferencedSOPInstanceUID
    same_slice = source[uid]
    assert np.allclose(
        np.array(same_slice.ImagePositionPatient, float), position, atol=1e-4
    ), "a frame lies elsewhere than its source slice"
    bone = same_slice.pixel_array * float(same_slice.RescaleSlope) + float(same_slice.RescaleIntercept) >= 500
    both += np.sum(bone & (picture > 0))
    missed += np.sum(bone ^ (picture > 0))
assert missed < 0.06 * both, (missed, both)
print(f"ok  SEG on the tilted slices: {100 * missed / both:.1f} % of its voxels differ from thresholding those slices")
for name in ("own.dcm", "onto.dcm"):
    d = pydicom.dcmread(work / name)
    assert d.PatientID == "PAT-4711" and d.StudyInstanceUID == any_source.StudyInstanceUID
    assert (
        d.FrameOfReferenceUID == any_source.FrameOfReferenceUID
        and d.ReferencedSeriesSequence[0].SeriesInstanceUID == any_source.SeriesInstanceUID
    )
    valid_dicom(work / name)

# A surface: the same points everywhere.
assert len(trimesh.load(fixtures / "bone.ply").vertices) == len(
    trimesh.load(fixtures / "bone.ply", process=False).vertices
), "equal points"
reference = trimesh.load(fixtures / "bone.ply", process=False)
for name in ("b.stl", "b.obj", "b.3mf", "b.glb"):
    osteo("convert", fixtures / "bone.ply", name)
    mesh = trimesh.load(work / name, force="mesh", process=False)
    bounds = mesh.bounds
    if name == "b.glb":  # metres; x left, y head, z front
        bounds = np.array([[b[0], -b[2], b[1]] for b in bounds * 1000])
        bounds = np.array([bounds.min(0), bounds.max(0)])
    assert len(mesh.faces) == len(reference.faces)
    same(name + " in trimesh, bounds in mm", bounds, reference.bounds, 2e-3)
    if name != "b.glb":
        same(name + " in trimesh, volume in ml", mesh.volume / 1000, reference.volume / 1000, 0.01)
assert trimesh.load(work / "b.3mf").units in ("millimeter", "mm"), trimesh.load(work / "b.3mf").units
for name, extra in (("b.dcm", ()), ("bs.dcm", ("--source", "tilted"))):
    osteo("convert", fixtures / "bone.ply", name, *extra)
    d = pydicom.dcmread(work / name)
    assert d.SOPClassUID == "1.2.840.10008.5.1.4.1.1.104.3" and d.MIMETypeOfEncapsulatedDocument == "model/stl"
    assert d.MeasurementUnitsCodeSequence[0].CodeValue == "mm"
    inside = trimesh.load(
        io.BytesIO(d.EncapsulatedDocument[: d.EncapsulatedDocumentLength]), file_type="stl", process=False
    )
    same(name + " (encapsulated STL), bounds in mm", inside.bounds, reference.bounds, 1e-5)
    assert (str(d.PatientName) == "ROENTGEN^ANNA") == bool(extra)
    valid_dicom(work / name)

# Pieces: each STL is whole once equal points are joined, which trimesh does as it reads, and encloses what plan.json says the bone measures.
centre = reference.bounds.mean(0)
saws = [
    {"at_mm": [float(c) for c in centre + off], "normal": n, "kerf_mm": 2.2}
    for off, n in ((0, [1, 0.2, 0.1]), ([3, 6, 1], [0.2, 1, 0.3]), ([0, -7, 5], [0.1, 0.4, 1]))
]
actions = [
    {"t_s": 0.2 + 0.5 * i, **a}
    for i, a in enumerate([a for s in saws for a in ({"saw": s}, {"split": {"least_mm3": 0.05}})])
]
at = [float(x) for x in centre + [0, 12, 8]]
script = {
    "osteotome_strokes": 1,
    "burr": {"kind": "cutting", "diameter_mm": 4},
    "axis": [1, 0, 0.2],
    "actions": actions,
    "waypoints": [
        {"t_s": 0, "at_mm": [reference.bounds[1][0] + 9.0, *at[1:]], "drill": False},
        {"t_s": 3.5, "at_mm": at},
    ],
}
(work / "parts.json").write_text(json.dumps(script))
osteo("rehearse", fixtures / "case", "--headless", "--fast", "--script", "parts.json", "-o", "parts")
osteo("export-result", "parts", "-o", "parts-plan")
pieces = json.loads((work / "parts-plan/plan.json").read_text())["fragments"]
assert len(pieces) >= 8, len(pieces)
worst = 0
for piece in pieces:
    path = work / "parts-plan" / piece["file"]
    mesh = trimesh.load(path)
    assert len(mesh.faces) == int.from_bytes(path.read_bytes()[80:84], "little"), f"{path.name} lost triangles"
    uses = np.unique(mesh.edges_sorted, axis=0, return_counts=True)[1]
    assert mesh.is_watertight and mesh.is_winding_consistent and (uses == 2).all(), f"{path.name}: {np.bincount(uses)}"
    assert mesh.area_faces.min() > 0
    assert abs(mesh.volume / piece["surface_volume_mm3"] - 1) < 1e-4, (path.name, mesh.volume, piece)
    off = 100 * abs(mesh.volume / piece["volume_mm3"] - 1)
    assert abs(off - abs(piece["surface_volume_off_percent"])) < 0.02, piece
    worst = max(worst, off if piece["volume_mm3"] > 5 else 0)
assert worst < 0.12, worst
print(
    f"ok  {len(pieces)} pieces in STL are closed manifolds in trimesh; those over 5 mm3 enclose their bone within {worst:.3f} %"
)

# A CT: every format, one voxel for voxel place.
ct, ct_affine = itk_mask(fixtures / "ct.nrrd")
for name in ("ct.mha", "ct.nii.gz"):
    osteo("convert", fixtures / "ct.nrrd", name)
same("ct.mha in SimpleITK", itk_mask(work / "ct.mha")[0], ct, 0)
nii = nibabel.load(work / "ct.nii.gz")
flip = np.diag([-1, -1, 1, 1])
same("ct.nii.gz: sform", nii.get_sform(), flip @ ct_affine, 1e-4)
same("ct.nii.gz: qform", nii.get_qform(), flip @ ct_affine, 1e-3)
reader = sitk.ImageSeriesReader()
reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(fixtures / "dicom")))
series = reader.Execute()
same("DICOM series in SimpleITK, origin", series.GetOrigin(), ct_affine[:3, 3], 1e-3)
same("DICOM series in SimpleITK, values", sitk.GetArrayFromImage(series).transpose(2, 1, 0), ct, 0)
# Verdicts have the shape that docs/formats/verdict.schema.json promises.
schema = json.loads((pathlib.Path(__file__).parents[2] / "docs/formats/verdict.schema.json").read_text())
broken = work / "broken"
shutil.copytree(tilted, broken)
for name in ("0010.dcm", "0011.dcm", "0012.dcm"):
    (broken / name).unlink()
subprocess.run([bin_dir / "osteo", "import", "broken", "broken.nrrd", "--quiet"], cwd=work, capture_output=True)
osteo("import", fixtures / "ct.nrrd", "again.nrrd")
for name, status in (("tilted", "repaired"), ("broken", "refused"), ("again", "good")):
    verdict = json.loads((work / (name + ".nrrd.verdict.json")).read_text())
    jsonschema.validate(verdict, schema)
    assert verdict["status"] == status, verdict["findings"]
print("all read back")

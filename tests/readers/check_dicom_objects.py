"""What osteo writes for a PACS, read by pydicom, highdicom and dciodvfy: LABELMAP, algorithms, structured reports.
usage: check_dicom_objects.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""

import json, pathlib, re, shutil, subprocess, sys

try:
    import highdicom as hd, numpy as np, pydicom, SimpleITK as sitk
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

bin_dir, work = (pathlib.Path(a).resolve() for a in (sys.argv[1], sys.argv[3]))
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, code=0):
    r = subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], cwd=work, capture_output=True, text=True)
    assert r.returncode == code, (args, r.returncode, r.stderr)
    return r


def errors_of(path):
    checker = shutil.which("dciodvfy")
    if checker is None:
        print("dciodvfy is not installed: the DICOM module check is left out")
        return []
    said = subprocess.run([checker, path], capture_output=True, text=True)
    return [line for line in (said.stdout + said.stderr).splitlines() if line.startswith("Error")]


def voxels(path):
    return sitk.GetArrayFromImage(sitk.ReadImage(str(work / path)))


# A CT, and structures of two origins: found, and drawn from points.
osteo("phantom", "ct", "--labels-out", "truth.nrrd", "--region", "temporal", "--spacing-mm", "1", "--individual", "1")
osteo("import", "ct", "ct.nrrd")
for f in sorted((work / "ct").iterdir()):  # somebody
    d = pydicom.dcmread(f)
    d.PatientName, d.PatientID, d.StudyID, d.PatientBirthDate = "ROENTGEN^ANNA", "PAT-4711", "S1", "19010101"
    d.save_as(f)
osteo("find-structures", "ct.nrrd", "found.seg.nrrd", "--what", "ear_canal,air_cells")
osteo(
    *("tube", "ct.nrrd", "all.seg.nrrd", "--labels", "found.seg.nrrd", "--name", "sigmoid sinus, größter Teil"),
    *("--points-mm", "53.4,25.9,-15.6; 48,24,-28", "--max-radius-mm", "5"),
)
truth = voxels("all.seg.nrrd")
values = [int(v) for v in np.unique(truth) if v]
assert len(values) == 3, values
# Which version made each, as the file itself says it: what DICOM must say too.
origins = dict(re.findall(rb"Osteotome\.Origin:([a-z-]+), version (\d+)\|", (work / "all.seg.nrrd").read_bytes()))
assert sorted(origins) == [b"find-structures", b"tube"], origins
version_of = {name.decode(): version.decode() for name, version in origins.items()}

# As LABELMAP of 8 and of 16 bits, in its own frame: highdicom sees the same numbers at the same places.
uids = set()
for form, bits in (("labelmap", 8), ("labelmap16", 16), ("binary", 1)):
    name = f"{form}.dcm"
    osteo("convert", "all.seg.nrrd", name, "--source", "ct", "--segmentation", form)
    d = pydicom.dcmread(work / name)
    assert d.BitsAllocated == bits and d.SegmentsOverlap == "NO", (form, d.BitsAllocated)
    assert d.SOPClassUID.endswith("66.4" if bits == 1 else "66.7") and str(d.PatientName) == "ROENTGEN^ANNA"
    uids.add(d.SOPInstanceUID)
    seg = hd.seg.segread(str(work / name))
    assert seg.segmentation_type.value == ("BINARY" if bits == 1 else "LABELMAP")
    numbers = seg.get_segment_numbers()
    assert list(numbers) == (values if bits > 1 else [1, 2, 3]), (numbers, values)
    volume = seg.get_volume(combine_segments=True, relabel=False)
    back = volume.array
    # Place by place: each voxel of highdicom's, where its own affine says it lies.
    itk = sitk.ReadImage(str(work / "all.seg.nrrd"))
    index = np.argwhere(back)
    at = index @ np.asarray(volume.affine)[:3, :3].T + np.asarray(volume.affine)[:3, 3]
    direction = np.array(itk.GetDirection()).reshape(3, 3) * np.array(itk.GetSpacing())
    own = np.rint((at - np.array(itk.GetOrigin())) @ np.linalg.inv(direction).T).astype(int)
    got = back[tuple(index.T)]
    wanted = truth[own[:, 2], own[:, 1], own[:, 0]]
    if bits == 1:
        wanted = np.searchsorted(values, wanted) + 1
    assert np.array_equal(got, wanted) and len(got) == np.count_nonzero(truth), form
    for number in numbers:
        s = seg.get_segment_description(number)
        if s.segment_label.startswith("sigmoid"):
            assert s.segment_label == "sigmoid sinus, größter Teil" and s.algorithm_type.value == "SEMIAUTOMATIC"
            assert (
                s.algorithm_identification.name == "tube" and s.algorithm_identification.version == version_of["tube"]
            )
            assert s.algorithm_identification.family.value == "123106"
        else:
            assert s.algorithm_type.value == "AUTOMATIC" and s.algorithm_identification.name == "find-structures"
            assert s.algorithm_identification.version == version_of["find-structures"]
            assert s.segmented_property_type.scheme_designator == "SCT"
    # Slices refer to the slices of the CT that they lie on.
    per = d.PerFrameFunctionalGroupsSequence
    assert all("DerivationImageSequence" in f for f in per)
    if bits > 1:
        assert not any("SegmentIdentificationSequence" in f for f in per) and len(d.DimensionIndexSequence) == 1
        assert [f.FrameContentSequence[0].DimensionIndexValues for f in per] == list(range(1, len(per) + 1))
    # And back: names, numbers, origins and voxels.
    osteo("convert", name, f"{form}.back.seg.nrrd")
    header = (work / f"{form}.back.seg.nrrd").read_bytes().split(b"\n\n")[0].decode()
    assert f"Osteotome.Origin:tube, version {version_of['tube']}|" in header and "größter Teil" in header, header
    cut = voxels(f"{form}.back.seg.nrrd")
    filled = [k for k in range(truth.shape[0]) if truth[k].any()]
    was = truth[filled[0] : filled[-1] + 1]
    assert np.array_equal(cut, was if bits > 1 else np.where(was > 0, np.searchsorted(values, was) + 1, 0)), form
    found = errors_of(work / name)
    if bits == 1:
        assert not found, found
    else:  # dciodvfy of 2022 does not know the class, nor that its segments may have any numbers
        known = ("Error - SegmentNumber not monotonically", "Error - Information Object Not found")
        assert all(e.startswith(known) for e in found), found
    print(f"ok  {form}: {len(got)} voxels, {bits} bits, numbers {list(numbers)}; back the same")
assert len(uids) == 3, "three objects"
r = osteo("convert", "ct.nrrd", "x.nrrd", "--segmentation", "labelmap", code=2)
assert "label map" in r.stderr

# Nobody's: copies without a person keep the voxels.
(work / "deid-in").mkdir()
shutil.copy(work / "labelmap.dcm", work / "deid-in")
osteo("deidentify", "deid-in", "-o", "deid")
(copy,) = (work / "deid").rglob("*.dcm")
c, d = pydicom.dcmread(copy), pydicom.dcmread(work / "labelmap.dcm")
assert "ROENTGEN" not in str(c.PatientName) and c.PatientIdentityRemoved == "YES"
assert c.PixelData == d.PixelData and c.SOPInstanceUID != d.SOPInstanceUID
assert c.SegmentSequence[1].SegmentLabel == d.SegmentSequence[1].SegmentLabel
hd.seg.segread(str(copy))
print("ok  deidentify: a label map keeps its voxels and names nobody")

# The case's measures as a structured report.
osteo("prepare", "ct", "-o", "case", "--lower", "500", "--spacing-mm", "1", "--structures", "all.seg.nrrd")
osteo("convert", "case/structures.seg.nrrd", "case.seg.dcm", "--source", "ct", "--segmentation", "labelmap")
osteo("convert", "case/structures.seg.nrrd", "case.bin.dcm", "--source", "ct")
osteo("report", "case", "--measures", "plain.dcm")
osteo("report", "case", "--measures", "with.dcm", "--segmentation", "case.seg.dcm")
osteo("report", "case", "--measures", "bin.dcm", "--segmentation", "case.bin.dcm")
manifest = json.loads((work / "case/manifest.json").read_text())
steps = {s["stage"]: s["report"] for s in manifest["steps"]}
case_labels = sitk.ReadImage(str(work / "case/structures.seg.nrrd"))
array, voxel = sitk.GetArrayFromImage(case_labels), float(np.prod(case_labels.GetSpacing()))
volumes = {
    case_labels.GetMetaData(f"Segment{n}_Name"): voxel
    * np.count_nonzero(array == int(case_labels.GetMetaData(f"Segment{n}_LabelValue")))
    for n in range(3)
}
slices = [pydicom.dcmread(f) for f in sorted((work / "ct").iterdir())]
VOLUME = pydicom.sr.coding.Code("118565006", "SCT", "Volume")


def code_value(item):
    concept = item.ConceptNameCodeSequence[0]
    return concept.get("CodeValue") or concept.LongCodeValue


def numbers_of(item, code):
    return [
        float(i.MeasuredValueSequence[0].NumericValue)
        for i in item.ContentSequence
        if i.ValueType == "NUM" and i.ConceptNameCodeSequence[0].CodeValue == code
    ]


for name, seg_file in (("plain.dcm", None), ("with.dcm", "case.seg.dcm"), ("bin.dcm", "case.bin.dcm")):
    # dciodvfy of 2022 takes the label map that is referred to for no segmentation.
    found = [
        e
        for e in errors_of(work / name)
        if name != "with.dcm" or "SOP Class that is not segmentation - attribute <ReferencedSegmentNumber>" not in e
    ]
    assert not found, found
    sr = hd.sr.srread(str(work / name))
    assert isinstance(sr, hd.sr.ComprehensiveSR) and str(sr.PatientName) == "ROENTGEN^ANNA"
    assert sr.StudyInstanceUID == slices[0].StudyInstanceUID and sr.VerificationFlag == "UNVERIFIED"
    report = sr.content
    rois = report.get_volumetric_roi_measurement_groups()
    images = report.get_image_measurement_groups()
    evidence = {
        i.ReferencedSOPInstanceUID
        for study in sr.CurrentRequestedProcedureEvidenceSequence
        for series in study.ReferencedSeriesSequence
        for i in series.ReferencedSOPSequence
    }
    assert {s.SOPInstanceUID for s in slices} <= evidence
    by_name = {g.tracking_identifier: g for g in [*rois, *images]}
    assert set(volumes) <= set(by_name), (set(volumes), set(by_name))
    for structure, mm3 in volumes.items():
        g = by_name[structure]
        (m,) = g.get_measurements(name=VOLUME)
        assert abs(float(m.value) - mm3) < 1e-6 * mm3 and m.unit.value == "mm3", (structure, m.value, mm3)
    if seg_file is None:
        assert not rois and len(images) == 1 + 3 + 3, (len(rois), len(images))
        assert evidence == {s.SOPInstanceUID for s in slices}
    else:
        segmentation = hd.seg.segread(str(work / seg_file))
        assert len(rois) == 3 and len(images) == 1 + 3 and segmentation.SOPInstanceUID in evidence
        for g in rois:
            assert g.referenced_segment is not None and "121232" in [code_value(i) for i in g[0].ContentSequence]
            (item,) = (i for i in g[0].ContentSequence if i.ConceptNameCodeSequence[0].CodeValue == "121191")
            assert item.ReferencedSOPSequence[0].ReferencedSOPInstanceUID == segmentation.SOPInstanceUID
            s = segmentation.get_segment_description(int(item.ReferencedSOPSequence[0].ReferencedSegmentNumber))
            assert s.segment_label == g.tracking_identifier
    bone = next(g for n, g in by_name.items() if n.startswith("Bone of the case"))
    assert numbers_of(bone[0], "bone-threshold") == [steps["threshold"]["lower_hu"]]
    assert abs(numbers_of(bone[0], "118565006")[0] - steps["resample"]["volume_after_mm3"]) < 1e-6
    # Distances: between the nearest voxels, less a voxel.
    for structure in [n for n in by_name if n.startswith("Distance from")]:
        a, b = structure.removeprefix("Distance from ").split(" to ")
        ia, ib = (
            np.argwhere(array == int(case_labels.GetMetaData(f"Segment{list(volumes).index(n)}_LabelValue")))
            for n in (a, b)
        )
        spacing = np.array(case_labels.GetSpacing())[::-1]
        near = min(np.sqrt((((ia - p) * spacing) ** 2).sum(1)).min() for p in ib)
        (mm,) = numbers_of(by_name[structure][0], "121206")
        assert abs(mm - max(0, near - voxel ** (1 / 3))) < 1e-3, (structure, mm, near)
    print(f"ok  {name}: {len(rois)} volumes of segments, {len(images)} other groups; dciodvfy finds no error")
# The score of a rehearsal beside them: every number that the JSON has, of the structure that it is of.
procedures = pathlib.Path(__file__).resolve().parents[2] / "pipelines"
osteo("rehearse", "case", "--headless", "--fast", "--script", procedures / "sessions/mastoid.json", "-o", "session")
procedure = ("--procedure", procedures / "procedures/mastoid-window.json")
scored = json.loads(osteo("score", "session", *procedure, "--json", "--measures", "s.dcm").stdout)
osteo("score", "session", *procedure, "--measures", "s-seg.dcm", "--segmentation", "case.bin.dcm")
for name in ("s.dcm", "s-seg.dcm"):
    assert not errors_of(work / name), errors_of(work / name)
    sr = hd.sr.srread(str(work / name))
    assert str(sr.PatientName) == "ROENTGEN^ANNA" and sr.StudyInstanceUID == slices[0].StudyInstanceUID
    groups = {g.tracking_identifier: g for g in sr.content.get_volumetric_roi_measurement_groups()}
    assert len(groups) == (0 if name == "s.dcm" else 3 + len({v["of"] for v in scored["metrics"]} & set(volumes)))
    groups.update((g.tracking_identifier, g) for g in sr.content.get_image_measurement_groups())
    (rehearsal,) = (n for n in groups if n.startswith("Rehearsal ") and ":" not in n)
    assert "session" not in rehearsal, "nobody's name"
    said = {i.TextValue for c in sr.ContentSequence for i in c.get("ContentSequence", []) if code_value(i) == "121106"}
    checked = absent = 0
    for v in scored["metrics"]:
        g = groups.get(rehearsal + (f": {v['of']}" if v["of"] else ""))
        items = [i for i in g[0].ContentSequence if code_value(i) == v["name"]] if g else []
        if v["value"] is None:
            assert not items and any(n.startswith("Not measured") and v["name"] in n for n in said), v
            absent += 1
        else:
            given = float(items[0].MeasuredValueSequence[0].NumericValue)
            assert len(items) == 1 and abs(given - v["value"]) <= 1e-9 * abs(v["value"]) + 1e-9, (v, given)
            checked += 1
    scale = groups["Scale " + scored["procedure"]]
    verdicts = {
        code_value(i): i.ConceptCodeSequence[0].CodeMeaning for i in scale[0].ContentSequence if i.ValueType == "CODE"
    }
    assert verdicts == {
        f"{i['name']} passed": "Yes" if i["pass"] else "No" for i in scored["items"] if i["pass"] is not None
    }
    assert set(scored["words"]) <= said, said
    print(f"ok  {name}: {checked} numbers of a score, {absent} without a value, {len(verdicts)} verdicts")
r = osteo("score", "session", "--segmentation", "case.bin.dcm", code=2)
assert "--measures" in r.stderr
# The same case, the same object; a segmentation of other voxels is refused.
osteo("report", "case", "--measures", "again.dcm")
assert pydicom.dcmread(work / "again.dcm").SOPInstanceUID == pydicom.dcmread(work / "plain.dcm").SOPInstanceUID
osteo("convert", "found.seg.nrrd", "other.dcm", "--source", "ct")
r = osteo("report", "case", "--measures", "x.dcm", "--segmentation", "other.dcm", code=2)
assert "has no segment" in r.stderr and not (work / "x.dcm").exists()
osteo("convert", "all.seg.nrrd", "nobody.dcm")
r = osteo("report", "case", "--measures", "x.dcm", "--segmentation", "nobody.dcm", code=2)
assert "another study" in r.stderr
r = osteo("report", "case", "--segmentation", "case.seg.dcm", code=2)
assert "--measures" in r.stderr
print("all read back")

#!/usr/bin/env python3
"""No value that identifies a patient may reach an output, a log or a name.

Fills every identifying tag of a series with a value of its own, names folders and files after the patient, runs what imaging staff run,
and searches every byte that came out.    usage: check_privacy.py BIN_DIR FIXTURES WORK_DIR
"""

import gzip, pathlib, re, shutil, subprocess, sys

try:
    import pydicom
    from pydicom.datadict import tag_for_keyword, dictionary_VR
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
source, out = work / "scan", work / "out"
out.mkdir(parents=True)

# The 18 kinds of identifiers of HIPAA 164.514(b)(2), by the tags that carry them, and the UIDs.
values = {
    "PatientName": "Quxley^Zebedee^Marmaduke",
    "PatientID": "MRN7755331",
    "OtherPatientIDs": "ALT9911882",
    "OtherPatientNames": "Vandersnoot^Zeb",
    "PatientBirthName": "Grimblewick",
    "PatientBirthDate": "19370411",
    "PatientMotherBirthName": "Snarkwell",
    "PatientAddress": "42 Wimpole Mews",
    "PatientTelephoneNumbers": "+49 30 5550199",
    "MedicalRecordLocator": "LOC-88431",
    "AccessionNumber": "ACC4471199",
    "StudyID": "STUDY-3319",
    "StudyDate": "20170523",
    "SeriesDate": "20170523",
    "InstitutionName": "Saint Ethelburga",
    "InstitutionAddress": "7 Quincunx Lane",
    "InstitutionalDepartmentName": "Neuroradiology West",
    "ReferringPhysicianName": "Plumtree^Octavia",
    "PerformingPhysicianName": "Hasselblad^Igor",
    "OperatorsName": "Tatterby^Noor",
    "PhysiciansOfRecord": "Underhill^Perpetua",
    "NameOfPhysiciansReadingStudy": "Birdwhistle^Ada",
    "RequestingPhysician": "Crumhorn^Leo",
    "StationName": "CTSUITE77",
    "DeviceSerialNumber": "SN-0048217",
    "PatientComments": "collector of rare stamps",
    "IssuerOfPatientID": "EASTHOSP",
    "SeriesDescription": "Petrous Quxley follow-up",
    "StudyDescription": "Head of Mr Quxley",
    "ProtocolName": "Zebedee protocol",
    "ImageComments": "call Grimblewick",
    "Manufacturer": "Snarkwell Imaging, Wimpole",
    "StudyInstanceUID": "1.2.826.0.1.3680043.77.1001",
    "SeriesInstanceUID": "1.2.826.0.1.3680043.77.2002",
    "FrameOfReferenceUID": "1.2.826.0.1.3680043.77.3003",
}
folder = source / "QUXLEY_ZEBEDEE" / "MRN7755331"
folder.mkdir(parents=True)
needles, files = set(), []
for v in values.values():
    needles.add(v)
    needles.update(
        part
        for part in v.replace("^", " ").split()
        if len(part) >= 5 and part.lower() not in ("petrous", "follow-up", "study", "protocol", "collector", "stamps")
    )
for i, f in enumerate(sorted((fixtures / "dicom").iterdir())):
    d = pydicom.dcmread(f)
    for keyword, v in values.items():
        setattr(d, keyword, v)
    d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = f"1.2.826.0.1.3680043.77.4.{i + 1}"
    needles.add(d.SOPInstanceUID)
    files.append(folder / (f"Zebedee {i:03}.dcm" if i % 2 else f"{d.SOPInstanceUID}.dcm"))
    d.save_as(files[-1])
needles -= {"Head", "rare"}
low = [n.lower().encode() for n in needles]

logs = []


def osteo(*args, code=0):
    r = subprocess.run([bin_dir / "osteo", *map(str, args)], cwd=out, capture_output=True)
    logs.append((" ".join(map(str, args)), r.stdout + r.stderr))
    assert r.returncode == code, (args, r.returncode, r.stderr.decode())


osteo("import", source, "ct.nrrd")
osteo("import", source, "dicom-out", "--progress", "json")
osteo("import", source, "ct.nii.gz", "--series", values["SeriesInstanceUID"])
osteo("import-bone", source, "low.vdb", "--lower", "500", "--spacing-mm", "1")
osteo("prepare", source, "-o", "case", "--lower", "500", "--spacing-mm", "1", "--series", values["SeriesInstanceUID"])
# Out to another program and back, with a little erased there.
osteo("export-slicer", "case", "handed-over")
raw = (out / "handed-over" / "bone.seg.nrrd").read_bytes()
head, body = raw.split(b"\n\n", 1)
voxels = bytearray(gzip.decompress(body))
voxels[voxels.index(1)] = 0
(out / "handed-over" / "bone.seg.nrrd").write_bytes(head + b"\n\n" + gzip.compress(bytes(voxels)))
osteo("import-slicer", "case", "handed-over")
assert (out / "case" / "corrected-pipeline.json").exists()
osteo("approve", "case", "--by", "Reviewer One")
osteo("info", "case")
osteo("suggest-threshold", source)
osteo("import", "--list", source)
osteo("rehearse", "case", "--headless", "--fast", "--seconds", "1", "-o", "session")
osteo("threshold", "ct.nrrd", "mask.nrrd", "--lower", "500")
osteo("convert", "mask.nrrd", "mask.dcm")
osteo("convert", "case/surface.ply", "model.dcm")
# A damaged and a missing slice: warnings and refusals name files.
files[10].write_bytes(files[10].read_bytes()[:3000])
osteo("import", source, "damaged.nrrd")
for f in files[20:26]:
    f.unlink()
osteo("import", source, "refused.nrrd", code=4)
osteo("import", "--list", source)

found = []


def search(where, data):
    for n, needle in zip(needles, low):
        if needle in data.lower():
            found.append(f"{where} holds '{n}'")


searched = 0
for path in out.rglob("*"):
    search(f"the name {path.relative_to(out)}", str(path.relative_to(out)).encode())
    if not path.is_file():
        continue
    data = path.read_bytes()
    if path.suffix == ".html":
        # In millions of letters of pictures any word of five is found by chance.
        data, pictures = re.subn(rb'base64,[A-Za-z0-9+/=]+"', b'"', data)
        assert pictures > 10
    if path.suffix == ".pdf" and shutil.which("pdftotext"):
        said = subprocess.run(["pdftotext", path, "-"], capture_output=True, check=True).stdout
        assert b"Reviewer One" in said
        search(f"the text of {path.relative_to(out)}", said)
    search(path.relative_to(out), data)
    if path.suffix == ".gz":
        search(path.relative_to(out), gzip.decompress(data))
    searched += len(data)
for command, said in logs:
    search(f"what 'osteo {command[:40]}...' said", said)
assert not found, "\n".join(sorted(set(found)))
print(
    f"{len(needles)} identifying values, none in {searched / 1e6:.1f} MB of outputs and {sum(len(s) for _, s in logs)} bytes of messages"
)

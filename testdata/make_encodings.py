# Tiny CTs in the encodings of 2024 to 2026, of the phantom's own pixels: make_encodings.py OSTEO FOLDER
# Takes pydicom 3.0 and imagecodecs 2026.3; their encoders (OpenJPH 0.26, libjxl 0.11) are none that osteo decodes with,
# and imagecodecs' OpenJPEG and libjxl read each picture back here.
import copy, pathlib, subprocess, sys, tempfile, zlib
import imagecodecs, numpy, pydicom
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, RLELossless

osteo, out = sys.argv[1], pathlib.Path(sys.argv[2])
out.mkdir(exist_ok=True)
with tempfile.TemporaryDirectory() as work:
    subprocess.run([osteo, "phantom", work + "/ct", "--region", "temporal", "--spacing-mm", "1", "--quiet"], check=True)
    slices = sorted((pydicom.dcmread(f) for f in pathlib.Path(work, "ct").iterdir()), key=lambda d: float(d.ImagePositionPatient[2]))
middle = len(slices) // 2
slices = slices[middle:middle + 3]
x, y, columns, rows = slices[0].Columns // 2 - 12, slices[0].Rows // 2 - 8, 25, 17
hu = numpy.stack([d.pixel_array[y:y + rows, x:x + columns].astype(int) * int(d.RescaleSlope) + int(d.RescaleIntercept) for d in slices])
unsigned, signed = (hu + 1024).clip(0, 4095).astype("u2"), hu.clip(-1024, 3071).astype("i2")
byte = ((hu + 1024) / 16).clip(0, 255).astype("u1")


def item(**values):
    d = Dataset()
    for k, v in values.items(): setattr(d, k, v)
    return d


def rename(file, uid):
    b = file.read_bytes()
    old, new = (bytes([2, 0, 16, 0]) + b"UI" + len(v).to_bytes(2, "little") + v for v in (RLELossless.encode() + b"\0", uid.encode() + b"\0" * (len(uid) % 2)))
    length = int.from_bytes(b[140:144], "little") + len(new) - len(old)
    file.write_bytes(b[:140] + length.to_bytes(4, "little") + b[144:].replace(old, new, 1))


def write(name, uid, pixels, intercept, encode, bits=12, slope=1):
    d = Dataset()
    for k in ("PatientName", "PatientID", "StudyInstanceUID", "FrameOfReferenceUID", "Modality", "Manufacturer", "StudyDate", "StudyTime"):
        if k in slices[0]: setattr(d, k, slices[0][k].value)
    d.SOPClassUID = "1.2.840.10008.5.1.4.1.1.2.1"
    d.SeriesInstanceUID = pydicom.uid.generate_uid(entropy_srcs=["series", name])
    d.SOPInstanceUID = pydicom.uid.generate_uid(entropy_srcs=["instance", name])
    d.ImageType, d.SeriesNumber, d.InstanceNumber = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"], 1, 1
    d.SamplesPerPixel, d.PhotometricInterpretation, d.NumberOfFrames = 1, "MONOCHROME2", len(pixels)
    d.Rows, d.Columns, d.BitsAllocated, d.BitsStored, d.HighBit = rows, columns, pixels.itemsize * 8, bits, bits - 1
    d.PixelRepresentation = int(pixels.dtype.kind == "i")
    spacing = slices[0].PixelSpacing
    d.SharedFunctionalGroupsSequence = Sequence([item(
        PlaneOrientationSequence=Sequence([item(ImageOrientationPatient=slices[0].ImageOrientationPatient)]),
        PixelMeasuresSequence=Sequence([item(PixelSpacing=spacing, SliceThickness=1)]),
        PixelValueTransformationSequence=Sequence([item(RescaleIntercept=intercept, RescaleSlope=slope, RescaleType="HU")]))])
    d.PerFrameFunctionalGroupsSequence = Sequence([item(
        PlanePositionSequence=Sequence([item(ImagePositionPatient=s.ImagePositionPatient)])) for s in slices])
    d.file_meta = pydicom.dataset.FileMetaDataset()
    # pydicom 3.0 writes no transfer syntax that it does not know: RLE's name stands in.
    known = pydicom.uid.UID(uid).is_transfer_syntax
    d.file_meta.TransferSyntaxUID, d.file_meta.MediaStorageSOPClassUID = uid if known else RLELossless, d.SOPClassUID
    d.file_meta.MediaStorageSOPInstanceUID = d.SOPInstanceUID
    if encode is None:
        d.PixelData = pixels.tobytes() + b"\0" * (pixels.nbytes % 2)
    else:
        d.PixelData = encapsulate([encode(numpy.ascontiguousarray(p)) for p in pixels])
        d["PixelData"].is_undefined_length = True
    d["PixelData"].VR = "OW" if encode is None and pixels.itemsize == 2 else "OB"
    pydicom.dcmwrite(out / f"{name}.dcm", d, enforce_file_format=True)
    if not known: rename(out / f"{name}.dcm", uid)


def deflate(p):
    z = zlib.compressobj(9, zlib.DEFLATED, -15)
    return z.compress(p.tobytes()) + z.flush()


def exact(encode, decode):
    def both(p):
        b = encode(p)
        assert (decode(b) == p).all()
        return b
    return both


htj2k = exact(imagecodecs.htj2k_encode, imagecodecs.jpeg2k_decode)
jxl = exact(lambda p: imagecodecs.jpegxl_encode(p, lossless=True), imagecodecs.jpegxl_decode)
jxl12 = exact(lambda p: imagecodecs.jpegxl_encode(p, lossless=True, bitspersample=12), imagecodecs.jpegxl_decode)
jpeg = lambda p: imagecodecs.jpeg8_encode(p, level=90)
base = "1.2.840.10008.1.2."
write("plain", ExplicitVRLittleEndian, unsigned, -1024, None)
write("plain-8", ExplicitVRLittleEndian, byte, -1024, None, 8, 16)
write("htj2k", base + "4.201", unsigned, -1024, htj2k)
write("htj2k-signed", base + "4.201", signed, 0, htj2k)
write("htj2k-rpcl", base + "4.202", unsigned, -1024, htj2k)
write("htj2k-lossy", base + "4.203", unsigned, -1024, lambda p: imagecodecs.htj2k_encode(p, level=0.00004, reversible=False))
write("jpeg-xl", base + "4.110", unsigned, -1024, jxl)
write("jpeg-xl-12", base + "4.110", unsigned, -1024, jxl12)
write("jpeg-xl-8", base + "4.110", byte, -1024, jxl, 8, 16)
write("jpeg-xl-any", base + "4.112", unsigned, -1024, jxl)
write("jpeg", base + "4.50", byte, -1024, jpeg, 8, 16)
write("jpeg-in-jpeg-xl", base + "4.111", byte, -1024, lambda p: imagecodecs.jpegxl_encode_jpeg(jpeg(p)), 8, 16)
write("deflated", base + "8.1", unsigned, -1024, deflate)
write("deflated-8", base + "8.1", byte, -1024, deflate, 8, 16)
write("encapsulated", base + "1.98", signed, 0, lambda p: p.tobytes())
write("encapsulated-8", base + "1.98", byte, -1024, lambda p: p.tobytes(), 8, 16)
write("unread", base + "4.92", unsigned, -1024, htj2k)

# Segmentations by highdicom 0.28: bits, and label maps of 8 and 16 bits. tests/unit/dicom/encodings_test.cpp knows what
# they hold: in slice 1, 2 and 4 of 6, pixel (i, j) is segment 1 for i < 9, 2 for i > 15, each for j > 2 + slice.
import highdicom as hd
from pydicom.sr.codedict import codes
source = []
for k in range(6):
    d = copy.deepcopy(slices[0])
    d.Rows, d.Columns, d.PixelData = rows, columns, unsigned[0].tobytes()
    d.ImagePositionPatient = [*slices[0].ImagePositionPatient[:2], float(slices[0].ImagePositionPatient[2]) + k]
    d.SOPInstanceUID = pydicom.uid.generate_uid(entropy_srcs=["source", str(k)])
    d.StudyID, d.PatientBirthDate, d.PatientSex, d.AccessionNumber, d.ReferringPhysicianName = "", "", "", "", ""
    source.append(d)
j, i = numpy.mgrid[:rows, :columns]
mask = numpy.stack([((i < 9) + 2 * (i > 15)) * (j > 2 + k) * (k in (1, 2, 4)) for k in range(6)]).astype("u1")
algorithm = hd.AlgorithmIdentificationSequence("made by formula", codes.DCM.ArtificialIntelligence, "1")


def segments(numbers):
    return [hd.seg.SegmentDescription(n, f"part {p + 1}", codes.SCT.AnatomicalStructure, codes.SCT.Bone,
                                      hd.seg.SegmentAlgorithmTypeValues.AUTOMATIC, algorithm) for p, n in enumerate(numbers)]


def segmentation(name, kind, numbers, pixels):
    s = hd.seg.Segmentation(source, pixels, kind, segments(numbers), pydicom.uid.generate_uid(entropy_srcs=["s", name]), 9001,
                            pydicom.uid.generate_uid(entropy_srcs=["i", name]), 1, "Osteotome", "osteo", "0", "0")
    s.save_as(out / f"{name}.dcm")
    return s


segmentation("seg-labelmap-8", "LABELMAP", [1, 2], mask)
wide = segmentation("seg-labelmap-16", "LABELMAP", list(range(1, 301)), numpy.where(mask == 1, 1, numpy.where(mask == 2, 300, 0)).astype("u2"))
# 300 segments are more than a label map of osteo holds; only those that are used stay.
wide.SegmentSequence = pydicom.sequence.Sequence([s for s in wide.SegmentSequence if s.SegmentNumber in (0, 1, 300)])
wide.save_as(out / "seg-labelmap-16.dcm")
segmentation("seg-bits", "BINARY", [1, 2], mask)

# Slices to make hard series from, and the truth about them: what value belongs where in the patient.
import copy, pathlib
import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian

SIZE, COUNT, PIXEL = 256, 24, 0.9
ORIGIN = np.array([-115.2, -115.2, 40.0])


def of_phantom(folder):
    """HU of COUNT slices 1 mm apart out of a real series (a skull phantom), every other pixel; none when it is not at hand."""
    found = []
    for f in sorted(pathlib.Path(folder).iterdir()):
        try:
            d = pydicom.dcmread(f)
            hu = d.pixel_array.astype(np.int32) * int(d.RescaleSlope) + int(d.RescaleIntercept)
            found.append((float(d.ImagePositionPatient[2]), hu))
        except Exception:  # an index file
            continue
    found.sort(key=lambda p: p[0])
    return [np.clip(hu[::2, ::2], -1024, 2047) for _, hu in found[len(found) // 3 :][:COUNT]]


def made_up():
    """A head of ellipses with cells in its bone, no two slices alike."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:SIZE, :SIZE] - SIZE / 2
    cells = rng.uniform(-80, 80, (60, 2)), rng.uniform(2, 7, 60), rng.uniform(0, COUNT, 60)
    slices = []
    for k in range(COUNT):
        a, b = 95 + k * 0.6, 80 + k * 0.5
        r = np.hypot(x / a, y / b)
        hu = np.where(r < 1, 40, -1000)
        hu[(r < 0.97) & (r > 0.86)] = 1200
        hu[np.hypot(x + 40, y - 20) < 20 + k * 0.3] = 900
        for (cx, cy), size, at in zip(*cells):
            hu[np.hypot(x - cx, y - cy) < size * max(0, 1 - abs(k - at) / 6)] = -900
        hu = hu + rng.normal(0, 15, hu.shape)
        slices.append(np.clip(np.rint(hu), -1024, 2047).astype(np.int32))
    return slices


class Slice:
    """A slice and where it lies. `d` is the file that says so, or says something else."""

    def __init__(self, hu, k, uid="1.2.826.0.1.3680043.9.1000.7"):
        self.hu = hu.copy()
        self.measured = np.ones(hu.shape, bool)
        self.position = ORIGIN + [0, 0, k]
        self.row, self.column = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
        self.pixel = np.array([PIXEL, PIXEL])  # along a row, along a column
        d = self.d = Dataset()
        d.SOPClassUID, d.SOPInstanceUID = CTImageStorage, f"{uid}.1.{k + 1}"
        d.StudyInstanceUID, d.SeriesInstanceUID, d.FrameOfReferenceUID = f"{uid}.8", f"{uid}.1", f"{uid}.9"
        d.PatientName, d.PatientID, d.PatientBirthDate, d.PatientSex = "Test^Head", "T1", "", "O"
        d.StudyDate, d.StudyTime, d.StudyID, d.AccessionNumber, d.ReferringPhysicianName = (
            "20200101",
            "120000",
            "1",
            "",
            "",
        )
        d.Modality, d.Manufacturer, d.SeriesDescription = "CT", "TEST", "head"
        d.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
        d.SeriesNumber, d.AcquisitionNumber, d.InstanceNumber = 1, 1, k + 1
        d.SliceThickness, d.KVP, d.ConvolutionKernel = 1, 120, "D"
        d.SamplesPerPixel, d.PhotometricInterpretation = 1, "MONOCHROME2"
        d.RescaleType = "HU"
        store(self)
        say_place(self)


def slices(hu, count=COUNT):
    return [Slice(h, k) for k, h in enumerate(hu[:count])]


def say_place(s):
    d = s.d
    d.ImagePositionPatient = [f"{v:.6f}"[:16] for v in s.position]
    d.ImageOrientationPatient = [f"{v:.9f}" for v in (*s.row, *s.column)]
    d.PixelSpacing = [float(s.pixel[1]), float(s.pixel[0])]


def store(s, words=None, stored=16, high=None, signed=0, intercept=-1024, slope=1, allocated=16):
    """Writes stored words; by default the HU plus 1024. `s.hu` stays the truth."""
    d = s.d
    words = np.rint((s.hu - intercept) / slope) if words is None else words
    kind = {8: np.uint8, 16: np.uint16, 32: np.uint32}[allocated]
    d.PixelData = np.asarray(words).astype(np.int64).astype(kind).tobytes()
    d["PixelData"].VR = "OB" if allocated == 8 else "OW"
    d.Rows, d.Columns = s.hu.shape
    d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = (
        allocated,
        stored,
        stored - 1 if high is None else high,
        signed,
    )
    d.RescaleIntercept, d.RescaleSlope = intercept, slope


def move(s, x=0.0, y=0.0, z=None):
    s.position = s.position + [x, y, 0]
    if z is not None:
        s.position[2] = z
    say_place(s)


def another(s, **tags):
    """Another object with some tags changed."""
    for k, v in tags.items():
        setattr(s.d, k, v)
    s.d.SOPInstanceUID = s.d.SOPInstanceUID + ".7"


def twin(s):
    t = copy.deepcopy(s)
    t.d.SOPInstanceUID = s.d.SOPInstanceUID + ".5"
    return t


def write(d, path, syntax=ExplicitVRLittleEndian):
    """One file; compressed by pydicom's encoders where the syntax asks for it."""
    d = copy.deepcopy(d)
    meta = d.file_meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = d.SOPClassUID, d.SOPInstanceUID
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    if syntax.is_compressed and not syntax.is_deflated:
        d.compress(syntax, generate_instance_uid=False)
    elif syntax.is_little_endian is False:
        words = np.frombuffer(d.PixelData, "<u2").astype(">u2").tobytes()
        d.PixelData = words
        meta.TransferSyntaxUID = syntax
        d.save_as(path, little_endian=False, implicit_vr=False, enforce_file_format=True)
        return
    else:
        meta.TransferSyntaxUID = syntax
    d.save_as(path, enforce_file_format=True)


def enhanced(parts, order, per_frame_scale=False):
    """Slices as the frames of one enhanced CT, in the order given; each frame says its place in its functional groups."""
    first = parts[0].d
    d = copy.deepcopy(first)
    d.SOPClassUID = "1.2.840.10008.5.1.4.1.1.2.1"
    for tag in (
        "ImagePositionPatient",
        "ImageOrientationPatient",
        "PixelSpacing",
        "RescaleIntercept",
        "RescaleSlope",
        "RescaleType",
        "SliceThickness",
    ):
        if tag in d:
            delattr(d, tag)
    d.NumberOfFrames = len(parts)
    d.PixelData = b"".join(parts[k].d.PixelData for k in order)

    def one(**tags):
        item = Dataset()
        for k, v in tags.items():
            setattr(item, k, v)
        return [item]

    def scale(s):
        return one(RescaleIntercept=s.d.RescaleIntercept, RescaleSlope=s.d.RescaleSlope, RescaleType="HU")

    shared = Dataset()
    shared.PixelMeasuresSequence = one(PixelSpacing=first.PixelSpacing, SliceThickness=1)
    shared.PlaneOrientationSequence = one(ImageOrientationPatient=first.ImageOrientationPatient)
    if not per_frame_scale:
        shared.PixelValueTransformationSequence = scale(parts[0])
    d.SharedFunctionalGroupsSequence = [shared]
    frames = []
    for n, k in enumerate(order):
        f = Dataset()
        f.FrameContentSequence = one(StackID="1", InStackPositionNumber=k + 1, DimensionIndexValues=[1, k + 1])
        f.PlanePositionSequence = one(ImagePositionPatient=parts[k].d.ImagePositionPatient)
        if per_frame_scale:
            f.PixelValueTransformationSequence = scale(parts[k])
        frames.append(f)
    d.PerFrameFunctionalGroupsSequence = frames
    return d


def of_folder(folder):
    """The truth of real files, as pydicom reads them one by one."""
    truth = []
    for f in sorted(pathlib.Path(folder).rglob("*")):
        try:
            d = pydicom.dcmread(f)
            hu = d.pixel_array * float(d.RescaleSlope) + float(d.RescaleIntercept)
            position = np.array(d.ImagePositionPatient, float)
        except Exception:  # an index file, a directory
            continue
        s = Slice.__new__(Slice)
        s.hu, s.position, s.d = hu, position, d
        iop = np.array(d.ImageOrientationPatient, float)
        s.row, s.column = iop[:3], iop[3:]
        s.pixel = np.array([float(d.PixelSpacing[1]), float(d.PixelSpacing[0])])
        s.measured = hu > -1200
        truth.append(s)
    return truth

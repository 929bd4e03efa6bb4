# The hard cases as files: what each folder holds, what is right about it, and whether a refusal is.
import copy, io, math, pathlib, shutil, zlib
import imagecodecs
import numpy as np
from pydicom import dcmread
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    ExplicitVRBigEndian,
    JPEG2000Lossless,
    JPEGLSLossless,
    RLELossless,
    SecondaryCaptureImageStorage,
)
from series import COUNT, ORIGIN, Slice, another, enhanced, move, of_folder, say_place, slices, store, twin, write

VOLUME, REFUSE, EITHER = "volume", "refuse", "either"


class Case:
    """`volumes`: each a list of slices in their true places; a reader is right with any of them, but has to say a word (`word`) where it
    leaves something out or fills something in. `want`: whether a volume, a refusal, or either is right."""

    def __init__(self, number, name, want, fill, volumes=(), word=False, nested=False):
        self.number, self.name, self.want, self.fill, self.volumes, self.word = (
            number,
            name,
            want,
            fill,
            list(volumes),
            word,
        )
        self.nested = nested  # the later volumes are parts of the first


def plain(parts, syntax=None):
    def fill(folder):
        for i, s in enumerate(parts):
            write(s.d, folder / f"{i:03}.dcm", *([syntax] if syntax else []))

    return fill


def encoded(parts, uid, encode):
    """Pixels by `encode`. pydicom does not write the name of each of these transfer syntaxes: RLE's stands in until the end."""

    def fill(folder):
        for i, s in enumerate(parts):
            write(s.d, folder / f"{i:03}.dcm")
            d = dcmread(folder / f"{i:03}.dcm")
            d.PixelData = encapsulate([encode(np.ascontiguousarray(d.pixel_array))])
            d["PixelData"].VR, d["PixelData"].is_undefined_length = "OB", True
            d.file_meta.TransferSyntaxUID = RLELossless
            d.save_as(folder / f"{i:03}.dcm")
            b = (folder / f"{i:03}.dcm").read_bytes()
            old, new = (
                bytes([2, 0, 16, 0]) + b"UI" + len(v).to_bytes(2, "little") + v
                for v in (RLELossless.encode() + b"\0", uid.encode() + b"\0" * (len(uid) % 2))
            )
            length = int.from_bytes(b[140:144], "little") + len(new) - len(old)
            (folder / f"{i:03}.dcm").write_bytes(b[:140] + length.to_bytes(4, "little") + b[144:].replace(old, new, 1))

    return fill


def deflate(pixels):
    z = zlib.compressobj(9, zlib.DEFLATED, -15)
    return z.compress(pixels.tobytes()) + z.flush()


def made(hu):
    """All cases that are made from one straight series."""

    def base(count=COUNT):
        return slices(hu, count)

    rng = np.random.default_rng(1)

    def lean(parts, gap, tangent):
        for k, s in enumerate(parts):
            move(s, y=tangent * gap * k, z=ORIGIN[2] + gap * k)
        return parts

    # 2 to 24, where they do not need the real files.
    s = lean(base(), 1, math.tan(math.radians(14)))
    yield Case(2, "tilt without its tag", VOLUME, plain(s), [s])
    s = [p for k, p in enumerate(base()) if k in (0, 5, 10, 20)]
    yield Case(4, "one thick slice missing (5, 5, 10 mm)", EITHER, plain(s), [s], word=True)
    s = lean(base(), 0.75, math.tan(math.radians(15.5)))
    del s[5]
    yield Case(5, "one thin slice missing in a tilted series", VOLUME, plain(s), [s], word=True)
    s = base()
    del s[12]
    yield Case(6, "one slice missing", VOLUME, plain(s), [s], word=True)
    s = [p for k, p in enumerate(base()) if not 8 <= k < 13]
    yield Case(7, "five slices missing together", EITHER, plain(s), [s], word=True)
    s = base(4)
    for p in s:
        move(p, z=ORIGIN[2])
    yield Case(8, "four slices at one place", REFUSE, plain(s))
    s = base()
    for p in s[16:]:
        p.row, p.column, p.position = (
            np.array([0, 1.0, 0]),
            np.array([0, 0, -1.0]),
            p.position * [0, 1, 0] + [float(p.position[2]), 0, 60],
        )
        say_place(p)
    yield Case(9, "two orientations in one series", EITHER, plain(s), [s[:16], s[16:]], word=True)
    s = base()
    for k, p in enumerate(s):
        p.pixel = np.array([0.5, 0.8])
        say_place(p)
        slope, intercept = 1 + 0.03125 * k, -1024 + 1.5 * k
        words = np.rint((p.hu - intercept) / slope).clip(0)
        p.hu = words * slope + intercept
        store(p, words, slope=slope, intercept=intercept)
    yield Case(10, "HU scale of its own for each slice, oblong pixels", VOLUME, plain(s), [s])
    s = base()
    t = twin(s[10])
    t.hu = hu[3].copy()
    store(t)
    yield Case(11, "two pictures at one place", REFUSE, plain(s + [t]), [s])
    s = base()
    yield Case(12, "the same file twice", EITHER, plain(s + [copy.deepcopy(s[10])]), [s])
    s = base()
    for p in s:
        p.d.InstanceNumber = 1
    yield Case(13, "all slices of one number", VOLUME, plain(s), [s])
    s = base()
    del s[8].d.ImagePositionPatient
    yield Case(14, "one slice without position", EITHER, plain(s), [s[:8] + s[9:]], word=True)
    s = base()

    def cut(folder, s=s):
        plain(s)(folder)
        f = folder / "008.dcm"
        f.write_bytes(f.read_bytes()[:-60000])

    yield Case(15, "one file cut short", EITHER, cut, [s[:8] + s[9:]], word=True)
    s = base()
    p = s[8]
    p.hu, p.pixel = p.hu[::2, ::2], p.pixel * 2
    store(p)
    say_place(p)
    yield Case(16, "one slice of another size", EITHER, plain(s), [s[:8] + s[9:]], word=True)
    s = base()

    def litter(folder, s=s):
        plain(s)(folder)
        p = slices(hu, 1)[0]
        p.row, p.column = np.array([0, 1.0, 0]), np.array([0, 0, -1.0])
        say_place(p)
        another(p, SeriesInstanceUID="1.2.3.4.77", SeriesNumber=9, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
        write(p.d, folder / "scout.dcm")
        (folder / "readme.txt").write_text("notes")
        (folder / "DICOMDIR").write_bytes(b"\0" * 128 + b"DICM" + b"\2\0\0\0UL\4\0\0\0\0\0")

    yield Case(17, "localizer, DICOMDIR and text in the folder", VOLUME, litter, [s])
    for n, name, syntax in (
        (18, "deflated", DeflatedExplicitVRLittleEndian),
        (20, "JPEG 2000", JPEG2000Lossless),
        (20, "RLE", RLELossless),
    ):
        s = base(12)
        yield Case(n, name, VOLUME, plain(s, syntax), [s])
    for name, uid, encode in (
        ("HTJ2K", "4.201", imagecodecs.htj2k_encode),
        ("HTJ2K, by resolution", "4.202", imagecodecs.htj2k_encode),
        ("JPEG XL", "4.110", lambda a: imagecodecs.jpegxl_encode(a, lossless=True)),
        ("each picture deflated", "8.1", deflate),
        ("uncompressed, encapsulated", "1.98", lambda a: a.tobytes()),
    ):
        s = base(12)
        for p in s:
            store(p, p.hu + 1024, 16, 16, 0, -1024)
        yield Case(72, name, VOLUME, encoded(s, "1.2.840.10008.1.2." + uid, encode), [s])
    s = base(12)
    for p in s:
        store(p, p.hu, 16, 15, 1, 0)
    yield Case(19, "JPEG-LS of signed pixels", VOLUME, plain(s, JPEGLSLossless), [s])
    s = base()
    yield Case(
        21, "enhanced multi-frame CT", VOLUME, lambda f, s=s: write(enhanced(s, range(len(s))), f / "e.dcm"), [s]
    )
    s = base()
    for p in s:
        p.measured[:4] = False
        words = p.hu.copy()
        words[:4] = -2000
        store(p, words, 16, 15, 1, 0)
        p.air = ~p.measured
    yield Case(23, "padding of -2000 HU is air", VOLUME, plain(s), [s])
    s = base(12)

    def bare(folder, s=s):
        for i, p in enumerate(s):
            d = copy.deepcopy(p.d)
            d.save_as(folder / f"{i:03}.dcm", implicit_vr=True, little_endian=True)

    yield Case(24, "without preamble and meta header", VOLUME, bare, [s])

    # 25 to 41.
    s = base()
    for p in s:
        store(p, p.hu & 0xFFF, 12, 11, 1, 0)
    yield Case(25, "signed 12-bit pixels, sign not extended", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        store(p, np.where(p.hu < -1000, -3024, p.hu), 12, 11, 1, 0)
        p.measured = p.hu >= -1000
        p.air = ~p.measured
    yield Case(25, "padding that its 12 bits do not hold", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        store(p, (p.hu + 1024) | (rng.integers(0, 16, p.hu.shape) << 12), 12, 11)
    yield Case(26, "rubbish above HighBit", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        store(p, (p.hu + 1024) << 4, 12, 15)
    yield Case(26, "pixels in the upper 12 bits of their words", VOLUME, plain(s), [s])
    for name, tags in (
        ("patients", {"PatientID": "OTHER", "PatientName": "Other^One"}),
        ("studies", {"StudyInstanceUID": "1.2.3.99"}),
        ("frames of reference", {"FrameOfReferenceUID": "1.2.3.98"}),
    ):
        s = base()
        for p in s[12:]:
            another(p, **tags)
        yield Case(27, f"two {name} under one series UID", EITHER, plain(s), [s[:12], s[12:]], word=True)
    s = base()
    for p in s:
        store(p, p.hu + 1024, intercept=0)
    yield Case(28, "no rescale intercept: 1024 HU too high", REFUSE, plain(s))
    s = base()
    for p in s:
        p.d.ImageType, p.d.SliceThickness = ["DERIVED", "SECONDARY", "MIP"], 10
    yield Case(29, "maximum-intensity slabs", REFUSE, plain(s))
    s = base()
    for p in s:
        p.d.RescaleType = "Z_EFF"
    yield Case(30, "effective atomic numbers", REFUSE, plain(s))
    s = base()
    for p in s:
        p.hu[:4] = -2000
        p.hu[200, 100:160] = -1100 - 7 * np.arange(60)
        store(p, p.hu, 16, 15, 1, 0)
        p.measured[:4] = False
        p.air = ~p.measured
    yield Case(31, "padding beside dark streaks of metal", VOLUME, plain(s), [s])
    s = base()
    move(s[10], x=3)
    yield Case(32, "one shifted slice", VOLUME, plain(s), [s], word=True)

    # 42 on.
    s = base()
    for k, p in enumerate(s):
        move(p, z=round(ORIGIN[2] + 0.0625 * k, 1))
    yield Case(42, "slices 0.0625 mm apart, positions in tenths", REFUSE, plain(s))
    a, b = base(), base()
    for k, p in enumerate(b):
        move(p, z=ORIGIN[2] + k + 0.4)
        p.hu = np.where(p.hu > 200, p.hu - 150, p.hu)
        another(p, AcquisitionNumber=2, InstanceNumber=COUNT + k + 1)
        store(p)
    yield Case(43, "two acquisitions, interleaved in space", EITHER, plain(a + b), [a, b], word=True)
    a, b = base(16), base()[10:]
    for p in b:
        p.hu = np.where(p.hu > 200, p.hu - 150, p.hu)
        another(p, AcquisitionNumber=2)
        store(p)
    yield Case(43, "two acquisitions that overlap in six slices", EITHER, plain(a + b), [a, b], word=True)
    s = base()
    order = rng.permutation(len(s)).tolist()
    yield Case(
        44, "enhanced CT, frames shuffled", VOLUME, lambda f, s=s, o=order: write(enhanced(s, o), f / "e.dcm"), [s]
    )
    s = base()
    for k, p in enumerate(s):
        slope, intercept = 1 + 0.03125 * k, -1024 - k
        words = np.rint((p.hu - intercept) / slope).clip(0)
        p.hu = words * slope + intercept
        store(p, words, slope=slope, intercept=intercept)
    yield Case(
        44,
        "enhanced CT, a HU scale for each frame",
        VOLUME,
        lambda f, s=s: write(enhanced(s, range(COUNT), True), f / "e.dcm"),
        [s],
    )
    s = base()
    p = s[8]
    p.pixel = p.pixel * 1.01
    say_place(p)
    yield Case(45, "one slice with another pixel spacing", EITHER, plain(s), [s[:8] + s[9:]], word=True)
    for name, spacing in (("zero", [0, 0]), ("negative", [-0.9, 0.9])):
        s = base()
        for p in s:
            p.d.PixelSpacing = spacing
        yield Case(46, f"pixel spacing {name}", REFUSE, plain(s))
    s = base()
    for p in s:
        p.d.SpacingBetweenSlices, p.d.SliceThickness = -2.5, 5
    yield Case(47, "SpacingBetweenSlices -2.5, thickness 5, positions 1 mm", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        p.d.ImagerPixelSpacing = [1.8, 1.8]
    yield Case(48, "ImagerPixelSpacing twice the PixelSpacing", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        del p.d.PixelSpacing
        p.d.ImagerPixelSpacing = [1.8, 1.8]
    yield Case(48, "ImagerPixelSpacing alone", REFUSE, plain(s))
    s = base()
    for p in s:
        words = np.rint((p.hu + 1024) / 4).clip(0, 1023)
        p.hu = words * 4 - 1024
        store(p, words, 10, slope=4)
    yield Case(49, "10 bits stored, slope 4", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        store(p, p.hu + 1024, 12)
    yield Case(50, "big-endian, 12 bits", VOLUME, plain(s, ExplicitVRBigEndian), [s])
    s = base()
    for k, p in enumerate(s):
        if k % 2:
            store(p, p.hu, 16, 15, 1, 0)
    yield Case(51, "signed and unsigned slices in turn", VOLUME, plain(s), [s])
    s = base()

    def mixed(folder, s=s):
        for i, p in enumerate(s):
            write(
                p.d,
                folder / f"{i:03}.dcm",
                *([JPEG2000Lossless] if i % 3 == 0 else [RLELossless] if i % 3 == 1 else []),
            )

    yield Case(52, "three encodings in one series", VOLUME, mixed, [s])
    for n, name, tags in (
        (53, "two temporal positions (4D)", {"TemporalPositionIdentifier": 2}),
        (54, "dual energy, 80 and 140 kV", {"KVP": 140}),
        (55, "two phases of one series, no tag tells them apart", {}),
    ):
        a, b = base(), base()
        for k, p in enumerate(a):
            if n == 53:
                p.d.TemporalPositionIdentifier = 1
            if n == 54:
                p.d.KVP = 80
        for k, p in enumerate(b):
            p.hu = np.where(p.hu > 200, p.hu - 150, p.hu)
            another(p, InstanceNumber=COUNT + k + 1, **tags)
            store(p)
        yield Case(n, name, EITHER if n != 55 else REFUSE, plain(a + b), [a, b], word=True)
    s = base()
    for p in s:
        store(p, 1024 - p.hu, intercept=1024, slope=-1)
    yield Case(56, "negative slope that turns the values right", EITHER, plain(s), [s])
    s = base()
    for p in s:
        p.d.RescaleSlope = -1
    yield Case(56, "slope of the wrong sign", REFUSE, plain(s))
    s = base()
    scout = slices(hu, 1)[0]
    scout.row, scout.column = np.array([0, 1.0, 0]), np.array([0, 0, -1.0])
    say_place(scout)
    another(scout, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"], InstanceNumber=99)
    yield Case(57, "localizer under the same series UID", VOLUME, plain([*s, scout]), [s])
    s = base()

    def shot(folder, s=s):
        plain(s)(folder)
        p = slices(hu, 1)[0]
        d = p.d
        another(p, SOPClassUID=SecondaryCaptureImageStorage, InstanceNumber=99, ImageType=["DERIVED", "SECONDARY"])
        for tag in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
            delattr(d, tag)
        d.SamplesPerPixel, d.PhotometricInterpretation, d.PlanarConfiguration = 3, "RGB", 0
        d.BitsAllocated, d.BitsStored, d.HighBit = 8, 8, 7
        d.PixelData = bytes(d.Rows * d.Columns * 3)
        write(d, folder / "shot.dcm")

    yield Case(58, "a screen shot in colour in the series", VOLUME, shot, [s])
    s = base()
    for p in s:
        p.d.PhotometricInterpretation = "PALETTE COLOR"
    for p in s:
        for part in ("Red", "Green", "Blue"):
            setattr(p.d, f"{part}PaletteColorLookupTableDescriptor", [256, 0, 8])
            setattr(p.d, f"{part}PaletteColorLookupTableData", bytes(range(256)))
    yield Case(58, "values that are places in a palette", REFUSE, plain(s))
    s = base()
    for p in s:
        del p.d.RescaleIntercept, p.d.RescaleSlope, p.d.RescaleType
        item = Dataset()
        item.LUTDescriptor, item.ModalityLUTType = [4096, 0, 16], "US"
        item["LUTDescriptor"].VR = "US"
        item.add_new(0x00283006, "OW", (65535 - np.arange(4096) * 16).astype("<u2").tobytes())
        p.d.ModalityLUTSequence = Sequence([item])
    yield Case(59, "a table (Modality LUT) in place of slope and intercept", REFUSE, plain(s))
    s = base()
    for p in s:
        tilt = rng.normal(0, 2e-6, 3)
        p.d.ImageOrientationPatient = [f"{v:.7f}" for v in (1 - abs(tilt[0]), tilt[0], tilt[1], -tilt[0], 1, tilt[2])]
    yield Case(60, "orientations with noise in the sixth digit", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        p.row, p.column, p.position = np.array([-1.0, 0, 0]), np.array([0, -1.0, 0]), p.position * [-1, -1, 1]
        say_place(p)
    yield Case(61, "prone: both axes turned round", VOLUME, plain(s[::-1]), [s])
    s = base()
    for k, p in enumerate(s):
        p.row, p.column, p.position = np.array([0, 1.0, 0]), np.array([0, 0, -1.0]), np.array([-10.0 + k, -115, 140])
        say_place(p)
    yield Case(62, "sagittal slices", VOLUME, plain(s), [s])
    s = base()
    for k, p in enumerate(s):
        p.d.InstanceNumber = int(rng.integers(1, 1000))
    shuffled = [s[i] for i in rng.permutation(COUNT)]
    yield Case(63, "files and numbers in no order", VOLUME, plain(shuffled), [s])
    s = base()

    def float_pixels(folder, s=s):
        for i, p in enumerate(s):
            d = copy.deepcopy(p.d)
            del d.PixelData
            d.FloatPixelData = np.asarray(p.hu, np.float32).tobytes()
            d.BitsAllocated, d.RescaleIntercept = 32, 0
            for tag in ("BitsStored", "HighBit", "PixelRepresentation"):
                delattr(d, tag)
            write(d, folder / f"{i:03}.dcm")

    yield Case(64, "pixels as floating-point numbers", EITHER, float_pixels, [s])
    s = base()
    for p in s:
        store(p, p.hu, 32, 31, 1, 0, allocated=32)
    yield Case(65, "32 bits a pixel, signed", EITHER, plain(s), [s])
    s = base()
    for k, p in enumerate(s):
        p.d.SeriesInstanceUID += f".{k % 2 + 1}"
    yield Case(
        66,
        "one scan written as two series, slices in turn",
        EITHER,
        plain(s),
        [s, s[::2], s[1::2]],
        word=True,
        nested=True,
    )
    s = base()
    a, b = s[:12], s[12:]
    for k, p in enumerate(b):
        move(p, z=ORIGIN[2] + 12 + 0.5 * k)
    yield Case(67, "1 mm below, 0.5 mm above", VOLUME, plain(s), [s])
    s = base()
    for p in s:
        p.d.ImageOrientationPatient = [1, 0, 0, 1, 0, 0]
    yield Case(68, "axes that are one line", REFUSE, plain(s))
    a, b = base(), base(6)
    for k, p in enumerate(b):
        move(p, z=ORIGIN[2] + 2.5 + 4 * k)
        p.hu = hu[min(COUNT - 1, 2 + 4 * k)].copy()
        another(p, SliceThickness=5, InstanceNumber=COUNT + k + 1)
        store(p)
    yield Case(69, "slices of 5 mm between those of 1 mm", EITHER, plain(a + b), [a, b], word=True)
    a, b = base(), base()
    for k, p in enumerate(b):
        move(p, z=ORIGIN[2] + 0.5 + k)
        p.hu = np.where(p.hu > 200, p.hu - 150, p.hu)
        another(p, ConvolutionKernel="B", InstanceNumber=COUNT + k + 1)
        store(p)
    yield Case(70, "two kernels, slices in turn", EITHER, plain(a + b), [a, b], word=True)
    a, b = base(), base()
    for k, p in enumerate(b):
        move(p, x=80)
        p.hu = p.hu[:, ::-1].copy()
        another(p, InstanceNumber=COUNT + k + 1)
        store(p)
    yield Case(71, "both ears under one series UID, side by side", EITHER, plain(a + b), [a, b], word=True)
    a, b = base(), base()
    for k, p in enumerate(b):
        move(p, x=80, z=ORIGIN[2] + 0.5 + k)
        p.hu = p.hu[:, ::-1].copy()
        another(p, InstanceNumber=COUNT + k + 1)
        store(p)
    yield Case(71, "both ears, side by side, slices in turn", EITHER, plain(a + b), [a, b], word=True)


def real(data):
    """The cases that are real files."""

    def whole(folder):
        return lambda to: shutil.copytree(folder, to, dirs_exist_ok=True)

    head, phantom, odd = (
        data / "dicom_ct_head_tilt_gaps",
        data / "dicom_ct_skull_phantom" / "S21610" / "S2010",
        data / "dicom_hard_geometry",
    )
    if head.exists():
        yield Case(
            1, "real head: tilt 18.5 degrees, 4.0 / 1.08 / 7.0 mm", VOLUME, whole(head), [of_folder(head)], word=True
        )
    if phantom.exists():
        yield Case(3, "real tilt, index files in the folder", VOLUME, whole(phantom), [of_folder(phantom)])


def all_cases(hu, data):
    return sorted([*real(data), *made(hu)], key=lambda c: c.number)

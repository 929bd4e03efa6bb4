# Hard series made from an easy one, and what readers of the field make of the same files, in one run.
# usage: peers_import.py OSTEO SERIES_FOLDER   (a folder with at least 20 even slices; needs pydicom and numpy, and takes SimpleITK, python-gdcm,
# dcm2niix and nibabel where they are installed). Prints a row a case: r right (or refused, with the reason), w wrong with a word on the
# console, s wrong without one, f failing without a usable reason.
import copy, json, os, pathlib, shutil, subprocess, sys, tempfile, warnings
import numpy as np
import pydicom
from pydicom.dataelem import DataElement

warnings.simplefilter("ignore")
osteo, source = sys.argv[1], pathlib.Path(sys.argv[2])
work = pathlib.Path(tempfile.mkdtemp(prefix="osteo-peers-"))

base = []
for f in sorted(source.iterdir()):
    try:
        d = pydicom.dcmread(f)
        d.pixel_array
        d.ImagePositionPatient
    except Exception:
        continue
    base.append(d)
base.sort(key=lambda d: float(d.ImagePositionPatient[2]))
base = base[len(base) // 3:][:20]
HU = [np.clip(d.pixel_array.astype(np.int32) * int(d.RescaleSlope) + int(d.RescaleIntercept), -1024, 2047) for d in base]


def slices(count=20):
    out = []
    for d, hu in zip(base[:count], HU):
        e = copy.deepcopy(d)
        e.hu = hu
        out.append(e)
    return out


def store(d, words, stored=16, high=15, signed=0, intercept=-1024):
    d.PixelData = np.asarray(words).astype(np.int64).astype(np.uint16).tobytes()
    d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = 16, stored, high, signed
    d.RescaleIntercept, d.RescaleSlope = intercept, 1
    if "PixelPaddingValue" in d:
        del d.PixelPaddingValue


def move(d, x=0.0, y=0.0, z=None):
    p = [float(v) for v in d.ImagePositionPatient]
    d.ImagePositionPatient = [f"{p[0] + x:.4f}", f"{p[1] + y:.4f}", f"{p[2] if z is None else z:.4f}"]


def another(d, **tags):
    for k, v in tags.items():
        setattr(d, k, v)
    d.SOPInstanceUID = d.SOPInstanceUID + ".7"


# name -> (slices, true HU or None where only a refusal is right)
cases = {}
rng = np.random.default_rng(1)

s = slices()
for d in s: store(d, d.hu & 0xFFF, 12, 11, 1, 0)
cases["signed 12 bits, sign not extended"] = (s, HU)
s = slices()
for d in s: store(d, (d.hu + 1024) | (rng.integers(0, 16, d.hu.shape) << 12), 12, 11)
cases["rubbish above HighBit"] = (s, HU)
s = slices()
for d in s: store(d, (d.hu + 1024) << 4, 12, 15)
cases["pixels in the upper 12 bits"] = (s, HU)
s = slices()
for d in s: store(d, np.where(d.hu < -1000, -3024, d.hu), 12, 11, 1, 0)
cases["padding that its 12 bits do not hold"] = (s, [np.where(h < -1000, -1024, h) for h in HU])
for name, tags in (("patients", {"PatientID": "OTHER", "PatientName": "Other^One"}), ("studies", {"StudyInstanceUID": "1.2.3.99"}),
                   ("frames of reference", {"FrameOfReferenceUID": "1.2.3.98"})):
    s = slices()
    for d in s[10:]: another(d, **tags)
    cases[f"two {name} under one series UID"] = (s, None)
s = slices()
for d in s: store(d, d.hu + 1024, intercept=0)
cases["no rescale intercept: 1024 HU too high"] = (s, None)
s = slices()
for d in s: d.ImageType, d.SliceThickness = ["DERIVED", "SECONDARY", "MIP"], 10
cases["maximum-intensity slabs"] = (s, None)
s = slices()
for d in s: d.RescaleType = "Z_EFF"
cases["effective atomic numbers"] = (s, None)
s = slices()
truth = []
for d in s:
    hu = d.hu.copy()
    hu[:4] = -2000
    hu[200, 200:260] = -1100 - 7 * np.arange(60)
    store(d, hu, 16, 15, 1, 0)
    hu[:4] = -1024
    truth.append(hu)
cases["padding beside dark streaks of metal"] = (s, truth)


def run_osteo(folder, out):
    r = subprocess.run([osteo, "import", folder, out / "o.nii"], capture_output=True, text=True)
    said = bool(r.stderr.strip())
    if r.returncode == 4: return "refused", None, said
    if r.returncode != 0: return "failed", None, said
    import nibabel
    return "read", [v[:, :, :].transpose(2, 1, 0) for v in [np.asarray(nibabel.load(out / "o.nii").dataobj)]], said


def run_itk(folder, out):
    script = ("import SimpleITK as s, numpy as n, sys\n"
              "ids = s.ImageSeriesReader.GetGDCMSeriesIDs(sys.argv[1])\n"
              "for i, u in enumerate(ids):\n"
              " r = s.ImageSeriesReader(); r.SetFileNames(s.ImageSeriesReader.GetGDCMSeriesFileNames(sys.argv[1], u))\n"
              " n.save(f'{sys.argv[2]}/{i}.npy', s.GetArrayFromImage(r.Execute()))\n")
    r = subprocess.run([sys.executable, "-c", script, folder, out], capture_output=True, text=True)
    if r.returncode != 0: return "failed", None, True
    return "read", [np.load(f) for f in sorted(out.glob("*.npy"))], bool(r.stderr.strip())


def run_gdcm(folder, out):
    script = ("import gdcm, numpy as n, sys, pathlib\n"
              "s = gdcm.IPPSorter(); s.SetComputeZSpacing(True); s.SetZSpacingTolerance(1e-3)\n"
              "names = [str(f) for f in sorted(pathlib.Path(sys.argv[1]).iterdir())]\n"
              "if not s.Sort(names): sys.exit(3)\n"
              "v = []\n"
              "for f in s.GetFilenames():\n"
              " r = gdcm.ImageReader(); r.SetFileName(f)\n"
              " if not r.Read(): sys.exit(4)\n"
              " i = r.GetImage(); p = i.GetPixelFormat()\n"
              " t = n.int16 if p.GetPixelRepresentation() else n.uint16\n"
              " a = n.frombuffer(i.GetBuffer().encode('utf-8', errors='surrogateescape'), t).reshape(i.GetDimension(1), i.GetDimension(0))\n"
              " v.append(a * i.GetSlope() + i.GetIntercept())\n"
              "n.save(f'{sys.argv[2]}/0.npy', n.stack(v))\n")
    r = subprocess.run([sys.executable, "-c", script, folder, out], capture_output=True, text=True)
    if r.returncode != 0: return "failed", None, True
    return "read", [np.load(out / "0.npy")], bool(r.stderr.strip())


def run_dcm2niix(folder, out):
    tool = shutil.which("dcm2niix") or str(pathlib.Path(sys.executable).parent / "dcm2niix")
    r = subprocess.run([tool, "-b", "n", "-z", "n", "-o", out, folder], capture_output=True, text=True)
    files = sorted(out.glob("*.nii"))
    if r.returncode != 0 or not files: return "failed", None, True
    import nibabel
    volumes = [np.asarray(nibabel.load(f).dataobj).transpose(2, 1, 0)[:, ::-1] for f in files]
    return "read", volumes, "warning" in (r.stdout + r.stderr).lower()


def judge(result, truth):
    how, volumes, said = result
    if how == "refused": return "r"
    if how == "failed": return "f"
    if truth is None:
        # Slices that do not belong together are right apart; all else had to be asked about.
        apart = len(volumes) > 1 and all(len(v) < 20 for v in volumes)
        return "r" if apart else "w" if said else "s"
    true = np.stack(truth)
    for v in volumes:
        for w in (v, v[::-1]):
            if w.shape == true.shape and np.array_equal(np.rint(w).astype(np.int64), true): return "r"
    return "w" if said else "s"


readers = {"osteo": run_osteo}
for name, module, run in (("SimpleITK", "SimpleITK", run_itk), ("GDCM", "gdcm", run_gdcm), ("dcm2niix", "dcm2niix", run_dcm2niix)):
    try:
        __import__(module)
        readers[name] = run
    except ImportError:
        pass
print("| case | " + " | ".join(readers) + " |")
print("|---|" + "---|" * len(readers))
count = {r: 0 for r in readers}
for name, (files, truth) in cases.items():
    folder = work / "in"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for i, d in enumerate(files):
        if hasattr(d, "hu"): del d.hu
        d.save_as(folder / f"{i:03}.dcm")
    row = []
    for reader, run in readers.items():
        out = work / "out"
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        try:
            row.append(judge(run(folder, out), truth))
        except Exception as e:
            print(f"  {reader} on {name}: {e}", file=sys.stderr)
            row.append("f")
        count[reader] += row[-1] == "r"
    print(f"| {name} | " + " | ".join(row) + " |", flush=True)
print(f"| right, or refused with the reason, of {len(cases)} | " + " | ".join(str(count[r]) for r in readers) + " |")
shutil.rmtree(work)

# The hard cases of an import beside the readers of the field, on the same files, in one run. scoreboard.sh gets the readers and starts it.
# usage: scoreboard.py OSTEO SHARED_DATA [NUMBER...]     prints the table of docs/validation/hard-cases.md; with numbers only those cases
#
# How it is judged, alike for all: what a reader writes is looked at in the patient's space. The centres of the true pixels are carried into
# the volume by its own matrix. Where they fall on voxels, the values must be those of the files (to half a HU). Where they fall between
# (a resampled volume), each slice's content must lie where it lies (nearer than any place half a pixel or, along the normal, half a slice or half a millimetre off) and its
# values on one line with the truth (slope within 10 %, mean within 12 HU). A reader that writes several volumes is right with one of them. Where slices
# are left out, filled in or chosen from, it must have said so, by a line with "warning", "error" or "missing".
#   right    the volume is right, or a refusal was
#   told     the volume is wrong, but a line says that something is odd
#   SILENT   the volume is wrong, and nothing is said
#   refused  no volume where there is a right one
import collections, pathlib, re, shutil, subprocess, sys, tempfile, warnings
import numpy as np
from cases import Case, EITHER, REFUSE, VOLUME, all_cases, plain
from series import made_up, of_phantom, slices

warnings.simplefilter("ignore")
WORD = re.compile(r"warning|error|missing|inconsisten|not uniform|non.?uniform|fail", re.I)
USUAL = {}  # what a reader says of a series that nothing is wrong with
TO_LPS = np.diag([-1.0, -1, 1, 1])


class Volume:
    """values[k, j, i], and the matrix from (i, j, k, 1) to LPS mm."""

    def __init__(self, values, affine):
        self.values, self.affine = np.asarray(values), affine
        # Slices that all lie at one place have none.
        self.inverse = np.linalg.inv(affine) if abs(np.linalg.det(affine[:3, :3])) > 1e-9 else np.full((4, 4), np.nan)

    def index_of(self, points):
        return points @ self.inverse[:3, :3].T + self.inverse[:3, 3]

    def sample(self, index):
        """Trilinear; NaN outside."""
        size = np.array(self.values.shape[::-1])
        inside = np.all((index > -0.51) & (index < size - 0.49), axis=1)
        x = np.clip(index, 0, size - 1.000001)
        x = np.maximum(x, 0)
        low = np.minimum(x.astype(int), np.maximum(size - 2, 0))
        f = x - low
        total = np.zeros(len(x))
        for c in range(8):
            step = np.array([c & 1, c >> 1 & 1, c >> 2])
            at = np.minimum(low + step, size - 1)
            weight = np.prod(np.where(step == 1, f, 1 - f), axis=1)
            total += weight * self.values[at[:, 2], at[:, 1], at[:, 0]]
        return np.where(inside, total, np.nan)


def slice_is_right(volume, s, gap):
    rows, columns = s.hu.shape
    rng = np.random.default_rng(3)
    edge = np.hypot(*np.gradient(np.asarray(s.hu, float)))
    edge[~s.measured] = 0
    edge[[0, 1, -2, -1]] = edge[:, [0, 1, -2, -1]] = 0
    many = min(3000, edge.size // 8)
    strong = np.argsort(edge.ravel())[-6 * many :]
    inner = np.flatnonzero(s.measured.ravel())
    at = np.unique(np.concatenate([rng.choice(strong, many, False), rng.choice(inner, min(many, len(inner)), False)]))
    j, i = np.divmod(at, columns)
    points = s.position + np.outer(i * s.pixel[0], s.row) + np.outer(j * s.pixel[1], s.column)
    true = s.hu.ravel()[at].astype(float)
    if hasattr(s, "air"):
        b, a = np.divmod(rng.choice(np.flatnonzero(s.air.ravel()), 200), columns)
        outside = volume.sample(
            volume.index_of(s.position + np.outer(a * s.pixel[0], s.row) + np.outer(b * s.pixel[1], s.column))
        )
        # What a resampled volume does not cover is air to whoever looks at it.
        if np.nanmin(outside, initial=-1024) < -1100 or np.nanmax(outside, initial=-1024) > -900:
            return False
    index = volume.index_of(points)
    if not np.all(np.isfinite(index)):
        return False
    if np.abs(index - np.rint(index)).max() < 0.02:
        k = np.rint(index).astype(int)
        if np.any(k < 0) or np.any(k >= np.array(volume.values.shape[::-1])):
            return False
        found = volume.values[k[:, 2], k[:, 1], k[:, 0]]
        if np.abs(found - true)[s.measured.ravel()[at]].max() <= 0.51:
            return True

    def off(shift):
        found = volume.sample(volume.index_of(points + shift))
        keep = np.isfinite(found)
        return (np.abs(found - true)[keep].mean() if keep.mean() > 0.95 else np.inf), found

    normal = np.cross(s.row, s.column)
    here, found = off(0)
    if not np.isfinite(here):
        return False
    for axis, step in ((s.row, s.pixel[0]), (s.column, s.pixel[1]), (normal, min(gap, 1.0))):
        if min(off(axis * step / 2)[0], off(axis * -step / 2)[0]) < here:
            return False
    keep = np.isfinite(found)
    slope, level = np.polyfit(found[keep], true[keep], 1) if np.ptp(found[keep]) > 0 else (0, 0)
    return bool(abs(slope - 1) < 0.1 and abs(np.mean(found[keep] - true[keep])) < 12)


def is_right(volume, truth):
    if not np.all(np.isfinite(volume.inverse)):
        return False
    along = np.sort([s.position @ np.cross(s.row, s.column) for s in truth])
    gap = np.min(np.diff(along)) if len(along) > 1 else 1.0
    return all(slice_is_right(volume, s, gap) for s in truth)


def judge(case, result):
    volumes, told = result
    if not volumes:
        return "right" if case.want in (REFUSE, EITHER) and told else "refused"
    if case.want == REFUSE:
        return "told" if told else "SILENT"
    matches = [{n for n, truth in enumerate(case.volumes) if is_right(v, truth)} for v in volumes]
    # Both of two scans in one volume are a mixture.
    found = set().union(*(m for m in matches if len(m) == 1 or 0 in m and case.nested))
    if found and (told or not case.word or len(found) == len(case.volumes) > 1):
        return "right"
    return "told" if told else "SILENT"


def command(*words):
    r = subprocess.run([str(w) for w in words], capture_output=True, text=True, errors="replace", timeout=300)
    return r.returncode, r.stdout + r.stderr


def said(reader, text):
    """Lines that tell of something odd, without numbers and names."""
    lines = {re.sub(r"[\d.]+|\S*/\S*", "", line).strip() for line in text.splitlines() if WORD.search(line)}
    return lines - USUAL.setdefault(reader, lines)


def nifti(files):
    import nibabel

    volumes = []
    for f in files:
        image = nibabel.load(f)
        if image.get_data_dtype().names or len(image.shape) < 3:
            continue  # colour, or one slice
        values = np.asarray(image.dataobj)
        values = values.reshape(*values.shape[:3], -1)
        for t in range(values.shape[3]):
            volumes.append(Volume(values[..., t].transpose(2, 1, 0), TO_LPS @ image.affine))
    return volumes


def run_osteo(folder, out):
    code, text = command(osteo, "import", folder, out / "o.nii")
    return nifti(out.glob("*.nii")), bool(re.search(r"\[[A-Z0-9_]{4,}\]", text)) if code == 0 else len(text) > 40


def run_dcm2niix(folder, out):
    tool = shutil.which("dcm2niix", path=str(pathlib.Path(sys.executable).parent)) or "dcm2niix"
    _, text = command(tool, "-b", "n", "-z", "n", "-o", out, folder)
    return nifti(sorted(out.glob("*.nii"))), said("dcm2niix", text)


def run_vtk_dicom(folder, out):
    # A matrix with a shear is kept by the sform.
    _, text = command("dicomtonifti", "-v", "--no-qform", "--batch", "-r", "-o", out, folder)
    return nifti(sorted(out.rglob("*.nii*"))), said("vtk-dicom", text)


def arrays(out):
    return [Volume(d["values"], d["affine"]) for d in (np.load(f) for f in sorted(out.glob("*.npz")))]


ITK = """
import SimpleITK as s, numpy as n, sys
ids = s.ImageSeriesReader.GetGDCMSeriesIDs(sys.argv[1])
for i, u in enumerate(ids):
    r = s.ImageSeriesReader(); r.SetFileNames(s.ImageSeriesReader.GetGDCMSeriesFileNames(sys.argv[1], u))
    try: v = r.Execute()
    except Exception as e:
        print('error', e, file=sys.stderr); continue
    if v.GetDimension() == 2 or v.GetNumberOfComponentsPerPixel() > 1: continue
    if v.GetDimension() == 4: v = v[..., 0]
    a = n.eye(4); a[:3, :3] = n.array(v.GetDirection()).reshape(3, 3) * n.array(v.GetSpacing()); a[:3, 3] = v.GetOrigin()
    n.savez(f'{sys.argv[2]}/{i}.npz', values=s.GetArrayFromImage(v), affine=a)
"""
# As GDCM's own examples put a volume together: sorted by position, the sorter's spacing, the first slice's place.
GDCM = """
import gdcm, numpy as n, sys, pathlib
gdcm.Trace.WarningOn(); gdcm.Trace.ErrorOn()
s = gdcm.IPPSorter(); s.SetComputeZSpacing(True); s.SetZSpacingTolerance(1e-3)
names = [str(f) for f in sorted(pathlib.Path(sys.argv[1]).rglob('*')) if f.is_file()]
def read(f):
    # Copies: an image is gone with its reader.
    r = gdcm.ImageReader(); r.SetFileName(f)
    if not r.Read(): sys.exit('error: cannot read a file')
    i = r.GetImage(); p = i.GetPixelFormat(); k = p.GetBitsAllocated() // 8
    if p.GetSamplesPerPixel() != 1: sys.exit('error: colour')
    t = n.dtype(('i' if p.GetPixelRepresentation() else 'u') + str(k))
    z = i.GetDimension(2) if i.GetNumberOfDimensions() > 2 else 1
    a = n.frombuffer(i.GetBuffer().encode('utf-8', errors='surrogateescape'), t).reshape(z, i.GetDimension(1), i.GetDimension(0))
    c = n.array([i.GetDirectionCosines(k) for k in range(6)]); u, w = c[:3], c[3:]
    m = n.eye(4); m[:3, 0], m[:3, 1], m[:3, 2] = u * i.GetSpacing(0), w * i.GetSpacing(1), n.cross(u, w) * (i.GetSpacing(2) if z > 1 else 1)
    m[:3, 3] = [i.GetOrigin(k) for k in range(3)]
    return a * i.GetSlope() + i.GetIntercept(), m
if len(names) == 1:
    v, m = read(names[0])
else:
    if not s.Sort(names): sys.exit('error: cannot sort')
    parts = [read(f) for f in s.GetFilenames()]
    v, m = n.concatenate([p[0] for p in parts]), parts[0][1]
    m[:3, 2] *= s.GetZSpacing()
n.savez(f'{sys.argv[2]}/0.npz', values=v, affine=m)
"""


def run_script(name, script):
    def run(folder, out):
        code, text = command(sys.executable, "-c", script, folder, out)
        return arrays(out), said(name, text) or code != 0

    return run


def versions():
    import gdcm, SimpleITK

    niix = re.search(
        r"v1\.0\.\d+",
        command(shutil.which("dcm2niix", path=str(pathlib.Path(sys.executable).parent)) or "dcm2niix", "-v")[1],
    )
    vtk = re.search(r"\d+\.\d+\.\d+", command("dicomtonifti", "--version")[1])
    return [
        f"dcm2niix {niix[0] if niix else ''}",
        f"vtk-dicom {vtk[0] if vtk else ''}",
        f"SimpleITK {SimpleITK.Version.VersionString()}",
        f"GDCM {gdcm.Version.GetVersion()}",
    ]


osteo, data = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
only = {int(a) for a in sys.argv[3:]}
phantom = data / "dicom_ct_skull_phantom" / "S21570" / "S2030"
hu = of_phantom(phantom) if phantom.exists() else made_up()
readers = {
    "osteo": run_osteo,
    "dcm2niix": run_dcm2niix,
    "vtk-dicom": run_vtk_dicom,
    "SimpleITK": run_script("SimpleITK", ITK),
    "GDCM": run_script("GDCM", GDCM),
}
print(
    f"Slices: {'a real skull phantom' if phantom.exists() else 'made up (no real data at hand)'}; {', '.join(versions())}.\n"
)
print("| # | case | " + " | ".join(readers) + " |\n|---|---|" + "---|" * len(readers), flush=True)
count = {r: collections.Counter() for r in readers}
total = 0
with tempfile.TemporaryDirectory(prefix="osteo-scoreboard-") as work:
    folder, out = pathlib.Path(work) / "in", pathlib.Path(work) / "out"

    def results(case):
        for reader, run in readers.items():
            for f in (folder, out):
                shutil.rmtree(f, ignore_errors=True)
                f.mkdir()
            case.fill(folder)
            try:
                yield reader, judge(case, run(folder, out))
            except subprocess.TimeoutExpired:
                yield reader, "refused"

    straight = slices(hu)
    for reader, verdict in results(Case(0, "", VOLUME, plain(straight), [straight])):
        if verdict != "right":
            sys.exit(f"{reader} does not read the series that nothing is wrong with: {verdict}")
    for case in all_cases(hu, data):
        if only and case.number not in only:
            continue
        total += 1
        row = [v for _, v in results(case)]
        for reader, verdict in zip(readers, row):
            count[reader][verdict] += 1
        print(f"| {case.number} | {case.name} | " + " | ".join(row) + " |", flush=True)
for verdict in ("right", "told", "SILENT", "refused"):
    print(f"| | **{verdict}**, of {total} | " + " | ".join(str(count[r][verdict]) for r in readers) + " |")
sys.exit(0 if count["osteo"]["right"] == total else 1)

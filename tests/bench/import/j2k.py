# JPEG 2000: who decodes how fast on the same cores, and where the time goes. In one run: j2k.py OSTEO SHARED_DATA
# Takes the peers of scoreboard.sh, and imagecodecs where it is installed (OpenJPEG without any reader around it). Wall time needs an idle
# machine; CPU time does not.
import glob, os, pathlib, re, resource, shutil, subprocess, sys, tempfile, time
import pydicom

osteo, data = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
source = data / "dicom_ct_skull_phantom" / "S21570" / "S2030"
cores = sorted(os.sched_getaffinity(0))
work = pathlib.Path(tempfile.mkdtemp(prefix="osteo-j2k-"))

ENCODE = """
import gdcm, sys, pathlib
n = 0
for f in sorted(pathlib.Path(sys.argv[1]).iterdir()):
    r = gdcm.ImageReader(); r.SetFileName(str(f))
    if not r.Read(): continue
    c = gdcm.ImageChangeTransferSyntax(); c.SetTransferSyntax(gdcm.TransferSyntax(gdcm.TransferSyntax.JPEG2000Lossless))
    c.SetInput(r.GetImage()); c.Change()
    w = gdcm.ImageWriter(); w.SetFileName(f'{sys.argv[2]}/{n:04}.dcm'); w.SetFile(r.GetFile()); w.SetImage(c.GetOutput()); w.Write(); n += 1
"""
OPENJPEG = """
import sys, pathlib, pydicom, imagecodecs
from concurrent.futures import ThreadPoolExecutor
frames = [next(pydicom.encaps.generate_frames(pydicom.dcmread(f).PixelData, number_of_frames=1)) for f in sorted(pathlib.Path(sys.argv[1]).iterdir())]
with ThreadPoolExecutor(int(sys.argv[2])) as pool: list(pool.map(lambda b: imagecodecs.jpeg2k_decode(b, numthreads=1), frames))
"""
GDCM = """
import gdcm, sys, pathlib
for f in sorted(pathlib.Path(sys.argv[1]).iterdir()):
    r = gdcm.ImageReader(); r.SetFileName(str(f))
    if not r.Read(): sys.exit(1)
    r.GetImage().GetBuffer()
"""
ITK = """
import SimpleITK as s, sys
r = s.ImageSeriesReader(); r.SetFileNames(s.ImageSeriesReader.GetGDCMSeriesFileNames(sys.argv[1])); r.Execute()
"""


def cost(words, on):
    best = (1e9, 1e9)
    for _ in range(3):
        for f in work.glob("out*"):
            f.unlink()
        start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [str(w) for w in words],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=lambda: os.sched_setaffinity(0, on),
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        best = min(best[0], time.monotonic() - start), min(
            best[1], after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        )
    return best


folder = work / "in"
folder.mkdir()
subprocess.run([sys.executable, "-c", ENCODE, source, folder], check=True)
readers = {
    "osteo import": [osteo, "import", folder, work / "out.nii", "--quiet"],
    "vtk-dicom (dicomtonifti)": ["dicomtonifti", "-s", "-o", work / "out2.nii", *sorted(folder.iterdir())],
    "GDCM (Python)": [sys.executable, "-c", GDCM, folder],
    "SimpleITK": [sys.executable, "-c", ITK, folder],
}
try:
    import imagecodecs

    readers[f"OpenJPEG alone ({imagecodecs.jpeg2k_version().split()[-1]}), a picture a core"] = [
        sys.executable,
        "-c",
        OPENJPEG,
        folder,
        "CORES",
    ]
except ImportError:
    pass
print(
    f"{len(list(folder.iterdir()))} slices of 512x512, JPEG 2000 lossless.\n\n| reader | cores | wall s | CPU s |\n|---|---|---|---|"
)
for n in sorted({1, len(cores)}):
    for name, words in readers.items():
        wall, cpu = cost([n if w == "CORES" else w for w in words], set(cores[:n]))
        print(f"| {name} | {n} | {wall:.2f} | {cpu:.2f} |", flush=True)
if shutil.which("perf"):
    record = work / "perf.data"
    subprocess.run(
        ["perf", "record", "-q", "-o", record, *map(str, readers["osteo import"][:-2]), work / "out3.nii", "--quiet"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    report = subprocess.run(
        ["perf", "report", "-i", record, "--stdio", "--sort", "dso"], capture_output=True, text=True
    ).stdout
    print("\nWhere `osteo import` spends it (perf, samples by library):\n")
    for share, dso in re.findall(r"^\s+([\d.]+)%\s+(\S+)", report, re.M)[:4]:
        print(f"- {share} % {dso}")
shutil.rmtree(work)

#!/usr/bin/env python3
"""docs/how-to/vtk_render.cpp draws what it says, under Xvfb: its picture shows bone where the surface, projected here pixel by pixel by what VTK says its first
camera is, lies, and black elsewhere; a wrong file is told with line and step, and no picture is made. usage: check_vtk_render.py PROGRAM OSTEO_BIN FIXTURES SCRATCH SOURCE
"""

import os, pathlib, shutil, subprocess, sys

try:
    import numpy as np
    from PIL import Image, ImageDraw
except ImportError:
    sys.exit(77)
program, bin_dir, fixtures, scratch, source = (pathlib.Path(a).resolve() for a in sys.argv[1:])
if shutil.which("Xvfb") is None:
    sys.exit(77)
shutil.rmtree(scratch, ignore_errors=True)
(scratch / "case").mkdir(parents=True)
osteo = str(bin_dir / "osteo")
pipeline = source / "pipelines/temporal-bone.json"

# What stands in the picture, as a mesh of the same steps.
subprocess.run(
    [
        osteo,
        "run",
        "--engine",
        "vtk",
        pipeline,
        "--set",
        f"source={fixtures}/ct.nrrd",
        "--set",
        "case=case",
        "--set",
        "lower=500",
        "--quiet",
    ],
    cwd=scratch,
    check=True,
)
subprocess.run([osteo, "surface", "case/bone.vdb", "bone.stl", "--quiet"], cwd=scratch, check=True)
corners = np.frombuffer(
    (scratch / "bone.stl").read_bytes()[84:], dtype=np.dtype([("n", "<3f4"), ("v", "<(3,3)f4"), ("a", "<u2")])
)["v"].astype(float)
lo, hi = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)

read, write = os.pipe()
server = subprocess.Popen(
    ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp"],
    pass_fds=[write],
    stderr=subprocess.DEVNULL,
)
try:
    os.close(write)
    display = os.read(read, 64).decode().strip()
    assert display, "Xvfb did not start"
    env = dict(os.environ, DISPLAY=f":{display}")
    subprocess.run([program, pipeline, fixtures / "ct.nrrd", "bone.png"], cwd=scratch, env=env, check=True)
    wrong = scratch / "wrong.json"
    wrong.write_text(pipeline.read_text().replace('"${source}"', '"nowhere/${source}"'))
    failed = subprocess.run(
        [program, wrong, "ct.nrrd", "none.png"], cwd=scratch, env=env, capture_output=True, text=True
    )
finally:
    server.terminate()
    server.wait()
line = next(n for n, text in enumerate(wrong.read_text().splitlines(), 1) if '"id": "scan"' in text)
assert failed.returncode == 3 and f"line {line}: stage 'scan'" in failed.stderr, (failed.returncode, failed.stderr)
assert not (scratch / "none.png").exists()

picture = np.asarray(Image.open(scratch / "bone.png").convert("RGB"))
assert picture.shape == (480, 640, 3), picture.shape
bone = picture.max(2) > 0
# vtkRenderer::ResetCamera: from +z, 30 degrees high, so far that the sphere round the box is in view.
half = np.tan(np.radians(15))
away = np.linalg.norm(hi - lo) / 2 / np.sin(np.radians(15))
from_middle = corners - (lo + hi) / 2
depth = away - from_middle[..., 2:]
pixels = (
    np.stack(
        [
            320 + 240 / half * from_middle[..., 0] / depth[..., 0],
            240 - 240 / half * from_middle[..., 1] / depth[..., 0],
        ],
        -1,
    )
    - 0.5
)
mask = Image.new("1", (640, 480))
draw = ImageDraw.Draw(mask)
for triangle in pixels.reshape(-1, 6):
    draw.polygon(triangle.tolist(), fill=1)
wanted = np.asarray(mask)
off = np.count_nonzero(bone != wanted) / np.count_nonzero(wanted)
print(f"bone on {bone.mean():.4f} of the picture, {wanted.mean():.4f} expected; {off:.4f} of it elsewhere")
assert wanted.mean() > 0.05 and off < 0.03
# Lit, not flat.
assert picture[bone].std(0).min() > 10

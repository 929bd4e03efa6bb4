#!/usr/bin/env python3
"""The examples of apps/python/examples, each run as a user runs it: what it prints is right, and its picture shows what it should.
usage: check_examples.py EXAMPLES WORK (PYTHONPATH as for the module)"""

import pathlib
import re
import shutil
import subprocess
import sys
import time

try:
    import numpy as np
    import vtkmodules.vtkRenderingFreeType  # noqa: F401  (letters of the pictures)
except ImportError as e:
    print(f"{e}: the examples draw with numpy and python3-vtk9")
    sys.exit(77)
import osteo

examples, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def run(name):
    """What the example printed, and its picture; without a display, wherever the test runs."""
    begun = time.perf_counter()
    done = subprocess.run(
        ["env", "-u", "DISPLAY", "-u", "WAYLAND_DISPLAY", sys.executable, "-B", "-W", "error", examples / f"{name}.py"],
        cwd=work,
        text=True,
        capture_output=True,
    )
    assert done.returncode == 0, f"{name}: {done.stderr}"
    picture = osteo.load(work / (name.replace("_", "-") + ".png"))
    assert picture.dtype == np.uint8 and picture.shape[2] == 3, picture.shape
    print(f"{name}: {time.perf_counter() - begun:.1f} s, {picture.shape[1]} x {picture.shape[0]} pixels")
    return done.stdout, picture.astype(int)


def numbers(text, pattern):
    found = re.search(pattern, text)
    assert found, f"no {pattern!r} in: {text}"
    return [float(g) for g in found.groups()]


def share(picture, colour, within=12):
    return (np.abs(picture - np.array(colour)).max(axis=2) <= within).mean()


def bone_coloured(picture):
    """Lit bone is a warm light brown: red over green over blue, by a little."""
    r, g, b = np.moveaxis(picture, 2, 0)
    return ((r > 100) & (r > g + 5) & (g > b + 8) & (r - b < 90)).mean()


RED, BLUE, GREEN, GREY = (192, 57, 43), (44, 127, 184), (65, 171, 93), (120, 120, 120)  # of curves

said, picture = run("nerve_distance")
by_voxels, by_fractions = numbers(said, r"bone ([\d.]+) cm3, as fractions of voxels ([\d.]+) cm3")
assert 40 < by_voxels < 80 and abs(by_voxels / by_fractions - 1) < 0.02, said
near = [numbers(said, rf"than {mm} mm: (\d+) mm3")[0] for mm in (1, 2, 4)]
assert 0 < near[0] < near[1] < near[2] < 1000 * by_voxels, near
count, apart = numbers(said, r"difference to (\d+) distances taken by numpy: (\S+) mm")
assert count > 100 and apart < 1e-4, said
assert bone_coloured(picture[:, picture.shape[1] // 2 :]) > 0.2
slice_ = picture[:, : picture.shape[1] // 3]
assert share(slice_, (255, 220, 40)) > 0.001, "the nerve"
assert share(slice_, (255, 255, 255)) > 0.005, "lines of equal distance"
r, g, b = np.moveaxis(slice_, 2, 0)
assert (r > g + 40).mean() > 0.005 and (b > r + 30).mean() > 0.005, "near and far bone, coloured"

said, picture = run("drilled_hole")
most, depth = numbers(said, r"most force ([\d.]+) N at ([\d.]+) mm")
assert 0.5 < most < 8 and 0.5 < depth < 12, said
servo, densities = numbers(said, r"removed ([\d.]+) mm3 by the servo, ([\d.]+) mm3 by")
assert servo > 5 and abs(servo - densities) < 0.002, said
ticks = np.load(work / "drilled-hole.npy")
force_n = np.linalg.norm(ticks["force_n"], axis=1)
assert ticks.dtype == osteo.tick_dtype and len(ticks) == 5416 and (np.diff(ticks["tick"].astype(int)) == 1).all()
assert abs(force_n.max() - most) < 0.006 and abs(ticks["removed_mm3"].sum(dtype=float) - servo) < 0.002
assert force_n[:250].max() < 0.1 < force_n[500:2000].mean(), "nothing is felt before the bone"
assert bone_coloured(picture[:, :440]) > 0.15
# The curve: as high above the axis as the force is, at its highest.
columns, rows = np.nonzero((np.abs(picture[40:308, 514:883] - np.array(RED)).max(axis=2) < 60).T)
assert rows.min() < 20 and abs(columns[rows.argmin()] / 369 - force_n.argmax() / len(ticks)) < 0.03, (
    rows.min(),
    columns[rows.argmin()],
)

said, picture = run("bent_beam")
length, edge, young, shear = 60.0, 6.0, 17000.0, 17000.0 / 2.6
tip = -100 * (length**3 / (3 * young * edge**4 / 12) + length / (5 / 6 * shear * edge**2))
for elements, lowest, highest in (
    ("t4 of 3 mm", 0.55, 0.8),
    ("t10 of 3 mm", 0.98, 1.005),
    ("t10 of 1.5 mm", 0.985, 1.005),
):
    found, formula = numbers(said, rf"{elements}: tip (-[\d.]+) mm, formula (-[\d.]+) mm")
    assert abs(formula - tip) < 1e-3 and lowest < found / tip < highest, said
assert bone_coloured(picture[:, :440]) > 0.02
strip = (picture[:, :440].sum(axis=2) > 300) & (np.arange(360) > 40)[:, None]
middle = [np.nonzero(strip[:, c])[0].mean() for c in (40, 400)]
assert middle[1] > middle[0] + 8, f"the strip sinks towards its end, {middle}"
assert (
    all(share(picture[:, 440:], colour) > 0.0008 for colour in (BLUE, GREEN, GREY))
    and share(picture[:, 440:], RED, 60) > 0.0005
)

said, picture = run("no_copies")
times = [
    [float(v) for v in row]
    for row in re.findall(r"([\d.]+) MB: in +([\d.]+) us, out +([\d.]+) us, numpy's copy +([\d.]+) us", said)
]
assert len(times) == 5 and times[-1][0] == 128, said
# 128 MB cannot be copied in a millisecond, nor does a call take one.
assert times[-1][1] < 1000 and times[-1][2] < 1000 < times[-1][3], said
assert "same memory in: True - read-only: True" in said and "found as numpy finds it: True" in said
ball, formula = numbers(said, r"ball (\d+) mm3, formula (\d+) mm3")
assert abs(ball / (4 / 3 * np.pi * 25**3) - 1) < 0.002 and round(formula) == 65450, said
assert numbers(said, r"outside (\d+) mm3")[0] + ball == 128**3 / 8
assert all(share(picture, colour, 60) > 0.001 for colour in (RED, BLUE, GREEN))

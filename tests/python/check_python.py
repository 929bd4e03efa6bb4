#!/usr/bin/env python3
"""The Python module as a script uses it: stages on arrays without copies, errors with codes, the same voxels as the program."""

import copy
import gc
import inspect
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)
import osteo


def fails(call, code, word, also=osteo.Error):
    try:
        call()
    except osteo.Error as e:
        assert e.code == code, (e.code, str(e))
        assert word in str(e), str(e)
        assert isinstance(e, also), (also, type(e))
        assert "--" not in re.sub("'osteo [^']*'", "", str(e)), str(e)
        back = pickle.loads(pickle.dumps(e))
        assert type(back) is type(e) and str(back) == str(e) and back.code == e.code and back.advice == e.advice
        return
    raise AssertionError(f"no error that says {word}")


# Every stage is a function with a signature and help.
assert len(osteo.stages) > 20, osteo.stages
for name in osteo.stages:
    function = getattr(osteo, name)
    assert function.__doc__ and "Returns" in function.__doc__, name
    assert not re.search(
        "(^|[^a-z-])--[a-z]", re.sub("'osteo [^']*'", "", function.__doc__)
    ), f"{name}: a flag of the command in the help"
    inspect.signature(function)
assert inspect.signature(osteo.threshold).parameters["lower"].kind is inspect.Parameter.KEYWORD_ONLY

# In and out without copies.
voxels = np.full((20, 24, 28), -1000, np.int16)
voxels[5:15, 6:18, 7:21] = 1200
ct = osteo.Image(voxels, spacing_mm=(0.5, 0.6, 0.7), origin_mm=(1, 2, 3))
assert ct.voxels.ctypes.data == voxels.ctypes.data and np.shares_memory(ct.voxels, voxels)
assert ct.shape == [20, 24, 28] and ct.spacing_mm == [0.5, 0.6, 0.7] and ct.origin_mm == [1, 2, 3]
assert not ct.voxels.flags.writeable

# What a stage found is what numpy finds.
report = {}
mask = osteo.threshold(ct, lower=500, report=report)
assert isinstance(mask, osteo.Labels) and report
assert np.array_equal(mask.voxels, (voxels >= 500).astype(np.uint8))
view = mask.voxels
assert view.ctypes.data == mask.voxels.ctypes.data
del mask
gc.collect()
assert view.sum() == 10 * 12 * 14, "a view keeps the memory alive"

# The array lives as long as the image does.
before = sys.getrefcount(voxels)
second = osteo.Image(voxels)
assert sys.getrefcount(voxels) > before
del second
gc.collect()
assert sys.getrefcount(voxels) == before

# Refused in words, with the exit code of the programs.
fails(lambda: osteo.Image(voxels.astype(np.float64)), 2, "int16", TypeError)
fails(lambda: osteo.Image(voxels.astype(">i2")), 2, "int16", TypeError)
fails(lambda: osteo.Image(voxels[:, ::2]), 2, "contiguous", ValueError)
fails(lambda: osteo.Image(np.zeros((3, 3), np.int16)), 2, "three axes", ValueError)
fails(lambda: osteo.Image(voxels, spacing_mm=(0, 1, 1)), 4, "spacing", ValueError)
fails(lambda: osteo.threshold(ct, lower="many"), 2, "lower", ValueError)
fails(lambda: osteo.threshold(ct, lower=1e9), 2, "lower", ValueError)
fails(lambda: osteo.threshold(ct, lower=True), 2, "lower", TypeError)
fails(lambda: osteo.threshold(ct, lower=600, upper=500), 2, "lower 600 HU is above upper 500 HU", ValueError)
fails(lambda: osteo.crop(ct, region="box"), 2, "size_mm", ValueError)
fails(lambda: osteo.threshold(3, lower=500), 2, "int", TypeError)
fails(lambda: osteo.threshold("nothing-here.nrrd"), 3, "nothing-here")
try:
    osteo.threshold(ct, lowest=1)
    raise AssertionError("an unknown parameter was taken")
except TypeError as e:
    assert "lowest" in str(e)

# As arrays of others, without copies where they can be had, never writable.
for taken in (np.asarray(ct), np.asarray(ct, dtype=np.int16)):
    assert (
        taken.shape == (20, 24, 28)
        and taken.dtype == np.int16
        and taken.ctypes.data == voxels.ctypes.data
        and not taken.flags.writeable
    )
assert np.asarray(ct, dtype=np.float32).dtype == np.float32 and np.array_equal(np.asarray(ct, dtype=np.float32), voxels)
own = np.array(ct)
assert own.ctypes.data != voxels.ctypes.data and own.flags.writeable and np.array_equal(own, voxels)
assert (
    ct.__array__(copy=True).ctypes.data != voxels.ctypes.data
    and ct.__array__(np.int16, copy=False).ctypes.data == voxels.ctypes.data
)
fails(lambda: ct.__array__(np.float32, copy=False), 2, "copy", ValueError)
assert np.mean(ct) == voxels.mean() and (np.asarray(ct) > 500).sum() == 10 * 12 * 14
legacy = np.from_dlpack(ct)  # of an older numpy a copy: it cannot be told that memory may not be written
assert np.array_equal(legacy, voxels) and ct.__dlpack_device__() == (1, 0)
if np.lib.NumpyVersion(np.__version__) >= "2.1.0":
    assert legacy.ctypes.data == voxels.ctypes.data and not legacy.flags.writeable
    assert np.from_dlpack(ct, copy=True).ctypes.data != voxels.ctypes.data
    field = osteo.Field(np.ones((2, 3, 4), np.float32))
    assert (
        np.from_dlpack(field).dtype == np.float32
        and np.from_dlpack(osteo.Labels(np.ones((2, 3, 4), np.uint8))).dtype == np.uint8
    )
before = sys.getrefcount(voxels)
for _ in range(3):
    ct.__dlpack__(max_version=(1, 0))  # taken by nobody
    np.from_dlpack(ct)
legacy = None
gc.collect()
assert sys.getrefcount(voxels) <= before, "what DLPack handed out is given back"
for wrong in (lambda: ct.__dlpack__(copy=False), lambda: ct.__dlpack__(max_version=(1, 0), dl_device=(2, 0))):
    try:
        wrong()
        raise AssertionError("handed out")
    except BufferError:
        pass
fails(lambda: ct.__dlpack__(stream=1), 2, "stream", ValueError)
assert repr(ct) == "<osteo.Image: int16, shape (20, 24, 28), spacing_mm (0.5, 0.6, 0.7), origin_mm (1, 2, 3)>", repr(ct)


# What goes to another process and comes back is the same.
def same(a, b):
    assert type(a) is type(b) and repr(a) == repr(b), (a, b)
    parts = [p for p in ("voxels", "points_mm", "triangles", "normals", "tets") if hasattr(a, p)]
    assert all(np.array_equal(getattr(a, p), getattr(b, p)) for p in parts)
    if hasattr(a, "direction"):
        assert a.direction == b.direction
    if isinstance(a, osteo.Grid):
        assert np.array_equal(a.dense().voxels, b.dense().voxels) and (a.background, a.name) == (b.background, b.name)


def goes_round(value):
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        same(value, pickle.loads(pickle.dumps(value, protocol)))
    same(value, copy.copy(value))
    same(value, copy.deepcopy(value))
    same(value, copy.deepcopy([value])[0])


turned = osteo.Image(voxels, (0.5, 0.6, 0.7), (1, 2, 3), ((0, -1, 0), (1, 0, 0), (0, 0, 1)))
for value in (
    ct,
    turned,
    osteo.Labels(np.arange(24, dtype=np.uint8).reshape(2, 3, 4)),
    osteo.Field(np.linspace(0, 1, 24, dtype=np.float32).reshape(2, 3, 4)),
    osteo.Grid(
        np.linspace(0, 1, 24, dtype=np.float32).reshape(2, 3, 4), (0.5, 0.5, 0.5), (7, 8, 9), background=0.25, name="hu"
    ),
):
    goes_round(value)
assert (
    copy.copy(ct).voxels.ctypes.data == voxels.ctypes.data
    and copy.deepcopy(ct).voxels.ctypes.data != voxels.ctypes.data
)
buffers = []
pickle.dumps(ct, 5, buffer_callback=buffers.append)
assert (
    sum(b.raw().nbytes for b in buffers) == voxels.nbytes
), "voxels go beside the pickle, where a reader takes them so"
# In another process, as multiprocessing and joblib send work.
worker = "import pickle, sys; call, a, k = pickle.load(sys.stdin.buffer); sys.stdout.buffer.write(pickle.dumps(call(*a, **k)))"
done = subprocess.run(
    [sys.executable, "-c", worker],
    input=pickle.dumps((osteo.threshold, (ct,), {"lower": 500})),
    stdout=subprocess.PIPE,
    check=True,
)
same(pickle.loads(done.stdout), osteo.threshold(ct, lower=500))
fails(lambda: np.asarray(osteo.Grid(np.ones((2, 2, 2), np.float32))), 2, "dense()", TypeError)

# A file that is there is not replaced unchecked.
with tempfile.TemporaryDirectory() as folder:
    file = pathlib.Path(folder) / "ct.nrrd"
    osteo.save(ct, file)
    kept = file.read_bytes()
    fails(lambda: osteo.save(turned, file), 6, "exists already")
    assert file.read_bytes() == kept
    osteo.save(turned, file, force=True)
    assert file.read_bytes() != kept and osteo.load(file).direction == turned.direction

small = osteo.Image(np.zeros((4, 4, 4), np.int16))
seconds = []
for _ in range(50):
    begun = time.perf_counter()
    osteo.threshold(small, lower=-500, threads=1)
    seconds.append(time.perf_counter() - begun)
print(
    f"{len(osteo.stages)} stages; threshold of 64 voxels: {min(seconds) * 1e3:.3f} ms a call at best, {sorted(seconds)[25] * 1e3:.3f} ms the median"
)

# From a phantom to a closed surface, all in memory.
made = osteo.phantom(spacing_mm=2.0, seed=1)
back = pickle.loads(pickle.dumps(made))
assert type(back) is type(made) and back._fields == made._fields
ct, *_ = made
bone = osteo.resample(ct, osteo.threshold(ct, lower=500), spacing_mm=2.0, lower=500)
bone = bone if isinstance(bone, osteo.Grid) else bone[0]
assert isinstance(bone, osteo.Grid) and bone.active_voxels > 1000
surface = osteo.surface(bone)
surface = surface if isinstance(surface, osteo.Surface) else surface[0]
assert surface.points_mm.dtype == np.float32 and surface.triangles.dtype == np.uint32
assert surface.triangles.max() == len(surface.points_mm) - 1
edges = np.sort(np.concatenate([surface.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1)
assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all(), "the surface is closed"
print(f"phantom: {bone.active_voxels} voxels, {len(surface.triangles)} triangles")

# A surface of one's own, and what is wrong with others.
same(osteo.Surface(surface.points_mm, surface.triangles, surface.normals), surface)
goes_round(surface)
goes_round(osteo.Surface(surface.points_mm, surface.triangles))
fails(lambda: np.asarray(surface), 2, "points_mm", TypeError)
fails(lambda: osteo.Surface(surface.points_mm[:3].copy(), surface.triangles), 2, "names point")
fails(lambda: osteo.Surface(surface.points_mm.astype(float), surface.triangles), 2, "float32", TypeError)
fails(lambda: osteo.Surface(surface.points_mm[:, :2].copy(), surface.triangles), 2, "(n, 3)", ValueError)
fails(lambda: osteo.Surface(surface.points_mm, surface.triangles, surface.normals[:2].copy()), 2, "normals")
assert osteo.__version__.count(".") == 2

# Documents: a dict goes in; JSON comes out as one, an input file of CalculiX as text.
corners = np.array([(x, y, z) for z in (-20, -10) for y in (20, 30) for x in (40, 50)], np.float32)
box = osteo.Surface(
    corners,
    np.array(
        [
            (0, 2, 3),
            (0, 3, 1),
            (4, 5, 7),
            (4, 7, 6),
            (0, 1, 5),
            (0, 5, 4),
            (2, 6, 7),
            (2, 7, 3),
            (0, 4, 6),
            (0, 6, 2),
            (1, 3, 7),
            (1, 7, 5),
        ],
        np.uint32,
    ),
)
mesh = osteo.tetrahedralize(box, method="grid", spacing_mm=2.5)
goes_round(mesh)
fails(lambda: np.asarray(mesh), 2, "tets", TypeError)
pressed = {
    "osteotome_tissue": 1,
    "material": {"young_kpa": 1000, "poisson": 0.3},
    "fixed": [{"box_mm": [[39, 19, -21], [51, 31, -19.9]]}],
    "loads": [{"name": "press", "forces": [{"box_mm": [[39, 19, -10.1], [51, 31, -9]], "total_n": [0, 0, -1]}]}],
}
solved = osteo.fem(mesh, pressed, law="linear")
assert isinstance(solved.report, dict) and abs(solved.report["reaction_n"][2] - 1) < 1e-6, solved.report
assert isinstance(solved.inp, str) and "*ELASTIC" in solved.inp and solved.nodes.startswith("<?xml")
fails(lambda: osteo.fem(mesh, {**pressed, "gravity": 1}), 2, "gravity")
fails(lambda: osteo.fem(box, pressed), 2, "mesh")
stiff = osteo.bone_stiffness(mesh, ct, pressed, density_per_1000_hu=0.75)
assert (
    stiff.report["materials"] > 3
    and abs(stiff.report["volume_mm3"] - 1000) < 1e-6
    and "*MATERIAL, NAME=M3" in stiff.inp
)

# VTK's own module, where it is.
try:
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonDataModel import vtkPolyData
except ImportError:
    print("VTK's module for Python is not installed: nothing is shared with it")
    sys.exit(0)


def address(array):
    return numpy_support.vtk_to_numpy(array).ctypes.data


turned = osteo.Image(
    voxels, spacing_mm=(0.5, 0.6, 0.7), origin_mm=(1, 2, 3), direction=((0, -1, 0), (1, 0, 0), (0, 0, 1))
)
image = osteo.to_vtk(turned)
assert address(image.GetPointData().GetScalars()) == voxels.ctypes.data, "shared"
assert image.GetDimensions() == (28, 24, 20) and image.GetScalarComponentAsDouble(7, 6, 5, 0) == 1200
place = [0.0, 0.0, 0.0]
image.TransformIndexToPhysicalPoint([1, 0, 0], place)
assert place == [1.0, 2.5, 3.0], place
back = osteo.from_vtk(image)
assert isinstance(back, osteo.Image) and back.voxels.ctypes.data == voxels.ctypes.data
assert (back.spacing_mm, back.origin_mm, back.direction) == (turned.spacing_mm, turned.origin_mm, turned.direction)
image.SetExtent(2, 29, 0, 23, 0, 19)
assert osteo.from_vtk(image).origin_mm == [1.0, 3.0, 3.0]
poly = osteo.to_vtk(surface)
assert address(poly.GetPoints().GetData()) == surface.points_mm.ctypes.data
assert address(poly.GetPolys().GetConnectivityArray()) == surface.triangles.ctypes.data
assert address(poly.GetPointData().GetNormals()) == surface.normals.ctypes.data
points, triangles = surface.points_mm.copy(), surface.triangles.copy()
del surface, bone
gc.collect()
back = osteo.from_vtk(poly)
assert np.array_equal(back.points_mm, points) and np.array_equal(
    back.triangles, triangles
), "the data set keeps the memory alive"
from vtkmodules.vtkFiltersCore import vtkMassProperties

mass = vtkMassProperties()
mass.SetInputData(poly)
p = points[triangles].astype(float)
assert np.isclose(mass.GetVolume(), np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6, rtol=1e-3)
assert len(osteo.from_vtk(vtkPolyData()).triangles) == 0
for wrong, error in ((lambda: osteo.to_vtk(3), TypeError), (lambda: osteo.from_vtk(3), TypeError)):
    try:
        wrong()
    except error:
        continue
    raise AssertionError("taken")
print("VTK shares voxels, points and corners")

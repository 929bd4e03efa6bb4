#!/usr/bin/env python3
"""The Python module as a script uses it: stages on arrays without copies, errors with codes, the same voxels as the program."""
import gc
import inspect
import sys
import time

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)
import osteo


def fails(call, code, word):
    try:
        call()
    except osteo.Error as e:
        assert e.code == code, (e.code, str(e))
        assert word in str(e), str(e)
        return
    raise AssertionError(f"no error that says {word}")


# Every stage is a function with a signature and help.
assert len(osteo.stages) > 20, osteo.stages
for name in osteo.stages:
    function = getattr(osteo, name)
    assert function.__doc__ and "Returns" in function.__doc__, name
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
fails(lambda: osteo.Image(voxels.astype(np.float64)), 2, "int16")
fails(lambda: osteo.Image(voxels[:, ::2]), 2, "contiguous")
fails(lambda: osteo.Image(voxels, spacing_mm=(0, 1, 1)), 4, "spacing")
fails(lambda: osteo.threshold(ct, lower="many"), 2, "lower")
fails(lambda: osteo.threshold(ct, lower=1e9), 2, "lower")
fails(lambda: osteo.threshold(3, lower=500), 2, "int")
fails(lambda: osteo.threshold("nothing-here.nrrd"), 3, "nothing-here")
try:
    osteo.threshold(ct, lowest=1)
    raise AssertionError("an unknown parameter was taken")
except TypeError as e:
    assert "lowest" in str(e)

small = osteo.Image(np.zeros((4, 4, 4), np.int16))
seconds = []
for _ in range(50):
    begun = time.perf_counter()
    osteo.threshold(small, lower=-500, threads=1)
    seconds.append(time.perf_counter() - begun)
print(f"{len(osteo.stages)} stages; threshold of 64 voxels: {min(seconds) * 1e3:.3f} ms a call at best, {sorted(seconds)[25] * 1e3:.3f} ms the median")

# From a phantom to a closed surface, all in memory.
ct, *_ = osteo.phantom(spacing_mm=2.0, seed=1)
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
copy = osteo.Surface(surface.points_mm, surface.triangles, surface.normals)
assert np.array_equal(copy.points_mm, surface.points_mm) and np.array_equal(copy.triangles, surface.triangles)
fails(lambda: osteo.Surface(surface.points_mm[:3].copy(), surface.triangles), 2, "names point")
fails(lambda: osteo.Surface(surface.points_mm.astype(float), surface.triangles), 2, "float32")
fails(lambda: osteo.Surface(surface.points_mm, surface.triangles, surface.normals[:2].copy()), 2, "normals")
assert osteo.__version__.count(".") == 2

# Documents: a dict goes in; JSON comes out as one, an input file of CalculiX as text.
corners = np.array([(x, y, z) for z in (-20, -10) for y in (20, 30) for x in (40, 50)], np.float32)
box = osteo.Surface(corners, np.array([(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
                                       (1, 3, 7), (1, 7, 5)], np.uint32))
mesh = osteo.tetrahedralize(box, method="grid", spacing_mm=2.5)
pressed = {"osteotome_tissue": 1, "material": {"young_kpa": 1000, "poisson": 0.3}, "fixed": [{"box_mm": [[39, 19, -21], [51, 31, -19.9]]}],
           "loads": [{"name": "press", "forces": [{"box_mm": [[39, 19, -10.1], [51, 31, -9]], "total_n": [0, 0, -1]}]}]}
solved = osteo.fem(mesh, pressed, law="linear")
assert isinstance(solved.report, dict) and abs(solved.report["reaction_n"][2] - 1) < 1e-6, solved.report
assert isinstance(solved.inp, str) and "*ELASTIC" in solved.inp and solved.nodes.startswith("<?xml")
fails(lambda: osteo.fem(mesh, {**pressed, "gravity": 1}), 2, "gravity")
fails(lambda: osteo.fem(box, pressed), 2, "mesh")
stiff = osteo.bone_stiffness(mesh, ct, pressed, density_per_1000_hu=0.75)
assert stiff.report["materials"] > 3 and abs(stiff.report["volume_mm3"] - 1000) < 1e-6 and "*MATERIAL, NAME=M3" in stiff.inp

# VTK's own module, where it is.
try:
    from vtkmodules.util import numpy_support
    from vtkmodules.vtkCommonDataModel import vtkPolyData
except ImportError:
    print("VTK's module for Python is not installed: nothing is shared with it")
    sys.exit(0)


def address(array):
    return numpy_support.vtk_to_numpy(array).ctypes.data


turned = osteo.Image(voxels, spacing_mm=(0.5, 0.6, 0.7), origin_mm=(1, 2, 3), direction=((0, -1, 0), (1, 0, 0), (0, 0, 1)))
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
assert np.array_equal(back.points_mm, points) and np.array_equal(back.triangles, triangles), "the data set keeps the memory alive"
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

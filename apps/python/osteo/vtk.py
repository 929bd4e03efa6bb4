"""Values as data sets of VTK's own Python module and back. Needs it: python3-vtk9 of Debian, or vtk of PyPI."""

from __future__ import annotations

import typing as _t

import numpy as _np

from . import _osteo

if _t.TYPE_CHECKING:
    from . import Field, Image, Labels, Surface


def _modules() -> tuple[_t.Any, _t.Any]:
    from vtkmodules import vtkCommonCore, vtkCommonDataModel  # type: ignore[import-untyped,import-not-found,unused-ignore]

    return vtkCommonCore, vtkCommonDataModel


def _array(core: _t.Any, kind: str, values: _t.Any, components: int, name: str) -> _t.Any:
    array = getattr(core, kind)()
    array.SetName(name)
    array.SetNumberOfComponents(components)
    array.SetVoidArray(values, values.size, 1)  # 1: VTK does not free it
    array._shared = (
        values  # what it lies in lives as long as this object of Python, which VTK keeps as long as the array
    )
    return array


def to_vtk(value: Image | Labels | Field | Surface) -> _t.Any:
    """vtkImageData of voxels, vtkPolyData of a surface. Voxels, points, normals and corners are shared, not copied: VTK must not write them. Of a
    surface only where each triangle begins is made anew, 4 bytes for each. The data set may be kept longer than the value; an array that VTK makes around the memory of
    one of its arrays (ShallowCopy of an array) may not be kept longer than that one."""
    core, model = _modules()
    if isinstance(value, _osteo.Surface):
        points, triangles, normals = _osteo.shared_with_vtk(value)
        poly = model.vtkPolyData()
        if points is None:
            return poly
        at = core.vtkPoints()
        at.SetData(_array(core, "vtkFloatArray", points, 3, "points"))
        poly.SetPoints(at)
        if triangles is not None:
            begins = _np.arange(0, 3 * len(triangles) + 1, 3, dtype=_np.int32)
            cells = model.vtkCellArray()
            corners = triangles.view(_np.int32).reshape(-1)
            cells.SetData(
                _array(core, "vtkTypeInt32Array", begins, 1, "begins"),
                _array(core, "vtkTypeInt32Array", corners, 1, "corners"),
            )
            # Cells make arrays of their own around the same memory.
            cells.GetOffsetsArray()._shared = begins
            cells.GetConnectivityArray()._shared = corners
            poly.SetPolys(cells)
        if normals is not None:
            poly.GetPointData().SetNormals(_array(core, "vtkFloatArray", normals, 3, "normals"))
        return poly
    if not isinstance(value, (_osteo.Image, _osteo.Labels, _osteo.Field)):
        raise TypeError(
            f"to_vtk takes an Image, Labels, a Field or a Surface, not {type(value).__name__}"
            + ("; dense() makes a Field of it" if isinstance(value, _osteo.Grid) else "")
        )
    voxels = _osteo.shared_with_vtk(value)
    kind = {"int16": "vtkShortArray", "uint8": "vtkUnsignedCharArray", "float32": "vtkFloatArray"}[str(voxels.dtype)]
    image = model.vtkImageData()
    image.SetDimensions(*reversed(value.shape))
    image.SetSpacing(*value.spacing_mm)
    image.SetOrigin(*value.origin_mm)
    image.SetDirectionMatrix([x for row in value.direction for x in row])
    image.GetPointData().SetScalars(_array(core, kind, voxels, 1, "voxels"))
    return image


def from_vtk(data: _t.Any) -> Image | Labels | Field | Surface:
    """Of vtkImageData with scalars of short, unsigned char or float an Image, Labels or a Field, whose voxels are VTK's own; of vtkPolyData with
    triangles a Surface, copied. Other scalars and cells are refused: vtkImageCast, vtkTriangleFilter and vtkCleanPolyData make these of them.
    """
    _, model = _modules()
    from vtkmodules.util import numpy_support  # type: ignore[import-untyped,import-not-found,unused-ignore]

    if isinstance(data, model.vtkImageData):
        scalars = data.GetPointData().GetScalars()
        if scalars is None or scalars.GetNumberOfComponents() != 1:
            raise ValueError("the image has no scalars, or several to a voxel")
        voxels = numpy_support.vtk_to_numpy(scalars).reshape(tuple(reversed(data.GetDimensions())))
        kinds = {"int16": _osteo.Image, "uint8": _osteo.Labels, "float32": _osteo.Field}
        if str(voxels.dtype) not in kinds:
            raise ValueError(f"voxels are {voxels.dtype}; int16, uint8 or float32 are taken: vtkImageCast makes those")
        m = data.GetDirectionMatrix()
        rows = [[m.GetElement(i, j) for j in range(3)] for i in range(3)]
        # An extent that does not begin at 0 moves the first voxel.
        first = [float(data.GetExtent()[2 * a]) * data.GetSpacing()[a] for a in range(3)]
        origin = [data.GetOrigin()[i] + sum(rows[i][a] * first[a] for a in range(3)) for i in range(3)]
        return _t.cast("Image | Labels | Field", kinds[str(voxels.dtype)](voxels, data.GetSpacing(), origin, rows))
    if isinstance(data, model.vtkPolyData):
        polys = data.GetPolys()
        if data.GetNumberOfStrips() or data.GetNumberOfLines() or data.GetNumberOfVerts():
            raise ValueError(
                "the data set has strips, lines or points beside its polygons; vtkTriangleFilter leaves triangles alone"
            )
        corners = numpy_support.vtk_to_numpy(polys.GetConnectivityArray())
        begins = numpy_support.vtk_to_numpy(polys.GetOffsetsArray())
        if len(begins) > 1 and not (_np.diff(begins) == 3).all():
            raise ValueError("not all cells are triangles; vtkTriangleFilter makes them so")
        if data.GetNumberOfPoints() == 0:
            return _t.cast("Surface", _osteo.Surface(_np.zeros((0, 3), _np.float32), _np.zeros((0, 3), _np.uint32)))
        points = numpy_support.vtk_to_numpy(data.GetPoints().GetData())
        normals = data.GetPointData().GetNormals()
        contiguous = _np.ascontiguousarray
        return _t.cast(
            "Surface",
            _osteo.Surface(
                contiguous(points, dtype=_np.float32),
                contiguous(corners.reshape(-1, 3), dtype=_np.uint32),
                None if normals is None else contiguous(numpy_support.vtk_to_numpy(normals), dtype=_np.float32),
            ),
        )
    raise TypeError(f"from_vtk takes vtkImageData or vtkPolyData, not {type(data).__name__}")

"""What the examples draw with: numpy and the letters of VTK's own Python module (python3-vtk9), so that they run without a display and without
matplotlib. Pictures are arrays (rows, columns, 3) of uint8, as osteo.snapshot gives them and osteo.save takes them."""

import numpy as np
import vtkmodules.vtkRenderingFreeType  # noqa: F401  (brings the letters)
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkRenderingCore import vtkTextProperty, vtkTextRenderer

INK, GREY, COLOURS = (40, 40, 40), (222, 222, 222), ((192, 57, 43), (44, 127, 184), (65, 171, 93), (120, 120, 120))


def blend(picture, row, column, share, colour):
    """Lays colour over the picture, as much of it as share (0 to 1) says; what lies outside is left out."""
    r0, c0 = max(row, 0), max(column, 0)
    r1, c1 = min(row + share.shape[0], picture.shape[0]), min(column + share.shape[1], picture.shape[1])
    if r0 < r1 and c0 < c1:
        share = share[r0 - row : r1 - row, c0 - column : c1 - column, None]
        under = picture[r0:r1, c0:c1]
        under[...] = np.rint((1 - share) * under + share * np.array(colour))


def write(picture, row, column, words, size=14, colour=INK, at=0.0, turned=False):
    """Words whose middle lies on the row; at says where the column is in them: 0 their beginning, 0.5 the middle, 1 the end."""
    letters, shape, box = vtkTextProperty(), vtkImageData(), [0, 0]
    letters.SetFontSize(size)
    vtkTextRenderer.GetInstance().RenderString(letters, words, shape, box, 72)
    wide, high, _ = shape.GetDimensions()
    share = (
        vtk_to_numpy(shape.GetPointData().GetScalars()).reshape(high, wide, -1)[box[1] :: -1, : box[0] + 1, -1] / 255
    )
    share = np.rot90(share) if turned else share
    over = (0.5, at) if not turned else (at, 0.5)
    blend(picture, round(row - over[0] * share.shape[0]), round(column - over[1] * share.shape[1]), share, colour)


def line(picture, rows, columns, colour=INK, width=1.8):
    """A line through the points, its edges smoothed."""
    for r0, c0, r1, c1 in zip(rows[:-1], columns[:-1], rows[1:], columns[1:]):
        low, high = int(min(r0, r1) - width - 1), int(max(r0, r1) + width + 2)
        left, right = int(min(c0, c1) - width - 1), int(max(c0, c1) + width + 2)
        r, c = np.mgrid[low:high, left:right].astype(float)
        along = np.clip(
            ((r - r0) * (r1 - r0) + (c - c0) * (c1 - c0)) / max((r1 - r0) ** 2 + (c1 - c0) ** 2, 1e-9), 0, 1
        )
        off = np.hypot(r - r0 - along * (r1 - r0), c - c0 - along * (c1 - c0))
        blend(picture, low, left, np.clip(width / 2 + 0.5 - off, 0, 1), colour)


def enlarged(values, times):
    """A slice with more pixels, straight lines between the values that it has."""
    for axis in 0, 1:
        n = values.shape[axis]
        at = np.clip((np.arange(n * times) + 0.5) / times - 0.5, 0, n - 1)
        low = np.minimum(at.astype(int), n - 2)
        share = (at - low).reshape((-1, 1) if axis == 0 else (1, -1))
        values = (1 - share) * np.take(values, low, axis) + share * np.take(values, low + 1, axis)
    return values


def ticks(low, high, log):
    """Round numbers between two: powers of ten, or four to ten steps."""
    if log:
        return 10.0 ** np.arange(np.ceil(np.log10(low) - 1e-9), np.log10(high) + 1e-9)
    step = 10.0 ** np.floor(np.log10((high - low) / 4))
    step *= max(k for k in (1, 2, 5) if (high - low) / (k * step) >= 4)
    return np.arange(np.ceil(low / step - 1e-9), high / step + 1e-9) * step + 0.0


def plot(curves, x, y, width=560, height=400, log=False, dots=()):
    """A picture of curves [(name, xs, ys), ...] with axes called x and y; of those whose name is in dots only the points."""
    picture = np.full((height, width, 3), 255, np.uint8)
    top, bottom, left, right = 34, height - 52, 74, width - 18
    scale = np.log10 if log else np.asarray
    xs, ys = (np.concatenate([np.asarray(c[k], float) for c in curves]) for k in (1, 2))
    (x0, x1), (y0, y1) = (xs.min(), xs.max()), (ys.min(), ys.max())
    y0, y1 = (y0 / 2, y1 * 2) if log else (y0 - 0.04 * (y1 - y0), y1 + 0.04 * (y1 - y0))
    column = lambda v: left + (scale(v) - scale(x0)) / (scale(x1) - scale(x0)) * (right - left)
    row = lambda v: bottom - (scale(v) - scale(y0)) / (scale(y1) - scale(y0)) * (bottom - top)
    for v in ticks(x0, x1, log):
        line(picture, [top, bottom], [column(v)] * 2, GREY, 1)
        write(picture, bottom + 14, column(v), f"{v:g}", 13, at=0.5)
    for v in ticks(y0, y1, log):
        line(picture, [row(v)] * 2, [left, right], GREY, 1)
        write(picture, row(v), left - 8, f"{v:g}", 13, at=1)
    write(picture, height - 16, (left + right) / 2, x, 14, at=0.5)
    write(picture, (top + bottom) / 2, 16, y, 14, at=0.5, turned=True)
    place = left
    for (name, xs, ys), colour in zip(curves, COLOURS):
        if name in dots:
            for r, c in zip(row(np.asarray(ys, float)), column(np.asarray(xs, float))):
                line(picture, [r, r], [c, c], colour, 7)
        else:
            line(picture, row(np.asarray(ys, float)), column(np.asarray(xs, float)), colour)
        line(picture, [16, 16], [place, place + 18], colour, 3)
        write(picture, 16, place + 24, name, 13)
        place += 44 + 7.4 * len(name)
    return picture


def beside(*pictures):
    """Pictures side by side, on white."""
    high = max(p.shape[0] for p in pictures)
    return np.hstack([np.pad(p, ((0, high - p.shape[0]), (0, 0), (0, 0)), constant_values=255) for p in pictures])

#!/usr/bin/env python3
"""Writes __init__.pyi of the built package: types of every stage, from the stages' declarations. usage: make_stubs.py PACKAGE_FOLDER"""

import inspect
import pathlib
import sys

package = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(package.parent))
try:
    import osteo
    from osteo import _osteo
except ImportError as e:
    if e.name != "numpy":
        raise
    print("types of the module for Python are left out: numpy is not installed")
    sys.exit(0)

HEAD = '''# Made from the stages' declarations.
import os
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, NoReturn, TypeVar

import numpy
import numpy.typing

from . import _osteo as _osteo
from .rehearsals import Rehearsal as Rehearsal, Script as Script, action_dtype as action_dtype, goal_dtype as goal_dtype, goals as goals
from .rehearsals import load_script as load_script, tick_dtype as tick_dtype, tools as tools
from .sessions import Session as Session
from .vtk import from_vtk as from_vtk, to_vtk as to_vtk

__version__: str
__all__: list[str]
stages: list[str]

_Triple = Sequence[float]
_Rows = Sequence[Sequence[float]]

class Error(RuntimeError):
    code: int
    advice: str

class WrongValue(Error, ValueError): ...
class WrongType(Error, TypeError): ...

_Value = TypeVar("_Value", bound="_Copied")

class _Copied:
    def __copy__(self: _Value) -> _Value: ...
    def __deepcopy__(self: _Value, memo: dict[int, Any]) -> _Value: ...

class _Placed(_Copied):
    @property
    def spacing_mm(self) -> list[float]: ...
    @property
    def origin_mm(self) -> list[float]: ...
    @property
    def direction(self) -> list[list[float]]: ...
    @property
    def shape(self) -> list[int]: ...

'''
VOLUME = '''class {name}(_Placed):
    def __init__(self, voxels: numpy.typing.NDArray[numpy.{scalar}], spacing_mm: _Triple = ..., origin_mm: _Triple = ..., direction: _Rows = ...) -> None: ...
    @property
    def voxels(self) -> numpy.typing.NDArray[numpy.{scalar}]: ...
    def __array__(self, dtype: numpy.typing.DTypeLike = ..., copy: bool | None = ...) -> numpy.typing.NDArray[Any]: ...
    def __dlpack__(self, *, stream: None = ..., max_version: tuple[int, int] | None = ..., dl_device: tuple[int, int] | None = ..., copy: bool | None = ...) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...

'''
REST = '''class Grid(_Placed):
    def __array__(self, *args: Any, **kwargs: Any) -> NoReturn: ...
    def __init__(self, voxels: numpy.typing.NDArray[numpy.float32], spacing_mm: _Triple = ..., origin_mm: _Triple = ..., direction: _Rows = ..., background: float = ..., name: str = ...) -> None: ...
    def dense(self, lo: Sequence[int] = ..., shape: Sequence[int] | None = ...) -> Field: ...
    @property
    def name(self) -> str: ...
    @property
    def background(self) -> float: ...
    @property
    def active_voxels(self) -> int: ...

class Surface(_Copied):
    def __array__(self, *args: Any, **kwargs: Any) -> NoReturn: ...
    def __init__(self, points_mm: numpy.typing.NDArray[numpy.float32], triangles: numpy.typing.NDArray[numpy.uint32], normals: numpy.typing.NDArray[numpy.float32] | None = ...) -> None: ...
    @property
    def points_mm(self) -> numpy.typing.NDArray[numpy.float32]: ...
    @property
    def normals(self) -> numpy.typing.NDArray[numpy.float32]: ...
    @property
    def triangles(self) -> numpy.typing.NDArray[numpy.uint32]: ...

class Tets(_Copied):
    def __array__(self, *args: Any, **kwargs: Any) -> NoReturn: ...
    @property
    def points_mm(self) -> numpy.typing.NDArray[numpy.float32]: ...
    @property
    def tets(self) -> numpy.typing.NDArray[numpy.uint32]: ...

def load(path: str | os.PathLike[str], kind: str = ...) -> Any: ...
def save(value: Image | Labels | Grid | Surface | Tets | numpy.typing.NDArray[numpy.uint8], path: str | os.PathLike[str], *, force: bool = ...) -> None: ...

'''
TYPES = {
    "os.PathLike | str": "os.PathLike[str] | str",
    "numpy.ndarray": "numpy.typing.NDArray[numpy.uint8]",
    "dict": "dict[str, Any]",
}


def typed(annotation):
    return " | ".join(
        TYPES.get(part, part) for part in annotation.replace("os.PathLike | str", "os.PathLike[str] | str").split(" | ")
    )


def stub_of(name, declaration):
    """A function of Python, and of more than one output the tuple that it returns."""
    signature = inspect.signature(getattr(osteo, name))
    choices = {f["name"].replace("-", "_"): f["choices"] for f in declaration["fields"] if f["choices"]}
    parameters, keyword_only = [], False
    for p in signature.parameters.values():
        if p.kind is p.KEYWORD_ONLY and not keyword_only:
            keyword_only = True
            parameters.append("*")
        kind = f"Literal[{', '.join(repr(c) for c in choices[p.name])}]" if p.name in choices else typed(p.annotation)
        parameters.append(f"{p.name}: {kind}" + ("" if p.default is p.empty else " = ..."))
    outputs = declaration["outputs"]
    kinds = [typed(osteo._output_type(o)) for o in outputs]
    text = ""
    returns = kinds[0]
    if len(outputs) > 1:
        returns = f"_{name}_result"
        fields = [osteo._identifier(o["name"]) for o in outputs]
        text += f"class {returns}(NamedTuple):\n" + "".join(f"    {f}: {k}\n" for f, k in zip(fields, kinds)) + "\n"
    return text + f"def {name}({', '.join(parameters)}) -> {returns}: ...\n"


declared = {osteo._identifier(d["name"]): d for d in _osteo.declarations()}
text = (
    HEAD
    + "".join(
        VOLUME.format(name=n, scalar=s) for n, s in (("Image", "int16"), ("Labels", "uint8"), ("Field", "float32"))
    )
    + REST
)
text += "".join(stub_of(name, declared[name]) for name in osteo.stages)
(package / "__init__.pyi").write_text(text)
# What lies below is not for others.
(package / "_osteo.pyi").write_text("from typing import Any\n\ndef __getattr__(name: str) -> Any: ...\n")

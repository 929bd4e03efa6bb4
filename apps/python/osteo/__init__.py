"""Stages of Osteotome as functions on numpy arrays. Each function, its signature and its help are made from the stage's declaration.

import osteo
ct, labels = osteo.phantom(region="temporal", spacing_mm=1.0)
bone = osteo.threshold(ct, lower=500)
"""

import inspect as _inspect
import keyword as _keyword
import os as _os
import warnings as _warnings
from collections import namedtuple as _namedtuple

# A wheel brings along the names of DICOM's attributes, which the library looks for in the environment.
_dictionary = _os.path.join(_os.path.dirname(__file__), "data", "dicom.dic")
if _os.path.exists(_dictionary):
    _os.environ.setdefault("DCMDICTPATH", _dictionary)

from . import _osteo
from ._osteo import Error, Field, Grid, Image, Labels, Surface, Tets, WrongType, WrongValue, __version__
from .rehearsals import Rehearsal, Script, action_dtype, goal_dtype, goals, load_script, tick_dtype, tools
from .sessions import Session
from .vtk import from_vtk, to_vtk

_types = {
    "source": "os.PathLike | str",
    "image": "Image",
    "labels": "Labels",
    "grid": "Grid",
    "surface": "Surface",
    "tets": "Tets",
    "picture": "numpy.ndarray",
    "document": "dict",
}
# An .inp, .svg or .vtu that a stage makes is a text.
_made = {**_types, "document": "dict | str"}
_params = {
    "flag": "bool",
    "int": "int",
    "number": "float",
    "text": "str",
    "triple": "Sequence[float]",
    "list": "Sequence[int]",
    "choice": "str",
}


_old_stages, _old_fields = _osteo.old_names()


def _renamed(old, current):
    _warnings.warn(
        f"{old} is now called {current}; the old name is accepted until version 0.3", DeprecationWarning, stacklevel=3
    )


def _identifier(name):
    name = name.replace("-", "_").replace(" ", "_")
    return name + "_" if _keyword.iskeyword(name) else name


def _input_type(port):
    text = " | ".join(dict.fromkeys([_types[k] for k in port["kinds"]] + [_types["source"]]))
    return text + " | None" if port["optional"] else text


def _output_type(port):
    return _made[port["kinds"][0]] + (" | None" if port["optional"] else "")


def _signature(stage):
    P = _inspect.Parameter
    ports = [
        P(
            _identifier(p["name"]),
            P.POSITIONAL_OR_KEYWORD,
            default=None if p["optional"] else P.empty,
            annotation=_input_type(p),
        )
        for p in stage["inputs"]
    ]
    taken = {p.name for p in ports} | {"threads", "seed", "report"}
    # A port and a parameter of one name: the parameter gets an underscore.
    names = {}
    for f in stage["fields"]:
        name = _identifier(f["name"])
        while name in taken:
            name += "_"
        taken.add(name)
        names[name] = f
    fields = [P(name, P.KEYWORD_ONLY, default=f["default"], annotation=_params[f["kind"]]) for name, f in names.items()]
    common = [
        P("threads", P.KEYWORD_ONLY, default=0, annotation="int"),
        P("seed", P.KEYWORD_ONLY, default=1, annotation="int"),
        P("report", P.KEYWORD_ONLY, default=None, annotation="dict | None"),
    ]
    outputs = [_output_type(p) for p in stage["outputs"]]
    returns = outputs[0] if len(outputs) == 1 else f"tuple[{', '.join(outputs)}]"
    return _inspect.Signature(ports + fields + common, return_annotation=returns), {
        n: f["name"] for n, f in names.items()
    }


def _help(stage, fields):
    lines = [stage["synopsis"], "", stage["description"], ""]
    lines += [f"{_identifier(p['name'])}: {p['help']}" for p in stage["inputs"]]
    by_name = {f["name"]: f for f in stage["fields"]}
    for name, original in fields.items():
        f = by_name[original]
        limits = (
            f" ({f['lo']:g} to {f['hi']:g})" if abs(f["lo"]) != float("inf") and abs(f["hi"]) != float("inf") else ""
        )
        unit = f" [{f['unit']}]" if f["unit"] else ""
        choices = f" (one of {', '.join(f['choices'])})" if f["choices"] else ""
        lines.append(f"{name}: {f['help']}{unit}{limits}{choices}")
    lines += [
        "threads: 0 takes all cores; the result never depends on it",
        "seed: for every random choice",
        "report: a dict that is filled with what the stage measured",
        "",
    ]
    lines += [f"Returns {_identifier(p['name'])}: {p['help']}" for p in stage["outputs"]]
    return _osteo.python_words("\n".join(lines))


def _function(stage):
    signature, fields = _signature(stage)
    name = stage["name"]
    ports = [_identifier(p["name"]) for p in stage["inputs"]]
    outputs = [_identifier(p["name"]) for p in stage["outputs"]]
    result = (
        _namedtuple(f"_{_identifier(name)}_result", outputs, rename=True, module=__name__) if len(outputs) > 1 else None
    )
    if result is not None:
        globals()[result.__name__] = result  # where pickle looks for it

    def function(*args, **kwargs):
        for old in [k for k in kwargs if k not in fields and _old_fields.get(k) in fields]:
            _renamed(old, _old_fields[old])
            kwargs[_old_fields[old]] = kwargs.pop(old)
        given = signature.bind(*args, **kwargs).arguments
        params = {fields[k]: v for k, v in given.items() if k in fields}
        values, measured, warned = _osteo.run(
            name, [given.get(p) for p in ports], params, given.get("threads", 0), given.get("seed", 1)
        )
        for text in warned:
            _warnings.warn(text, stacklevel=2)
        if given.get("report") is not None:
            given["report"].update(measured)
        return values[0] if result is None else result(*values)

    function.__name__ = function.__qualname__ = _identifier(name)
    function.__module__ = __name__
    function.__signature__ = signature
    function.__doc__ = _help(stage, fields)
    return function


def load(path, kind=""):
    """The value in a file, by its suffix: an Image, Grid, Surface, Tets, a picture or a document. Voxels of a label map want kind="labels"."""
    return _osteo.load(_os.fspath(path), kind)


def save(value, path, *, force=False):
    """Writes a value, or a picture (uint8, rows, columns, 3), whole or not at all; the suffix says as what. A file that is there is an Error (code 6)
    unless force is True."""
    _osteo.save(value, _os.fspath(path), force)


stages = []
for _stage in _osteo.declarations():
    _f = _function(_stage)
    if _f.__name__ in globals():
        raise ImportError(f"stage {_stage['name']} has the name of another thing in this module")
    globals()[_f.__name__] = _f
    stages.append(_f.__name__)
__all__ = [
    "Error",
    "Field",
    "Grid",
    "Image",
    "Labels",
    "Rehearsal",
    "Script",
    "Session",
    "Surface",
    "Tets",
    "WrongType",
    "WrongValue",
    "action_dtype",
    "from_vtk",
    "goal_dtype",
    "goals",
    "load",
    "load_script",
    "save",
    "stages",
    "tick_dtype",
    "to_vtk",
    "tools",
    *stages,
]


def __getattr__(name):
    for old, current in _old_stages.items():
        if _identifier(old) == name and _identifier(current) in stages:
            _renamed(name, _identifier(current))
            return globals()[_identifier(current)]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

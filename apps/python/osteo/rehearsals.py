"""The servo of a rehearsal, stepped by a script."""

from __future__ import annotations

import json as _json
import os as _os
import typing as _t
import warnings as _warnings

import numpy as _np
import numpy.typing as _npt

from . import _osteo

if _t.TYPE_CHECKING:
    from . import Grid, Surface

Records = _npt.NDArray[_t.Any]
_Path = _t.Union[str, "_os.PathLike[str]"]

goal_dtype: _np.dtype[_t.Any] = _osteo.goal_dtype()
tick_dtype: _np.dtype[_t.Any] = _osteo.tick_dtype()
action_dtype: _np.dtype[_t.Any] = _osteo.action_dtype()
tools: list[str] = _osteo.tools()


def goals(
    position_mm: _npt.ArrayLike, *, axis: _npt.ArrayLike = (0, 0, 1), pedal: _npt.ArrayLike = 1.0, tool: str | int = 3
) -> Records:
    """Goals of one hand, one for each tick.

    position_mm: (ticks, 3), where the tip's centre is to be, LPS
    axis: from the tip to the handle, one for all or (ticks, 3); made of length 1
    pedal: how far down, 0 to 1, one for all or one for each tick
    tool: its name, or its number in osteo.tools
    """
    at = _np.asarray(position_mm, dtype=float)
    if at.ndim != 2 or at.shape[1] != 3:
        raise ValueError(f"position_mm has shape {at.shape}, not (ticks, 3)")
    down = _np.asarray(pedal, dtype=float)
    if not ((down >= 0) & (down <= 1)).all():
        raise ValueError("pedal goes from 0 to 1")
    along = _np.asarray(axis, dtype=float)
    length = _np.linalg.norm(along, axis=-1, keepdims=True)
    if not (length > 0).all() or not _np.isfinite(length).all():
        raise ValueError("axis is a direction: finite, and not of length 0")
    if isinstance(tool, str):
        if tool not in tools:
            raise ValueError(f"there is no tool {tool!r}; osteo.tools names them all")
        tool = tools.index(tool)
    all_goals = _np.zeros(len(at), goal_dtype)
    all_goals["position_mm"] = at
    all_goals["axis"] = along / length
    all_goals["pedal"] = _np.rint(255 * down)
    all_goals["tool"] = tool
    return all_goals


def _padded(records: Records, wanted: _np.dtype[_t.Any]) -> Records:
    """numpy.concatenate and the like leave out what lies between fields; the same fields are put back where they belong."""
    given = _np.asarray(records)
    fields = given.dtype.fields
    if given.dtype == wanted or fields is None or wanted.fields is None:
        return given
    if {n: f[0] for n, f in fields.items()} != {n: f[0] for n, f in wanted.fields.items()}:
        return given
    return given.astype(wanted)


class Script(_t.NamedTuple):
    """goals: one for each tick, (ticks, hands) where there are several; actions: what else is done, by tick."""

    goals: Records
    actions: Records


def load_script(path: _Path, rate_hz: float = 1000) -> Script:
    """A script of strokes (docs/formats/session-format.md) as goals and actions; followed on springs they give the session of
    `osteo rehearse --headless --script`, bit for bit."""
    return Script(*_osteo.script(_os.fspath(path), rate_hz))


class Rehearsal:
    """A rehearsal that runs when it is told to: run() takes a goal for each tick and gives a record for each. Not in real time, without threads:
    the same goals give the same bits.

    bone: the folder of a case, or a Grid of densities by itself (nothing else is known of it then, and nothing recorded)
    hand: "spring" holds the tool on a damped spring to its goals, as scripts and mice do; "exact" puts it there, whatever it meets
    contact: how the burr feels bone: rays, volume, overlap or proxy
    settings: a file of settings, or a dict of them by name; without, haptics.json of the case where there is one
    procedure: of the operation, a file or a built-in name such as "mastoidectomy": what it opens is not at risk
    out: folder for the session, which is recorded then; `resume`: a session at whose end this begins
    surface: keep the surface up (its hash is in the summary); without it is quicker
    """

    def __init__(
        self,
        bone: Grid | _Path,
        *,
        hand: _t.Literal["spring", "exact"] = "spring",
        hands: int = 1,
        contact: str = "overlap",
        settings: _Path | dict[str, _t.Any] | None = None,
        procedure: _Path | None = None,
        out: _Path | None = None,
        resume: _Path | None = None,
        rate_hz: float = 1000,
        surface: bool = True,
        threads: int = 0,
    ) -> None:
        if hand not in ("spring", "exact"):
            raise ValueError(f"hand is 'spring' or 'exact', not {hand!r}")
        text = {name: "" if path is None else _os.fspath(path) for name, path in (("out", out), ("resume", resume))}
        if out is not None and not text["out"]:
            raise ValueError("out is empty")
        self._servo = _osteo.Stepped(
            bone,
            hand == "spring",
            hands,
            contact,
            settings,
            procedure,
            text["out"],
            text["resume"],
            rate_hz,
            surface,
            threads,
        )
        self._warn()

    def _warn(self) -> None:
        for text in self._servo.take_warnings():
            _warnings.warn(text, stacklevel=3)

    def run(self, goals: Records, actions: Records | None = None) -> Records:
        """A tick for each goal. Returns their records, as Session.ticks has them: force_n, removed_mm3, flags, ... Of several hands goals and
        records are (ticks, hands). actions: of osteo.action_dtype, ticks counted from the beginning of the rehearsal; one that could not be
        done is a warning, and stands in the summary. Ctrl-C ends it between two ticks."""
        records: Records = self._servo.run(
            _padded(goals, goal_dtype), None if actions is None else _padded(actions, action_dtype)
        )
        self._warn()
        return records

    def bone(self, piece: int = 0) -> Grid:
        """The densities as they are now; a copy."""
        return self._servo.bone(piece)

    def surface(self) -> Surface:
        """Of all pieces as they are now."""
        return self._servo.surface()

    def note(self, kind: str, value: _t.Any) -> None:
        """Something that does not touch physics, at the tick that comes next: kept in the session."""
        self._servo.note(kind, _json.dumps(value, allow_nan=False))

    @property
    def removed_mm3(self) -> float:
        return float(self._servo.removed_mm3)

    @property
    def ticks(self) -> int:
        return int(self._servo.ticks)

    @property
    def rate_hz(self) -> float:
        return float(self._servo.rate_hz)

    def close(self) -> dict[str, _t.Any]:
        """Ends it, closes the session with its summary.json, and tells what came of it. Again: the same."""
        summary: dict[str, _t.Any] = self._servo.close()
        self._warn()
        return summary

    def __enter__(self) -> Rehearsal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

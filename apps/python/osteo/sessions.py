"""Recorded sessions as numpy arrays."""

import os as _os
import pathlib as _pathlib
import typing as _t

import numpy as _np
import numpy.typing as _npt

from . import _osteo

Records = _npt.NDArray[_t.Any]


class Session:
    """A session in memory: a folder that `osteo rehearse` or Rehearsal made, or its stream.oss.

    ticks: one record for each tick and hand, fields as in docs/formats/session-format.md; those of three coordinates are one field: position_mm, axis,
        force_n, torque_n_mm, shown_offset_mm
    changes: voxel and its density from then on, in the order written
    actions: what else was done; values as docs/reference/actions.md says for each kind, changes_before: how many of changes came before it
    notes: dicts of tick, kind and value
    header: dict of rate_hz, settings, hands, tools, ...; `fields` are those that the file has, others of ticks are 0
    end: dict of hashes and sums, or None where the program was stopped before it could close the file
    losses: what is missing, a line each; empty when the session is whole

    The arrays are the memory that the file was read into, not copies, and cannot be written. damaged: "refuse" raises Error (code 4) for a file
    that is damaged in the middle, "keep" reads what comes before and behind.
    """

    path: _pathlib.Path
    header: dict[str, _t.Any]
    ticks: Records
    changes: Records
    actions: Records
    notes: list[dict[str, _t.Any]]
    end: dict[str, _t.Any] | None
    losses: list[str]

    def __init__(self, path: str | _os.PathLike[str], *, damaged: _t.Literal["refuse", "keep"] = "refuse") -> None:
        if damaged not in ("refuse", "keep"):
            raise ValueError(f"damaged is 'refuse' or 'keep', not {damaged!r}")
        self.path = _pathlib.Path(path)
        file = self.path / "stream.oss" if self.path.is_dir() else self.path
        read = _osteo.session(str(file), damaged == "keep")
        self.header, self.end, self.losses, self.notes = read["header"], read["end"], read["losses"], read["notes"]
        self.ticks, self.changes, self.actions = read["ticks"], read["changes"], read["actions"]

    @property
    def rate_hz(self) -> float:
        return float(self.header["rate_hz"])

    def of_hand(self, hand: int = 0) -> Records:
        """The ticks of one hand. All of them, and no copy, where there is one hand only; else a view with a stride, over gaps a copy."""
        hands = self.header["hands"]
        if not 0 <= hand < hands:
            raise IndexError(f"there is no hand {hand} among {hands}")
        if len(self.ticks) % hands == 0 and (self.ticks["hand"].reshape(-1, hands) == _np.arange(hands)).all():
            return self.ticks[hand::hands]
        return self.ticks[self.ticks["hand"] == hand]

    def __repr__(self) -> str:
        return f"<Session {self.path.name}: {len(self.ticks)} ticks, {len(self.changes)} changes, {len(self.actions)} actions>"

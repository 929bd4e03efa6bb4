#!/usr/bin/env python3
"""Sessions as arrays, and a rehearsal that a script steps: the same bits as the program's. usage: check_sessions.py OSTEO FIXTURES OUT"""

import csv
import json
import os
import pathlib
import shutil
import subprocess
import sys
import threading
import warnings

try:
    import numpy as np
except ImportError:
    print("numpy is not installed")
    sys.exit(77)
import osteo

program, fixtures, out = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
shutil.rmtree(out, ignore_errors=True)
out.mkdir(parents=True)
os.environ["XDG_STATE_HOME"] = str(out / "state")
case = fixtures / "case"
MACHINE = {"work_us", "lateness_us"}


def run(*args, code=0):
    done = subprocess.run([program, *map(str, args)], capture_output=True, text=True)
    assert done.returncode == code, (args, done.returncode, done.stderr)
    return done


def same(a, b):
    """Bit for bit, but for how the machine did."""
    assert a.dtype == b.dtype and a.shape == b.shape, (a.shape, b.shape)
    for name in a.dtype.names:
        if name not in MACHINE:
            x, y = np.ascontiguousarray(a[name]), np.ascontiguousarray(b[name])
            assert (
                x.tobytes() == y.tobytes()
            ), f"{name} differs first at {np.argwhere(x.view(np.uint8) != y.view(np.uint8))[0]}"


def fails(call, code, word):
    try:
        call()
    except osteo.Error as e:
        assert e.code == code, (e.code, str(e))
        assert word in str(e), str(e)
        return
    raise AssertionError(f"no error that says {word}")


# What the file holds, against the program's own export.
s = osteo.Session(fixtures / "session")
run("export", fixtures / "session", out / "ticks.csv", "--quiet")
rows = list(csv.DictReader(line for line in open(out / "ticks.csv") if not line.startswith("#")))
assert len(rows) == len(s.ticks) > 1000
assert np.array_equal(np.array([r["force_x_n"] for r in rows], np.float32), s.ticks["force_n"][:, 0])
assert np.array_equal(np.array([r["z_mm"] for r in rows], np.float32), s.ticks["position_mm"][:, 2])
assert np.array_equal([int(r["voxels_changed"]) for r in rows], s.ticks["voxels_changed"])
assert s.rate_hz == 1000 and s.header["hands"] == 1 and s.header["settings"]["method"] == "overlap" and s.losses == []
assert s.end["ticks"] == len(s.ticks)
assert np.isclose(s.ticks["removed_mm3"].sum(dtype=float), s.end["removed_mm3"], rtol=1e-9)
assert not s.ticks.flags.writeable and not s.ticks.flags.owndata and not s.changes.flags.owndata
assert np.shares_memory(s.ticks["force_n"], s.ticks) and np.shares_memory(s.of_hand(0), s.ticks)
np.save(out / "ticks.npy", s.ticks)
assert np.load(out / "ticks.npy").tobytes() == s.ticks.tobytes()
fails(lambda: osteo.Session(out / "nothing"), 3, "nothing")
cut = out / "cut.oss"
bytes_ = bytearray((fixtures / "session/stream.oss").read_bytes())
bytes_[len(bytes_) // 2] ^= 1
cut.write_bytes(bytes_)
fails(lambda: osteo.Session(cut), 4, "damaged")
kept = osteo.Session(cut, damaged="keep")
assert kept.losses and 0 < len(kept.ticks) < len(s.ticks)

# The strokes of that session once more, a tick at a time and in pieces.
strokes, actions = osteo.load_script(fixtures / "session/strokes.json")
assert strokes.shape == s.ticks.shape and len(actions) == 0
with osteo.Rehearsal(case, out=out / "stepped") as r:
    pieces = [r.run(strokes[:1]), r.run(strokes[1:1000]), r.run(strokes[1000:])]
    summary = r.close()
again = osteo.Session(out / "stepped")
same(np.concatenate(pieces), s.ticks)
same(again.ticks, s.ticks)
assert np.array_equal(again.changes, s.changes)
for key in ("bone_hash", "surface_hash", "removed_mm3"):
    assert again.end[key] == s.end[key] == summary[key], key
run("replay", out / "stepped", "--quiet")
told = json.loads((out / "stepped/summary.json").read_text())
assert told["bone_hash"] == summary["bone_hash"]

# With two hands and with all that a script may do: saw, split, undo, another setting.
at = strokes["position_mm"][::100].tolist()
script = json.loads((fixtures / "session/strokes.json").read_text())
middle = np.array(at).mean(axis=0).tolist()
script["hands"] = [
    {
        "instrument": "sucker 8 Fr",
        "axis": [0, 0, 1],
        "waypoints": [
            {"t_s": 0, "at_mm": [middle[0] + 30, middle[1], middle[2]], "drill": True},
            {"t_s": 2, "at_mm": middle},
        ],
    }
]
script["actions"] = [
    {"t_s": 1.2, "undo": {}},
    {"t_s": 1.5, "saw": {"at_mm": middle, "normal": [0, 0, 1]}},
    {"t_s": 1.9, "undo": {}},
]
(out / "script.json").write_text(json.dumps(script))
run(
    "rehearse",
    case,
    "--headless",
    "--fast",
    "--script",
    out / "script.json",
    "-o",
    out / "headless",
    "--contact",
    "proxy",
    "--quiet",
)
strokes, actions = osteo.load_script(out / "script.json")
assert strokes.ndim == 2 and strokes.shape[1] == 2 and len(actions) == 3
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    with osteo.Rehearsal(case, hands=2, contact="proxy", out=out / "two") as r:
        ticks = r.run(strokes, actions)
a, b = osteo.Session(out / "headless"), osteo.Session(out / "two")
assert ticks.shape == strokes.shape
same(ticks.reshape(-1), a.ticks)
same(b.ticks, a.ticks)
assert b.actions.tobytes() == a.actions.tobytes() and len(a.actions) >= 3
assert a.end["bone_hash"] == b.end["bone_hash"] and a.end["surface_hash"] == b.end["surface_hash"]
assert (a.of_hand(1)["hand"] == 1).all() and np.shares_memory(a.of_hand(1), a.ticks)
run("replay", out / "two", "--quiet")

# Going on from a session's end, and a note in it.
with osteo.Rehearsal(case, hands=2, resume=out / "two", out=out / "on") as r:
    r.note("mark", {"name": "here"})
    r.run(strokes[:100])
assert osteo.Session(out / "on").header["bone_hash"] == b.end["bone_hash"]
assert {"tick": 0, "kind": "mark", "value": {"name": "here"}} in osteo.Session(out / "on").notes

# What the operation opens is not at risk: the flags, the header and the end are those of the command with --procedure.
ear = out / "ear"
run(
    "phantom", out / "ct.nrrd", "--labels-out", out / "l.nrrd", "--region", "temporal", "--spacing-mm", "1.5", "--quiet"
)
run(
    *("prepare", out / "ct.nrrd", "-o", ear, "--lower", "500", "--spacing-mm", "1", "--structures", out / "l.nrrd"),
    *("--names", "17=air cells, 6=facial nerve", "--quiet"),
)
cells = osteo.load(out / "l.nrrd", kind="labels")
place = np.argwhere(cells.voxels == 17)
place = place[np.argsort(place[:, 2])[-len(place) // 4]][::-1]  # of those, one not far from the left side
target = np.array(cells.origin_mm) + cells.spacing_mm * place
side = np.linspace(25, -1, 1500)[:, None] * (1, 0, 0)
through = osteo.goals(target + side, axis=(1, 0, 0), tool="cutting 4 mm")
waypoints = [{"t_s": i / 1000, "at_mm": p.tolist()} for i, p in enumerate(through["position_mm"])]
script = {"osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [1, 0, 0]}
(out / "cells.json").write_text(json.dumps(script | {"waypoints": waypoints}))
(out / "opens.json").write_text(
    json.dumps({"osteotome_procedure": 1, "name": "cells", "structures": [{"name": "air cells", "role": "enter"}]})
)
run(
    *("rehearse", ear, "--headless", "--fast", "--script", out / "cells.json", "--procedure", out / "opens.json"),
    *("-o", out / "opened", "--quiet"),
)
strokes, _ = osteo.load_script(out / "cells.json")
ends = {}
for name, procedure in ("usual", None), ("opened too", out / "opens.json"):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with osteo.Rehearsal(ear, procedure=procedure, out=out / name) as r:
            ends[name] = r.run(strokes), r.close(), json.loads((out / name / "summary.json").read_text())
command = osteo.Session(out / "opened")
same(ends["opened too"][0], command.ticks)
assert ends["usual"][1]["bone_hash"] == ends["opened too"][1]["bone_hash"] == command.end["bone_hash"]
assert ends["usual"][1]["removed_mm3"] > 1 and "structures_opened" not in ends["usual"][2]
assert ends["opened too"][2]["structures_opened"] == ["air cells"]
cut = [{c["name"] for c in e[2].get("structures_cut", [])} for e in ends.values()]
assert "air cells" in cut[0] and "air cells" not in cut[1], cut
run("replay", out / "opened too", "--quiet")
fails(lambda: osteo.Rehearsal(ear, procedure="no such operation"), 3, "no procedure")

# Bone by itself: a block of known volume, drilled by a hand that is exactly where it is told to be.
voxels = np.zeros((40, 40, 40), np.float32)
voxels[5:35, 5:35, 5:35] = 1
block = osteo.Grid(voxels, spacing_mm=(0.5, 0.5, 0.5))
assert block.active_voxels == 27000 and np.array_equal(block.dense().voxels[:40, :40, :40], voxels)
padded = np.pad(voxels, 10)
box = block.dense(lo=(-3, 2, 7), shape=(9, 45, 11))
assert np.array_equal(box.voxels, padded[7:16, 12:57, 17:28]) and box.origin_mm == [3.5, 1, -1.5]
assert osteo.Grid(box.voxels, box.spacing_mm, box.origin_mm, background=0.5).background == 0.5
fails(lambda: block.dense(shape=(0, 1, 1)), 2, "box")
fails(lambda: osteo.Grid(np.full((2, 2, 2), np.nan, np.float32)), 2, "finite")
down = np.c_[np.full(800, 10.0), np.full(800, 10.0), np.linspace(20.5, 17.5, 800)]
goals = osteo.goals(down, pedal=1, tool="cutting 4 mm")
exact = osteo.Rehearsal(block, hand="exact", surface=False)
ticks = exact.run(goals)
assert np.array_equal(ticks["position_mm"], down.astype(np.float32)), "an exact hand is where it is told to be"
left = exact.bone().dense().voxels.sum(dtype=float)
assert np.isclose((voxels.sum(dtype=float) - left) * 0.125, exact.removed_mm3, rtol=1e-4) and exact.removed_mm3 > 1
assert np.isclose(ticks["removed_mm3"].sum(dtype=float), exact.removed_mm3, rtol=1e-6)
assert not ticks["normal_force_n"][:100].any() and ticks["force_n"][-1, 2] > 0.5, ticks["force_n"][-3:]
held = osteo.Rehearsal(block, hand="spring").run(goals)
assert held["position_mm"][-1][2] > down[-1][2] + 0.1, "a spring gives way"
assert osteo.Rehearsal(block, hand="exact", settings={"limit_force_n": 0.5}).run(goals)["force_n"].max() <= 0.5 + 1e-6
assert block.active_voxels == 27000 and np.array_equal(
    block.dense().voxels[:40, :40, :40], voxels
), "the grid itself stays as it is"

# Refused, before anything has moved.
bad = goals[:3].copy()
bad["position_mm"][1, 2] = np.nan
fails(lambda: exact.run(bad), 2, "goal 1")
bad = goals[:3].copy()
bad["axis"][2] = 0
fails(lambda: exact.run(bad), 2, "goal 2")
bad = goals[:3].copy()
bad["tool"] = 255
fails(lambda: exact.run(bad), 2, "tool")
fails(lambda: exact.run(goals[::2]), 2, "contiguous")
fails(lambda: exact.run(np.zeros(3)), 2, "goal_dtype")
late = actions.copy()
late["tick"] = 5000000
fails(lambda: exact.run(goals[:3], late), 2, "among ticks")
kind = actions.copy()
kind["action"] = 99
fails(lambda: exact.run(goals[:3], kind), 2, "kind")
assert exact.ticks == 800
fails(lambda: osteo.Rehearsal(block, contact="touch"), 2, "contact")
fails(lambda: osteo.Rehearsal(block, settings={"no_such": 1}), 2, "no_such")
fails(lambda: osteo.Rehearsal(block, out=out / "none"), 2, "no case")
fails(lambda: osteo.Rehearsal(block, procedure="mastoidectomy"), 2, "no structures")
fails(lambda: osteo.Rehearsal(block, hands=9), 2, "hands")
fails(lambda: osteo.Rehearsal(out / "no-case"), 3, "no-case")
fails(lambda: osteo.Rehearsal(case, out=out / "two"), 6, "two")
exact.close()
assert exact.close()["ticks"] == 800
fails(lambda: exact.run(goals), 2, "closed")
for wrong in (
    lambda: osteo.goals([1, 2, 3]),
    lambda: osteo.goals(down, pedal=2),
    lambda: osteo.goals(down, tool="spoon"),
    lambda: osteo.goals(down, axis=(0, 0, 0)),
    lambda: osteo.Rehearsal(block, hand="left"),
    lambda: osteo.Session(fixtures / "session", damaged="maybe"),
):
    try:
        wrong()
    except ValueError:
        continue
    raise AssertionError("taken")

# Two threads at one rehearsal: one of them is refused, and the interpreter runs on meanwhile.
shared = osteo.Rehearsal(block, hand="exact", surface=False)
long_ = np.concatenate([goals] * 20)
worker = threading.Thread(target=shared.run, args=(long_,))
worker.start()
refused = 0
while shared.ticks == 0 and worker.is_alive():
    pass
while worker.is_alive():
    try:
        shared.bone()
    except osteo.Error as e:
        assert "another thread" in str(e)
        refused += 1
worker.join()
assert refused > 0 and shared.ticks == len(long_)

# Files of single values.
osteo.save(block, out / "block.vdb")
back = osteo.load(out / "block.vdb")
assert isinstance(back, osteo.Grid) and np.array_equal(back.dense((0, 0, 0), (40, 40, 40)).voxels.sum(), voxels.sum())
fails(lambda: osteo.load(out / "nothing.vdb"), 3, "nothing")
fails(lambda: osteo.load(out / "block.vdb", kind="labels"), 2, "grid")
fails(lambda: osteo.load(out / "block.vdb", kind="stone"), 2, "stone")
fails(lambda: osteo.save(block, out / "block.stl"), 2, "stl")
print(f"{len(s.ticks)} + {len(a.ticks)} records equal to the program's, bit for bit")

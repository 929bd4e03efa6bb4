#!/usr/bin/env python3
"""Sessions exported by osteo, read by csv, h5py and mcap, compared with the stream's own bytes.

usage: check_sessions.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""
import csv, json, pathlib, shutil, struct, subprocess, sys, zlib

try:
    import h5py, numpy as np
    from mcap.reader import NonSeekingReader, SeekingReader
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args):
    subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work)


osteo("phantom", "ct.nrrd", "--region", "temporal", "--spacing-mm", 2)
osteo("prepare", "ct.nrrd", "-o", "case", "--spacing-mm", 1)
osteo("rehearse", "case", "--headless", "--fast", "--seconds", 2, "-o", "first")
strokes = json.loads((work / "first/strokes.json").read_text())
strokes["actions"] = [
    {"t_s": 0, "suction": {"at_mm": strokes["waypoints"][-1]["at_mm"], "radius_mm": 3, "mm3_per_s": 4}},
    {"t_s": 0.5, "saw": {"at_mm": strokes["waypoints"][-1]["at_mm"], "normal": [0, 0, 1], "kerf_mm": 1}},
    {"t_s": 0.7, "move": {"piece": 0, "shift_mm": [0.5, 0, 0.25]}},
    {"t_s": 1.5, "undo": {}},
]
(work / "s.json").write_text(json.dumps(strokes))
osteo("rehearse", "case", "--headless", "--fast", "--dust", "--script", "s.json", "-o", "session")

# The stream itself, by its documented layout: docs/session-format.md.
raw, ticks, actions, at = (work / "session/stream.oss").read_bytes(), [], [], 0
while at < len(raw):
    magic, kind, size, crc = struct.unpack_from("<4sIII", raw, at)
    assert magic == b"OSF1"
    if kind == 2:
        for t in range(at + 16, at + 16 + size, 128):
            tick, x, y, z = struct.unpack_from("<Q3f", raw, t)
            force = struct.unpack_from("<3f", raw, t + 36)
            removed, changed, immersed = struct.unpack_from("<fII", raw, t + 80)
            ticks.append((tick, x, y, z, raw[t + 35], *force, removed, changed, immersed))
    if kind == 5:
        actions.append(struct.unpack_from("<Q4I", raw, at + 16) + struct.unpack_from("<12d", raw, at + 48))
    at += 16 + size
truth = np.array(ticks)
names = ["tick", "x_mm", "y_mm", "z_mm", "buttons", "force_x_n", "force_y_n", "force_z_n", "removed_mm3", "voxels_changed", "immersed"]
assert len(truth) == 2000 and truth[:, 8].sum() > 0.1 and truth[:, 10].sum() > 0, "the session should drill"
assert len(actions) == 4, actions
kinds = {10: "suction", 3: "saw", 5: "move", 12: "undo"}


def same(what, columns):
    got = np.array([columns[n] for n in names], float).T
    assert got.shape == truth.shape and np.array_equal(got, truth), f"{what} differs by {np.abs(got - truth).max()}"
    print(f"ok  {what}: {len(got)} ticks, equal")


def same_actions(what, rows):
    """rows: (tick, name, piece or None, twelve values)"""
    want = [(a[0], kinds[a[1]], None if a[2] == 0xFFFFFFFF else a[2], list(a[5:])) for a in actions]
    assert rows == want, f"{what}: {rows} != {want}"
    print(f"ok  {what}: {len(rows)} actions, equal")


for ending in ("csv", "h5", "mcap"):
    osteo("export", "session", f"out.{ending}")
left = sorted(p.name for p in work.iterdir() if p.name.startswith((".", "out")))
assert left == ["out-actions.csv", "out.csv", "out.h5", "out.mcap"], left
with open(work / "out.csv") as f:
    rows = list(csv.DictReader(f))
same("CSV", {n: np.float32([r[n] for r in rows]) for n in names})
assert all(r["ticks_lost_before"] == "0" for r in rows)
with open(work / "out-actions.csv") as f:
    rows = list(csv.DictReader(f))
same_actions("CSV", [(int(r["tick"]), r["action"], int(r["piece"]) if r["piece"] else None, [float(r[f"value_{v}"]) for v in range(12)]) for r in rows])

with h5py.File(work / "out.h5") as f:
    same("HDF5", {n: f["ticks"][n][:] for n in names})
    assert f.attrs["rate_hz"] == 1000 and f.attrs["complete"] in (b"yes", "yes")
    assert len(f["voxel_changes/voxel"]) == len(f["voxel_changes/density"]) > 0
    g = f["actions"]
    same_actions("HDF5", [(int(g["tick"][i]), g["action"][i].decode(), None if g["piece"][i] < 0 else int(g["piece"][i]),
                           [float(g[f"value_{v}"][i]) for v in range(12)]) for i in range(len(g["tick"]))])
    units = {n: d.attrs["unit"] for n, d in f["ticks"].items()}
    text = {n: u.decode() if isinstance(u, bytes) else u for n, u in units.items()}
    assert text["x_mm"] == "mm" and text["force_x_n"] == "N" and text["immersed"] == "voxels" and text["time_s"] == "s", text
    assert len(f["gaps/first_tick"]) == 0

# MCAP: in order, by its index, and every CRC by hand.
with open(work / "out.mcap", "rb") as f:
    messages = list(NonSeekingReader(f, validate_crcs=True).iter_messages())
with open(work / "out.mcap", "rb") as f:
    reader = SeekingReader(f, validate_crcs=True)
    summary = reader.get_summary()
    indexed = [m.data for _, c, m in reader.iter_messages(topics=["/ticks"])]
    later = [m.log_time for _, _, m in reader.iter_messages(start_time=1_500_000_000)]
assert summary.statistics.message_count == len(messages) == 2004 and summary.statistics.chunk_count == len(summary.chunk_indexes) > 1
assert {c.topic for c in summary.channels.values()} == {"/ticks", "/actions"} and min(later) == 1_500_000_000 and len(later) == 501
ticks_m = [m for _, c, m in messages if c.topic == "/ticks"]
assert indexed == [m.data for m in ticks_m]
records = [json.loads(d) for d in indexed]
same("MCAP", {n: np.float32([r[n] for r in records]) for n in names})
assert messages[0][0].encoding == "jsonschema" and ticks_m[1].log_time == 1_000_000
assert [m.log_time for _, _, m in messages] == sorted(m.log_time for _, _, m in messages)
schema = json.loads(next(s for s in summary.schemas.values() if s.name == "osteotome.Tick").data)
assert schema["properties"]["x_mm"]["unit"] == "mm"
acted = [json.loads(m.data) for _, c, m in messages if c.topic == "/actions"]
same_actions("MCAP", [(r["tick"], r["action"], r["piece"], r["values"]) for r in acted])
raw = (work / "out.mcap").read_bytes()
footer = raw[-8 - 29:-8]
assert raw[:8] == raw[-8:] == b"\x89MCAP0\r\n" and footer[0] == 2
start, _, crc = struct.unpack_from("<QQI", footer, 9)
assert crc == zlib.crc32(raw[start:-8 - 4]), "summary CRC"
assert raw[start - 13] == 15 and struct.unpack_from("<I", raw, start - 4)[0] == zlib.crc32(raw[:start - 13]), "data CRC"
print(f"ok  MCAP: {summary.statistics.chunk_count} chunks, indexed, CRCs right")

#!/usr/bin/env python3
"""Sessions exported by osteo, read by csv, h5py and mcap, compared with the stream's own bytes.

usage: check_sessions.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""

import csv, json, pathlib, shutil, struct, subprocess, sys, zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "docs" / "formats"))

try:
    import h5py, numpy as np
    import read_session
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

# The stream itself, by the reader in the documentation.
stream = work / "session/stream.oss"
session = read_session.read(stream)
names = [
    "tick",
    "x_mm",
    "y_mm",
    "z_mm",
    "buttons",
    "force_x_n",
    "force_y_n",
    "force_z_n",
    "removed_mm3",
    "voxels_changed",
    "immersed",
]
truth = np.array([session["tick"][n] for n in names], float).T
a = session["action"]
actions = [
    tuple(a[f["name"]][i] for f in session["header"]["records"]["action"]["fields"]) for i in range(len(a["tick"]))
]
summary = json.loads((work / "session/summary.json").read_text())
assert session["end"]["bone_hash"] == summary["bone_hash"] and not session["gaps"]
assert abs(session["tick"]["removed_mm3"].astype(float).sum() - summary["removed_mm3"]) < 1e-6 * summary["removed_mm3"]
assert (
    session["header"]["actions"]["3"] == "saw"
    and len(session["header"]["instruments"]) > 20
    and len(session["header"]["plates"]) > 2
)
assert (
    len(session["change"]["voxel"]) > 100
    and 0 <= session["change"]["density"].min() < session["change"]["density"].max() <= 1
)
# A flipped bit takes its own frame with it and nothing else.
damaged = bytearray(stream.read_bytes())
damaged[damaged.index(b"OSF2", len(damaged) // 2) + 40] ^= 4
(work / "damaged.oss").write_bytes(damaged)
kept = read_session.read(work / "damaged.oss")
assert 1800 <= len(kept["tick"]["tick"]) < 2000 and kept["end"], len(kept["tick"]["tick"])
print(f"ok  read_session.py: {len(session['tick']['tick'])} ticks, {len(session['change']['voxel'])} changes")
assert len(truth) == 2000 and truth[:, 8].sum() > 0.1 and truth[:, 10].sum() > 0, "the session should drill"
assert len(actions) == 4, actions
kinds = {10: "suction", 3: "saw", 5: "move", 12: "undo"}


def same(what, columns):
    got = np.array([columns[n] for n in names], float).T
    assert got.shape == truth.shape and np.array_equal(got, truth), f"{what} differs by {np.abs(got - truth).max()}"
    print(f"ok  {what}: {len(got)} ticks, equal")


def same_actions(what, rows):
    """rows: (tick, name, piece or None, twelve values)"""
    want = [(a[0], kinds[a[1]], None if a[2] == 0xFFFFFFFF else a[2], list(a)[-12:]) for a in actions]
    assert rows == want, f"{what}: {rows} != {want}"
    print(f"ok  {what}: {len(rows)} actions, equal")


# Notes, in a frame of their own before the end: one that is known and one that is not.
notes = [
    {"tick": 7, "kind": "camera", "value": {"eye_mm": [1, 2.5, 3], "view_angle_deg": 30}},
    {"tick": 1999, "kind": "twitch", "value": "\u00e4, \"b\""},
]
text = "".join(json.dumps(n) + "\n" for n in notes).encode()
payload = read_session.zstandard.compress(
    struct.pack("<II", session["header"]["records"]["note"]["part"], len(text)) + text
)
head = struct.pack("<II", read_session.RECORDS, len(payload)) + struct.pack("<QQ", 2000, 2000)
frame = b"OSF2" + head[:8] + struct.pack("<I", zlib.crc32(head + payload)) + head[8:] + payload
raw, at = stream.read_bytes(), 0
while struct.unpack_from("<I", raw, at + 4)[0] != read_session.END:
    at += 32 + struct.unpack_from("<I", raw, at + 8)[0]
stream.write_bytes(raw[:at] + frame + raw[at:])
assert read_session.read(stream)["note"] == notes

for ending in ("csv", "h5", "mcap"):
    osteo("export", "session", f"out.{ending}")
with open(work / "out-notes.csv") as f:
    assert [(int(r["tick"]), r["kind"], json.loads(r["json"])) for r in csv.DictReader(f)] == [
        tuple(n.values()) for n in notes
    ]
with h5py.File(work / "out.h5") as f:
    g = f["notes"]
    assert [(int(t), k.decode(), json.loads(v)) for t, k, v in zip(g["tick"], g["kind"], g["json"])] == [
        tuple(n.values()) for n in notes
    ]
with open(work / "out.mcap", "rb") as f:
    told = [json.loads(m.data) for _, _, m in SeekingReader(f).iter_messages(topics=["/notes"])]
    assert [{k: n[k] for k in ("tick", "kind", "value")} for n in told] == notes and told[1]["time_s"] == 1.999
print(f"ok  notes: {len(notes)} in CSV, HDF5, MCAP")
osteo("replay", "session")
left = sorted(p.name for p in work.iterdir() if p.name.startswith((".", "out")))
assert left == ["out-actions.csv", "out-notes.csv", "out.csv", "out.h5", "out.mcap"], left
with open(work / "out.csv") as f:
    rows = list(csv.DictReader(f))
same("CSV", {n: np.float32([r[n] for r in rows]) for n in names})
assert all(r["ticks_lost_before"] == "0" for r in rows)
with open(work / "out-actions.csv") as f:
    rows = list(csv.DictReader(f))
same_actions(
    "CSV",
    [
        (
            int(r["tick"]),
            r["action"],
            int(r["piece"]) if r["piece"] else None,
            [float(r[f"value_{v}"]) for v in range(12)],
        )
        for r in rows
    ],
)

with h5py.File(work / "out.h5") as f:
    same("HDF5", {n: f["ticks"][n][:] for n in names})
    assert f.attrs["rate_hz"] == 1000 and f.attrs["complete"] in (b"yes", "yes")
    assert len(f["voxel_changes/voxel"]) == len(f["voxel_changes/density"]) > 0
    g = f["actions"]
    same_actions(
        "HDF5",
        [
            (
                int(g["tick"][i]),
                g["action"][i].decode(),
                None if g["piece"][i] < 0 else int(g["piece"][i]),
                [float(g[f"value_{v}"][i]) for v in range(12)],
            )
            for i in range(len(g["tick"]))
        ],
    )
    units = {n: d.attrs["unit"] for n, d in f["ticks"].items()}
    text = {n: u.decode() if isinstance(u, bytes) else u for n, u in units.items()}
    assert (
        text["x_mm"] == "mm" and text["force_x_n"] == "N" and text["immersed"] == "voxels" and text["time_s"] == "s"
    ), text
    assert len(f["gaps/first_tick"]) == 0

# MCAP: in order, by its index, and every CRC by hand.
with open(work / "out.mcap", "rb") as f:
    messages = list(NonSeekingReader(f, validate_crcs=True).iter_messages())
with open(work / "out.mcap", "rb") as f:
    reader = SeekingReader(f, validate_crcs=True)
    summary = reader.get_summary()
    indexed = [m.data for _, c, m in reader.iter_messages(topics=["/ticks"])]
    later = [m.log_time for _, _, m in reader.iter_messages(start_time=1_500_000_000)]
assert (
    summary.statistics.message_count == len(messages) == 2006
    and summary.statistics.chunk_count == len(summary.chunk_indexes) > 1
)
assert (
    {c.topic for c in summary.channels.values()} == {"/ticks", "/actions", "/gaps", "/notes"}
    and min(later) == 1_500_000_000
    and len(later) == 502
)
ticks_m = [m for _, c, m in messages if c.topic == "/ticks"]
assert indexed == [m.data for m in ticks_m]
records = [json.loads(d) for d in indexed]
same("MCAP", {n: np.float32([r[n] for r in records]) for n in names})
assert messages[0][0].encoding == "jsonschema" and ticks_m[1].log_time == 1_000_000
assert [m.log_time for _, c, m in messages if c.topic != "/notes"] == sorted(
    m.log_time for _, c, m in messages if c.topic != "/notes"
)
schema = json.loads(next(s for s in summary.schemas.values() if s.name == "osteotome.Tick").data)
assert schema["properties"]["x_mm"]["unit"] == "mm"
acted = [json.loads(m.data) for _, c, m in messages if c.topic == "/actions"]
same_actions("MCAP", [(r["tick"], r["action"], r["piece"], r["values"]) for r in acted])
raw = (work / "out.mcap").read_bytes()
footer = raw[-8 - 29 : -8]
assert raw[:8] == raw[-8:] == b"\x89MCAP0\r\n" and footer[0] == 2
start, _, crc = struct.unpack_from("<QQI", footer, 9)
assert crc == zlib.crc32(raw[start : -8 - 4]), "summary CRC"
assert raw[start - 13] == 15 and struct.unpack_from("<I", raw, start - 4)[0] == zlib.crc32(
    raw[: start - 13]
), "data CRC"
print(f"ok  MCAP: {summary.statistics.chunk_count} chunks, indexed, CRCs right")

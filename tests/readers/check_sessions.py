#!/usr/bin/env python3
"""Sessions exported by osteo, read by csv, h5py and mcap, compared with the stream's own bytes.

usage: check_sessions.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""
import csv, json, pathlib, shutil, struct, subprocess, sys

try:
    import h5py, numpy as np
    from mcap.reader import NonSeekingReader
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
osteo("rehearse", "case", "--headless", "--fast", "--seconds", 2, "-o", "session")

# The stream itself, by its documented layout: docs/session-format.md.
raw, ticks, at = (work / "session/stream.oss").read_bytes(), [], 0
while at < len(raw):
    magic, kind, size, crc = struct.unpack_from("<4sIII", raw, at)
    assert magic == b"OSF1"
    if kind == 2:
        for t in range(at + 16, at + 16 + size, 120):
            tick, x, y, z = struct.unpack_from("<Q3f", raw, t)
            force = struct.unpack_from("<3f", raw, t + 36)
            removed, changed = struct.unpack_from("<fI", raw, t + 80)
            ticks.append((tick, x, y, z, *force, removed, changed))
    at += 16 + size
truth = np.array(ticks)
names = ["tick", "x_mm", "y_mm", "z_mm", "force_x_n", "force_y_n", "force_z_n", "removed_mm3", "voxels_changed"]
assert len(truth) == 2000 and truth[:, 7].sum() > 0.1, "the session should drill"


def same(what, columns):
    got = np.array([columns[n] for n in names], float).T
    assert got.shape == truth.shape and np.array_equal(got, truth), f"{what} differs by {np.abs(got - truth).max()}"
    print(f"ok  {what}: {len(got)} ticks, equal")


for ending in ("csv", "h5", "mcap"):
    osteo("export", "session", f"out.{ending}")
with open(work / "out.csv") as f:
    rows = list(csv.DictReader(f))
same("CSV", {n: np.float32([r[n] for r in rows]) for n in names})
with h5py.File(work / "out.h5") as f:
    same("HDF5", {n: f["ticks"][n][:] for n in names})
    assert f.attrs["rate_hz"] == 1000 and f.attrs["complete"] == b"yes" or f.attrs["complete"] == "yes"
    assert len(f["voxel_changes/voxel"]) == len(f["voxel_changes/density"]) > 0
with open(work / "out.mcap", "rb") as f:
    messages = list(NonSeekingReader(f).iter_messages())
assert messages[0][0].encoding == "jsonschema" and messages[0][1].topic == "/ticks"
records = [json.loads(m.data) for _, _, m in messages]
same("MCAP", {n: np.float32([r[n] for r in records]) for n in names})
assert messages[1][2].log_time == 1_000_000

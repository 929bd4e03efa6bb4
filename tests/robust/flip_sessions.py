#!/usr/bin/env python3
"""Flips single bits of a session's stream, at random but in every kind of place, and lets 'osteo replay' read it:
each is refused (exit code 4) or told, and never called the same without a word.

usage: flip_sessions.py BIN_DIR CASE SESSION WORK_DIR [FLIPS]
"""

import collections, pathlib, random, shutil, struct, subprocess, sys

bin_dir, case, session, work = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
flips = int(sys.argv[5]) if len(sys.argv) > 5 else 40
shutil.rmtree(work, ignore_errors=True)
shutil.copytree(session, work)
raw = (session / "stream.oss").read_bytes()
kinds = {1: "header", 2: "records", 3: "gap", 4: "checkpoint", 5: "end"}
frames, at = [], 0
while at < len(raw):
    _, kind, size, _, _, _ = struct.unpack_from("<4sIIIQQ", raw, at)
    frames.append((at, kinds[kind], size))
    at += 32 + size

random.seed(7)
places = []  # (part, first byte, bytes)
for f, (at, kind, size) in enumerate(frames):
    if kind not in ("header", "end"):
        places += [
            ("magic", at, 4),
            ("type", at + 4, 4),
            ("length", at + 8, 4),
            ("checksum", at + 12, 4),
            ("tick numbers", at + 16, 16),
        ]
    places.append((f"payload of {kind}", at + 32, size) if kind not in ("header", "end") else (kind, at, 32 + size))
parts = collections.defaultdict(list)
for part, at, size in places:
    if size > 0:
        parts[part].append((at, size))

table = collections.defaultdict(collections.Counter)
silent = []
for n in range(flips):
    part = sorted(parts)[n % len(parts)]
    at, size = random.choice(parts[part])
    byte, bit = at + random.randrange(size), random.randrange(8)
    damaged = bytearray(raw)
    damaged[byte] ^= 1 << bit
    (work / "stream.oss").write_bytes(damaged)
    run = subprocess.run(
        [bin_dir / "osteo", "replay", work, "--case-folder", case, "--quiet"], capture_output=True, text=True
    )
    if run.returncode == 4:
        outcome = (
            "refused (4)" if "replay" not in run.stderr and "only the first" not in run.stderr else "used up to it (4)"
        )
    elif run.returncode == 0 and "left out" in run.stderr:
        outcome = "told as a cut (0)"
    else:
        outcome = f"SILENT ({run.returncode})"
        silent.append((part, byte, bit, run.stderr))
    table[part][outcome] += 1

outcomes = sorted({o for c in table.values() for o in c})
print("| part | " + " | ".join(outcomes) + " |\n|---|" + "---|" * len(outcomes))
for part in sorted(table):
    print(f"| {part} | " + " | ".join(str(table[part][o]) for o in outcomes) + " |")
print(f"{flips} flips, {len(silent)} silent")
for s in silent[:5]:
    print(s)
sys.exit(1 if silent else 0)

#!/usr/bin/env python3
"""Reads a session's stream.oss by what its own header says: docs/formats/session-format.md in code.
needs numpy, zstandard        usage: read_session.py STREAM, or: import read_session; s = read_session.read(STREAM)
"""

import json, struct, sys, zlib
import numpy as np, zstandard

HEADER, RECORDS, GAP, CHECKPOINT, END = 1, 2, 3, 4, 5
TYPES = {"u8": "<u1", "u32": "<u4", "u64": "<u8", "f32": "<f4", "f64": "<f8"}


def frames(data):
    """Type, first tick, end tick, payload of each whole frame; behind damage from the next whole one on."""
    at = 0
    while (at := data.find(b"OSF2", at)) >= 0 and at + 32 <= len(data):
        _, kind, size, crc, first, end = struct.unpack_from("<4sIIIQQ", data, at)
        payload = data[at + 32 : at + 32 + size]
        whole = len(payload) == size and zlib.crc32(data[at + 4 : at + 12] + data[at + 16 : at + 32] + payload) == crc
        if whole:
            yield kind, first, end, payload
        at += 32 + size if whole else 1


def parts(raw, kinds):
    """Name and records of each part: a dict of columns, or text."""
    at = 0
    while at < len(raw):
        part, n = struct.unpack_from("<II", raw, at)
        at += 8
        name, kind = next((k, v) for k, v in kinds.items() if v["part"] == part)
        if kind.get("text"):
            yield name, raw[at : (at := at + n)].decode()
            continue
        columns = {}
        for field in kind["fields"]:
            width = int(TYPES[field["type"]][2])
            planes = np.frombuffer(raw, np.uint8, n * width, at).reshape(width, n)  # lowest bytes of all records first
            steps = np.ascontiguousarray(planes.T).view(f"<u{width}").ravel()
            columns[field["name"]] = np.cumsum(steps, dtype=f"<u{width}").view(TYPES[field["type"]])
            at += n * width
        yield name, columns


def read(path):
    """header, end (None: cut short), gaps, note, and of each other kind of record its columns."""
    data, found, notes, gaps, end = open(path, "rb").read(), {}, [], [], None
    for kind, first, end_tick, payload in frames(data):
        if kind == HEADER:
            header = json.loads(payload)
            found = {name: [] for name, k in header["records"].items() if not k.get("text")}
        elif kind == RECORDS:
            for name, records in parts(zstandard.decompress(payload), header["records"]):
                (
                    notes.extend(map(json.loads, records.splitlines()))
                    if isinstance(records, str)
                    else found[name].append(records)
                )
        elif kind == GAP:
            gaps.append((first, end_tick - first, json.loads(payload)["bone_lost"]))
        elif kind == END:
            end = json.loads(payload)
    columns = {
        name: {f: np.concatenate([c[f] for c in all_of]) for f in all_of[0]} if all_of else {}
        for name, all_of in found.items()
    }
    return {"header": header, "end": end, "gaps": gaps, "note": notes, **columns}


if __name__ == "__main__":
    s = read(sys.argv[1])
    print(
        {name: len(next(iter(s[name].values()), [])) for name in ("tick", "change", "action")}, len(s["note"]), "notes"
    )

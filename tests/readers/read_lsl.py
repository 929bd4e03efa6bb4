"""A signal and its events by pylsl: read_lsl.py OUT.npy, until the events have said that the session has ended."""

import sys, time

import numpy as np
import pylsl

print("looking", flush=True)
signal = pylsl.StreamInlet(pylsl.resolve_byprop("name", "OsteotomeEMG", timeout=60)[0], max_buflen=3600)
events = pylsl.StreamInlet(pylsl.resolve_byprop("name", "OsteotomeEvents", timeout=60)[0])
events.open_stream(timeout=60)
signal.open_stream(timeout=60)
rows, stamps, told, until = [], [], [], None
while until is None or time.time() < until:
    chunk, times = signal.pull_chunk(timeout=0.2, max_samples=30000)
    if times:  # ten minutes are 18 million samples
        rows.append(np.array(chunk, np.int16))
        stamps.append(np.array(times))
    while True:
        event, at = events.pull_sample(timeout=0)
        if event is None:
            break
        told.append(event[0])
        if '"samples"' in event[0]:
            until = time.time() + 2
stamps = np.concatenate(stamps)
assert np.abs(np.diff(stamps) - 1 / 30000).max() < 1e-6, "stamped sample by sample"
np.save(sys.argv[1], np.concatenate(rows))
print(f"{len(told)} events")

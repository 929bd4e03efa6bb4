#!/usr/bin/env python3
"""A nerve monitor's files written by osteo, read by neo, csv and wave: every sample, spike and stimulus, twice the same.

usage: check_monitor.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) when a reader is missing
"""

import csv, hashlib, json, pathlib, shutil, struct, subprocess, sys, wave

try:
    import numpy as np
    from neo.rawio import BlackrockRawIO
except ImportError as e:
    print(f"skipped: {e}; ./test installs the readers when PyPI can be reached")
    sys.exit(77)

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, **more):
    return subprocess.run(
        [bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work, capture_output=True, text=True, **more
    ).stdout


osteo("phantom", "ct.nrrd", "--labels-out", "l.nrrd", "--region", "temporal", "--spacing-mm", 1)
osteo(
    "prepare",
    "ct.nrrd",
    "-o",
    "case",
    "--spacing-mm",
    1,
    "--structures",
    "l.nrrd",
    "--names",
    "6=facial nerve, 13=chorda tympani",
    "--no-report",
)
path = [(0, 62, True), (2, 50.3, True), (4, 47.8, True), (5, 47, True), (6, 45, True), (6.5, 52, False)]
strokes = {
    "osteotome_strokes": 1,
    "burr": {"kind": "cutting", "diameter_mm": 3},
    "axis": [0.96, 0.2, 0.2],
    "waypoints": [{"t_s": t, "at_mm": [x, 9.5, -33.5], "drill": on} for t, x, on in path],
}
(work / "s.json").write_text(json.dumps(strokes))
osteo("rehearse", "case", "--headless", "--fast", "--script", "s.json", "-o", "session")
told = json.loads(osteo("nerve-monitor", "session", "-o", "out", "--json"))
assert told["same_as_recorded"] and told["samples"] == 6500 * 30, told
assert told["events"].get("activity", 0) > 0 and told["spikes"] > 10, told["events"]
assert "inferior alveolar nerve" in told["left_out"]

# Once more, and with a stimulator: the same bytes where nothing else was asked, others where it was.
osteo("nerve-monitor", "session", "-o", "again")
digest = lambda f: hashlib.sha256((work / f).read_bytes()).hexdigest()
for f in ("monitor.ns5", "monitor.nev", "events.csv", "channel.wav"):
    assert digest(f"out/{f}") == digest(f"again/{f}"), f
stimulated = json.loads(
    osteo("nerve-monitor", "session", "-o", "stimulated", "--json", "--stimulator-ma", 5, "--pulses-per-s", 10)
)
assert stimulated["events"]["stimulus"] > 20 and stimulated["events"]["response"] > 5, stimulated["events"]
assert digest("stimulated/monitor.ns5") != digest("out/monitor.ns5")

for folder, j in (("out", told), ("stimulated", stimulated)):
    reader = BlackrockRawIO(filename=str(work / folder / "monitor"), nsx_to_load=5)
    reader.parse_header()
    names = [str(c["name"]) for c in reader.header["signal_channels"]]
    assert names == [n[:15] for n in j["channels"]], names
    assert reader.get_signal_size(0, 0, 0) == j["samples"], reader.get_signal_size(0, 0, 0)
    assert reader.get_signal_sampling_rate(0) == 30000
    raw = reader.get_analogsignal_chunk(0, 0, 0, j["samples"], 0)
    head = 314 + 66 * len(names) + 9
    own = np.frombuffer((work / folder / "monitor.ns5").read_bytes()[head:], "<i2").reshape(-1, len(names))
    assert (raw == own).all()
    uv = reader.rescale_signal_raw_to_float(raw[:30000], dtype="float64", stream_index=0)
    quiet = uv[:, 0].std()
    assert folder != "out" or 5 < quiet < 15, quiet  # noise and mains, in microvolts
    spikes = sum(reader.spike_count(0, 0, u) for u in range(reader.spike_channels_count()))
    assert spikes == j["spikes"], (spikes, j["spikes"])
    # A spike's own samples are those of the signal.
    times = reader.get_spike_timestamps(0, 0, 0)
    waves = reader.get_spike_raw_waveforms(0, 0, 0, None, None)
    channel = int(str(reader.header["spike_channels"][0]["name"]).removeprefix("ch").split("#")[0]) - 1
    for t, w in list(zip(times, waves))[:20]:
        assert (w[0] == own[int(t) - 10 : int(t) + 38, channel]).all()
    events = 0
    for c in range(reader.event_channels_count()):
        if "digital" in str(reader.header["event_channels"][c]["name"]):
            events += reader.event_count(0, 0, c)
    assert events == j["events"].get("stimulus", 0) + j["events"].get("response", 0), (events, j["events"])
    rows = list(csv.DictReader((work / folder / "events.csv").open()))
    for kind, n in j["events"].items():
        assert sum(r["kind"] == kind for r in rows) == n, kind
    w = wave.open(str(work / folder / "channel.wav"))
    assert w.getframerate() == 30000 and w.getnframes() == j["samples"]
    heard = np.frombuffer(w.readframes(w.getnframes()), "<i2")
    expected = np.clip(own[:, 0] * 0.25 / 1000, -1, 1) * 32767
    assert np.abs(heard - expected).max() <= 1
    print(f"ok  neo: {j['samples']} samples of {len(names)} channels, {spikes} spikes, {events} digital events")

#!/usr/bin/env python3
"""dtaidistance's warping path on the curves that experiment_bench wrote, in the same run. usage: experiment_peers.py BENCH FOLDER
python3 -m venv build/peers-experiment && build/peers-experiment/bin/pip install dtaidistance==2.5.1 numpy"""

import pathlib, subprocess, sys, time

import numpy as np
from dtaidistance import dtw

# In turns, so that what else the machine does falls on both alike; the least of all rounds counts.
best, said = {}, ""
for _ in range(5):
    said = subprocess.run([sys.argv[1], sys.argv[2]], capture_output=True, text=True, check=True).stdout
    for file in sorted(pathlib.Path(sys.argv[2]).glob("trial-*.csv")):
        a, b = np.ascontiguousarray(np.loadtxt(file, delimiter=",", skiprows=1).T)
        times = {"ours": [float(file.read_text().split("\n", 1)[0])]}
        for name, call in {
            "warping_path_fast": lambda: dtw.warping_path_fast(a, b),
            "distance_fast (no path)": lambda: dtw.distance_fast(a, b),
        }.items():
            for _ in range(6):
                begun = time.perf_counter()
                call()
                times.setdefault(name, []).append((time.perf_counter() - begun) * 1000)
        for name, t in times.items():
            best[file.stem, name] = min(min(t), best.get((file.stem, name), 1e9))
print(said)
for trial in sorted({t for t, _ in best}):
    ours = best[trial, "ours"]
    print(
        trial,
        f"ours {ours:.3f} ms,",
        ", ".join(f"{k} {v:.2f} ms ({v / ours:.0f} times)" for (t, k), v in best.items() if t == trial and k != "ours"),
    )

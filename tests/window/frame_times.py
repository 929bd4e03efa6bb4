#!/usr/bin/env python3
"""Pictures a second of the window under Xvfb while the camera is turned, by what is open, beside a plain VTK viewer
of the same bone (picture_bench) in turns with it. Not a test: prints rows for docs/validation/accuracy.md.
usage: frame_times.py BIN_DIR CASE [ROUNDS]      CASE: a prepared case with structures; BIN_DIR holds picture_bench (ninja picture_bench)
"""

import os, pathlib, statistics, subprocess, sys, tempfile, time

bin_dir, case, rounds = (
    pathlib.Path(sys.argv[1]).resolve(),
    pathlib.Path(sys.argv[2]).resolve(),
    int((sys.argv[3:] or ["5"])[0]),
)
here = pathlib.Path(__file__).resolve()
work = tempfile.mkdtemp()
sys.argv = [sys.argv[0], "times", str(bin_dir), work, str(here.parents[2])]
sys.path.insert(0, str(here.parent))
from drive_window import *

os.chdir(work)
SECONDS = 4.0
# What is open: how the window is started, and the keys pressed then.
OPEN = {
    "picture with three cuts on it (`operate`)": ((), ()),
    "the same, a cut in the middle (F3)": ((), ("F3",)),
    "four up (`plan`)": ((), ("F2",)),
    "picture with three cuts, panel (F10)": ((), ("F10",)),
    "picture with three cuts, nerve monitor": (("--monitor",), ()),
}


def turned(flags, keys):
    """Bone's part of the window in pixels, pictures of the scene a second while the right button turns it, how long a cut took."""
    os.environ["XDG_CONFIG_HOME"] = tempfile.mkdtemp(dir=work)  # nobody's layout, kept from the window before
    w = Window("--width", 1360, "--height", 860, "--no-sound", *flags, case=case)
    for key in keys:
        w.x("key", key)
        w.next()
    x, y, wide, high = (int(v) for v in w.until("the picture rests", lambda s: s["at_rest"])["view"])
    x, y = x + wide // 2, y + high // 2
    w.x("mousemove", x, y, "mousedown", 3)
    w.next()
    first, begin, n, cuts = w.state(), time.monotonic(), 0, []
    while time.monotonic() < begin + SECONDS:
        n += 1
        w.x("mousemove", x + (n % 40 - 20) * 4, y + (n % 17 - 8) * 3)
        cuts.append(w.state()["cuts_ms"])
    last, took = w.state(), time.monotonic() - begin
    w.app.terminate()
    w.app.wait()
    return wide, high, (last["drawn"] - first["drawn"]) / took, last["scale"], statistics.median(cuts)


def plain(wide, high):
    said = subprocess.run(
        [bin_dir / "picture_bench", case, "--size", f"{wide}x{high}", "--rounds", "5", "--plain"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    row = next(line for line in said.splitlines() if line.startswith("plain VTK viewer"))
    return float(row.split()[-2])  # the median in real time


rows, viewer, loads = {name: [] for name in OPEN}, {}, []
with Screen("1360x860"):
    for turn in range(rounds):
        for name, (flags, keys) in OPEN.items():
            got = turned(flags, keys)
            rows[name].append(got)
            viewer.setdefault(got[:2], []).append(plain(*got[:2]))
            loads.append(os.getloadavg()[0])
            print(
                f"round {turn + 1}, {name}: {got}; plain viewer, as large: {viewer[got[:2]][-1]} ms",
                file=sys.stderr,
                flush=True,
            )
shutil.rmtree(work)

print(f"load {min(loads):.0f} to {max(loads):.0f}, {os.cpu_count()} cores, {rounds} rounds, window 1360 x 860\n")
print(
    "| open | bone's part, pixels | bone turned: pictures a second | its scale | cuts, ms | plain VTK viewer, as large: pictures a second |\n|---|---|---|---|---|---|"
)
for name, got in rows.items():
    rate, scale, cuts = (statistics.median(g[k] for g in got) for k in (2, 3, 4))
    print(
        f"| {name} | {got[0][0]} x {got[0][1]} | {rate:.1f} | {scale:.2f} | {cuts:.0f} | {1000 / statistics.median(viewer[got[0][:2]]):.1f} |"
    )

#!/usr/bin/env python3
"""What the window's pictures cost under Xvfb: turned by the mouse, drilling, at rest, by what is open; beside a plain VTK
viewer of the same bone (picture_bench) in turns with it. Not a test: prints rows for docs/validation/accuracy.md.
Processor time is of the threads that draw (the window's own and the software renderer's); it hardly depends on the load.
usage: frame_times.py BIN_DIR CASE [ROUNDS [turned] [drilling] [rest]]      CASE: a prepared case with structures;
BIN_DIR holds picture_bench (ninja picture_bench), needed for `turned` alone"""

import os, pathlib, statistics, subprocess, sys, tempfile, time

bin_dir, case, rounds, parts = (
    pathlib.Path(sys.argv[1]).resolve(),
    pathlib.Path(sys.argv[2]).resolve(),
    int((sys.argv[3:] or ["5"])[0]),
    sys.argv[4:] or ["turned", "drilling", "rest"],
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
DRILLED = {
    "1280 x 800": ((1280, 800), ()),
    "1280 x 800, dust and water": ((1280, 800), ("--dust",)),
    "1920 x 1080": ((1920, 1080), ()),
    "1920 x 1080, dust and water": ((1920, 1080), ("--dust",)),
}
AT_REST = {
    "drill": ((), ()),
    "drill brought to the bone": ((), ("f",)),
    "drill, dust and second hand": (("--dust",), ("f",)),
    "saw": ((), ("x",)),
    "plate": ((), ("l", "f")),
    "fragments": ((), ("p",)),
    "panel (F10)": ((), ("F10",)),
    "minimised": ((), ("f", "minimise")),
}


def open_window(width, height, flags):
    os.environ["XDG_CONFIG_HOME"] = tempfile.mkdtemp(dir=work)  # nobody's layout, kept from the window before
    w = Window("--width", width, "--height", height, "--no-sound", *flags, case=case)
    w.until("the picture rests", lambda s: s["at_rest"])
    return w


def close(w):
    w.app.terminate()
    w.app.wait()


def cpu_s(w):
    """Processor seconds so far: of the threads that draw, and of all."""
    drawing = all_of_it = 0
    for task in pathlib.Path(f"/proc/{w.app.pid}/task").iterdir():
        try:
            fields = (task / "stat").read_text()
        except OSError:
            continue  # over since
        name, rest = fields[fields.index("(") + 1 : fields.rindex(")")], fields[fields.rindex(")") + 2 :].split()
        spent = (int(rest[11]) + int(rest[12])) / os.sysconf("SC_CLK_TCK")
        all_of_it += spent
        if name.startswith("llvmpipe") or int(task.name) == w.app.pid:
            drawing += spent
    return drawing, all_of_it


def turned(flags, keys):
    """Bone's part of the window in pixels, pictures of the scene a second while the right button turns it, how long a cut took."""
    w = open_window(1360, 860, flags)
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
    close(w)
    return wide, high, (last["drawn"] - first["drawn"]) / took, last["scale"], statistics.median(cuts)


def drilling(size, flags):
    """Pictures a second, processor ms of a picture, scale and mm3 while the burr is led over the bone; ms from the
    mouse to the end of the first picture that has its goal, and of the first that has the hand moved."""
    w = open_window(*size, flags)
    x, y, wide, high = (int(v) for v in w.state()["view"])
    x, y = x + wide // 2, y + high // 2
    w.x("mousemove", x, y, "key", "f")
    w.until("the drill is there", lambda s: not s["leading"] and s["at_rest"])
    for n in range(40):  # to contact, and a little further
        if w.state()["force_n"] > 0.3:
            break
        w.deeper()
    w.x("mousemove", x, y, "mousedown", 1)
    w.next()
    scales, waits, first, used, begin, n = [], [], w.state(), cpu_s(w), time.monotonic(), 0
    while time.monotonic() < begin + 2 * SECONDS:
        n += 1
        before, at = w.state(), time.monotonic()
        w.x("mousemove", x + round(24 * math.sin(n / 2.2)), y + round(16 * math.sin(n / 3.1)))
        while (s := w.state())["goal_mm"] == before["goal_mm"] and time.monotonic() < at + 1:
            time.sleep(0.003)
        waits.append(1000 * (time.monotonic() - at))
        scales.append(s["scale"])
    last, spent, took = w.state(), cpu_s(w), time.monotonic() - begin
    if os.environ.get("STILL"):
        subprocess.run(["import", "-window", "root", os.environ["STILL"]])
    close(w)
    drawn = max(1, last["drawn"] - first["drawn"])
    return (
        drawn / took,
        1000 * (spent[0] - used[0]) / drawn,
        1000 * (spent[1] - used[1]) / drawn,
        statistics.median(scales),
        statistics.median(waits),
        last["removed_mm3"] - first["removed_mm3"],
    )


def rest(flags, keys):
    """Shares of a core that drawing and all of the program take while nobody does anything, turns of the loop and
    pictures of the scene a second, and the last one's scale."""
    w = open_window(1280, 800, flags)
    x, y, wide, high = (int(v) for v in w.state()["view"])
    w.x("mousemove", x + wide // 2, y + high // 2)
    for key in keys:
        w.x(*(("windowminimize", w.id) if key == "minimise" else ("key", key)))
        time.sleep(1)
    time.sleep(4)  # messages have gone
    first, used, begin = w.state(), cpu_s(w), time.monotonic()
    time.sleep(2 * SECONDS)
    last, spent, took = w.state(), cpu_s(w), time.monotonic() - begin
    close(w)
    return (
        100 * (spent[0] - used[0]) / took,
        100 * (spent[1] - used[1]) / took,
        (last["pictures"] - first["pictures"]) / took,
        (last["drawn"] - first["drawn"]) / took,
        last["scale"],
    )


def plain(wide, high):
    said = subprocess.run(
        [bin_dir / "picture_bench", case, "--size", f"{wide}x{high}", "--rounds", "5", "--plain"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    row = next(line for line in said.splitlines() if line.startswith("plain VTK viewer"))
    return float(row.split()[-2])  # the median in real time


rows, viewer, loads = {}, {}, []


def note(part, name, got):
    rows.setdefault(part, {}).setdefault(name, []).append(got)
    loads.append(os.getloadavg()[0])
    print(f"{part}, {name}: {' '.join(f'{v:.4g}' for v in got)}", file=sys.stderr, flush=True)


for turn in range(rounds):
    if "turned" in parts:
        with Screen("1360x860"):
            for name, (flags, keys) in OPEN.items():
                got = turned(flags, keys)
                viewer.setdefault(got[:2], []).append(plain(*got[:2]))
                note("turned", name, got)
    if "drilling" in parts:
        for name, (size, flags) in DRILLED.items():
            with Screen(f"{size[0]}x{size[1]}"):
                note("drilling", name, drilling(size, flags))
    if "rest" in parts:
        with Screen("1280x800"):
            for name, (flags, keys) in AT_REST.items():
                note("rest", name, rest(flags, keys))
shutil.rmtree(work)

HEADS = {
    "turned": "| open | bone's part, pixels wide | high | pictures a second | scale | cuts, ms | plain VTK viewer, as large: pictures a second |",
    "drilling": "| drilling | pictures a second | processor ms of drawing a picture | of all | scale | from mouse to picture, ms | mm³ |",
    "rest": "| at rest | drawing, % of a core | all, % of a core | turns a second | pictures of the scene a second | scale |",
}
print(f"load {min(loads):.0f} to {max(loads):.0f}, {os.cpu_count()} cores, {rounds} rounds")
for part, found in rows.items():
    print(f"\n{HEADS[part]}\n{'|---' * (HEADS[part].count('|') - 1)}|")
    for name, got in found.items():
        values = [statistics.median(g[k] for g in got) for k in range(len(got[0]))]
        if part == "turned":
            values.append(1000 / statistics.median(viewer[got[0][:2]]))
        print(f"| {name} | {' | '.join(f'{v:.3g}' if abs(v) < 100 else f'{v:.0f}' for v in values)} |")

#!/usr/bin/env python3
"""Makes the pictures of the window and of the three sessions in docs/guides/surgeon.md, docs/validation/phantom.md and README, from the project's own
phantom: bone only, nobody's.

usage: build/readers/bin/python3 docs/images/make_window.py build/release/bin [drilling] [pieces] [mandible] [mastoid]
"""

import pathlib, sys, tempfile

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
wanted = sys.argv[2:] or ["drilling", "pieces", "mandible", "mastoid"]
# What drives the window in tests drives it here: it takes its folders from the arguments.
sys.argv = [sys.argv[0], "pictures", sys.argv[1], tempfile.mkdtemp(), str(root)]
sys.path.insert(0, str(root / "tests/window"))
from drive_window import *
from PIL import Image

SESSIONS = root / "pipelines/sessions"
SIZE = ("--width", 1360, "--height", 860, "--quality", "deep", "--no-sound")


def keep(path, name):
    """Below 300 kB: 256 colours are enough for bone on a dark ground."""
    picture = Image.open(path).convert("RGB")
    picture.save(here / name, optimize=True)
    if (here / name).stat().st_size > 300_000:
        picture.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.FLOYDSTEINBERG).save(
            here / name, optimize=True
        )
    assert (here / name).stat().st_size < 300_000, (name, (here / name).stat().st_size)


def session(case, script, folder, *more):
    osteo("rehearse", case, "--headless", "--fast", "--script", SESSIONS / script, "-o", folder, "--quiet", *more)


def shot(w, folder, name):
    w.until("the picture rests", lambda s: s["at_rest"] and s["scale"] == 1)
    before = len(list(pathlib.Path(folder).glob("screenshot-*.png")))
    path = pathlib.Path(folder) / f"screenshot-{before + 1}.png"
    w.x("key", "s")
    wait("the screenshot", lambda: w.state()["message"] == f"saved {path.name}")
    keep(path, name)


def temporal():
    if pathlib.Path("ear").exists():
        return
    osteo("phantom", "ear.nrrd", "--labels-out", "labels.nrrd", "--region", "temporal", "--spacing-mm", 0.5, "--quiet")
    osteo(
        "prepare",
        "ear.nrrd",
        "-o",
        "ear",
        "--lower",
        500,
        "--spacing-mm",
        0.4,
        "--structures",
        "labels.nrrd",
        "--names",
        "5=ossicles, 6=facial nerve, 7=sigmoid sinus",
        "--quiet",
    )
    session("ear", "mastoid.json", "cavity", "--dust")


def head():
    if pathlib.Path("head").exists():
        return
    osteo("phantom", "head.nrrd", "--spacing-mm", 1, "--quiet")
    osteo("prepare", "head.nrrd", "-o", "head", "--lower", 500, "--spacing-mm", 1, "--quiet")
    session("head", "split-head.json", "apart", "--fragments")


if "mastoid" in wanted:
    temporal()
    keep("cavity/after.png", "session-mastoid.png")
if "pieces" in wanted:
    head()
    with Screen("1360x860x24"):
        w = Window(*SIZE, "--resume", "apart", "-o", "plated", case="head")
        w.key("l", "a plate", lambda s: s["hand"] == "plate")
        w.x("mousemove", 690, 470)
        w.next()
        w.key(
            "f", "at the bone", lambda s: not s["leading"] and ("brought" in s["message"] or "nearer" in s["message"])
        )
        for _ in range(60):
            if w.next()["force_n"] > 0.5:
                break
            w.deeper()
        w.key("Return", "fixed", lambda s: s["fixtures"] == 1)
        w.key("p", "pieces", lambda s: s["hand"] == "piece" and not s["leading"])
        shot(w, "plated", "window-pieces.png")
        w.close()
if "mandible" in wanted:
    osteo("phantom", "jaw.nrrd", "--spacing-mm", 0.8, "--quiet")
    osteo("prepare", "jaw.nrrd", "-o", "jaw", "--region", "jaw", "--lower", 500, "--quiet")
    session("jaw", "mandible.json", "drawn")
    keep("drawn/after.png", "session-mandible.png")
if "drilling" in wanted:
    osteo(
        "phantom",
        "demo.nrrd",
        "--labels-out",
        "demo-labels.nrrd",
        "--region",
        "temporal",
        "--spacing-mm",
        0.5,
        "--quiet",
    )
    names = "5=ossicles, 6=facial nerve, 7=sigmoid sinus, 12=labyrinth, 13=chorda tympani, 16=dura"
    structures = ("--structures", "demo-labels.nrrd", "--names", names)
    osteo("prepare", "demo.nrrd", "-o", "demo", "--lower", 500, "--spacing-mm", 0.4, *structures, "--quiet")
    script = json.loads((SESSIONS / "mastoidectomy.json").read_text())
    script["waypoints"] = [w for w in script["waypoints"] if w["t_s"] < 48]  # the outer part of the cavity
    script["waypoints"].append({"t_s": 49, "at_mm": [95, 19, -25], "drill": False})
    script["actions"] = [a for a in script["actions"] if a["t_s"] < 48] + [
        {"t_s": 48.9, "suction": {"at_mm": [62, 19, -25], "radius_mm": 12, "mm3_per_s": 0}}
    ]
    pathlib.Path("outer.json").write_text(json.dumps(script))
    osteo("rehearse", "demo", "--headless", "--fast", "--script", "outer.json", "-o", "outer", "--quiet")
    frames = []

    def frame(w, pictures=1):
        w.next(pictures)
        grab = ["-f", "x11grab", "-video_size", "1280x800", "-i", os.environ["DISPLAY"], "-frames:v", "1"]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *grab, "frame.png"], check=True)
        frames.append(Image.open("frame.png").convert("RGB").resize((960, 600), Image.Resampling.LANCZOS))

    with Screen("1280x800x24"):
        small = ("--width", 1280, "--height", 800, "--quality", "deep", "--no-sound")
        w = Window(*small, "--resume", "outer", "-o", "drilled", case="demo")
        w.x("mousemove", 700, 395)
        w.next()
        w.key("semicolon", "looks there", lambda s: not s["camera_moves"])
        for _ in range(2):
            now = w.state()["magnification"]
            w.key("bracketright", "larger", lambda s: s["magnification"] > now and not s["camera_moves"])
        w.x("mousemove", 690, 400)  # the wall of the cavity
        w.next()
        there = ("brought", "nearer")
        w.key("f", "at the bone", lambda s: not s["leading"] and any(word in s["message"] for word in there))
        frame(w, 3)
        w.x("mousedown", 1)
        w.until("the drill runs", lambda s: s["drill_on"])
        for step in range(30):
            angle = step * 2 * math.pi / 10
            w.x("mousemove_relative", "--", round(28 * math.cos(angle)), round(28 * math.sin(angle)))
            if step % 2 == 0:
                w.deeper()
            frame(w)
            if step == 16:
                keep("frame.png", "window-operate.png")
        w.x("mouseup", 1)
        w.x("mousemove_relative", "--", 40, -160)
        frame(w, 4)
        w.close()
    palette = frames[len(frames) // 2].quantize(128, method=Image.Quantize.MEDIANCUT)
    few = [f.quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    few[0].save(
        here / "drilling.gif",
        save_all=True,
        append_images=few[1:],
        duration=[900] + [140] * (len(few) - 2) + [1800],
        loop=0,
        optimize=True,
    )
    assert (here / "drilling.gif").stat().st_size < 3_000_000, (here / "drilling.gif").stat().st_size
shutil.rmtree(work)

#!/usr/bin/env python3
"""Makes the pictures of the window and of the three sessions in docs/guides/surgeon.md, docs/validation/phantom.md and README, from the project's own
phantom: bone only, nobody's.

usage: build/readers/bin/python3 docs/images/make_window.py build/release/bin [window] [pieces] [mandible] [mastoid]
"""

import pathlib, sys, tempfile

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
wanted = sys.argv[2:] or ["window", "pieces", "mandible", "mastoid"]
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
    session("head", "split-head.json", "apart", "--pieces")


if "mastoid" in wanted:
    temporal()
    keep("cavity/after.png", "session-mastoid.png")
if "window" in wanted:
    temporal()
    with Screen("1360x860x24"):
        w = Window(*SIZE, "--resume", "cavity", "-o", "seen", case="ear")
        w.x("mousemove", 760, 440)  # the cavity, seen from the left
        w.next()
        w.key("semicolon", "looks there", lambda s: apart(s["focus_mm"], s["centre_mm"]) > 5 and not s["camera_moves"])
        for _ in range(2):
            now = w.state()["magnification"]
            w.key("bracketright", "larger", lambda s: s["magnification"] > now and not s["camera_moves"])
        w.x("mousemove", 700, 400)
        w.next()
        w.key(
            "f",
            "at the bone, or as near as the cavity lets it",
            lambda s: not s["leading"] and ("brought" in s["message"] or "nearer" in s["message"]),
        )
        shot(w, "seen", "window.png")
        w.close()
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
shutil.rmtree(work)

#!/usr/bin/env python3
"""Makes the pictures of docs/guides/tutoring.md and docs/validation/monitor.md from the project's own phantom: live tutoring as a watcher sees
it, the nerve monitor's console with its stimulator.

usage: build/readers/bin/python3 docs/images/make_tutor.py build/release/bin [watch] [console] [SIZES_DIR]
With SIZES_DIR the watcher's window at 1920x1080 and 1024x700 is left there too, to be looked at.
"""

import pathlib, re, subprocess, sys, tempfile

here = pathlib.Path(__file__).resolve().parent
root = here.parent.parent
asked = sys.argv[2:]
sizes = [pathlib.Path(a).resolve() for a in asked if a not in ("watch", "console")]
wanted = [a for a in asked if a in ("watch", "console")] or ["watch", "console"]
bin_arg, folder = sys.argv[1], tempfile.mkdtemp()
sys.argv = [sys.argv[0], "pictures", bin_arg, folder, str(root)]
sys.path.insert(0, str(root / "tests/window"))
from drive_window import *
from PIL import Image

bin_dir = pathlib.Path(bin_dir).resolve()


def keep(path, name):
    """Below 300 kB."""
    picture = Image.open(path).convert("RGB")
    picture.save(here / name, optimize=True)
    if (here / name).stat().st_size > 300_000:
        picture.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.FLOYDSTEINBERG).save(
            here / name, optimize=True
        )
    assert (here / name).stat().st_size < 300_000, (name, (here / name).stat().st_size)


def shot(w, folder):
    before = len(list(pathlib.Path(folder).glob("screenshot-*.png")))
    path = pathlib.Path(folder) / f"screenshot-{before + 1}.png"
    w.x("key", "s")
    wait(
        "the screenshot",
        lambda: path.exists() and path.stat().st_size > 0 and w.state()["message"] == f"saved {path.name}",
    )
    return path


def ear():
    if pathlib.Path("case").exists():
        return
    osteo("phantom", "ct.nrrd", "--labels-out", "l.nrrd", "--region", "temporal", "--spacing-mm", 0.5, "--quiet")
    osteo(
        "prepare",
        "ct.nrrd",
        "-o",
        "case",
        "--lower",
        500,
        "--spacing-mm",
        0.5,
        "--structures",
        "l.nrrd",
        "--names",
        "6=facial nerve, 7=sigmoid sinus",
        "--quiet",
    )


if "watch" in wanted:
    ear()
    osteo("rehearse", "case", "--headless", "--fast", "--seconds", 60, "-o", "lesson", "--quiet")
    host = subprocess.Popen(
        [
            bin_dir / "osteo",
            "tutor",
            "case",
            "--script",
            "lesson/strokes.json",
            "--two-way",
            "--min-trainees",
            "2",
            "--wait-s",
            "600",
            "-o",
            "taught",
        ],
        stderr=open("host.txt", "w"),
    )
    wait("the code", lambda: "--code" in pathlib.Path("host.txt").read_text())
    address, code = re.search(r"osteo join (\S+) .*--code (\S+)", pathlib.Path("host.txt").read_text()).groups()
    trainee = subprocess.Popen(
        [bin_dir / "osteo", "join", address, "--case-folder", "case", "--code", code, "--silence-s", "300", "--quiet"]
    )
    all_sizes = [(1360, 860)] + ([(1920, 1080), (1024, 700)] if sizes else [])
    for width, height in all_sizes:
        with Screen(f"{width}x{height}x24"):
            name = f"watched-{width}"
            w = Window(
                "--join",
                address,
                "--code",
                code,
                "--role",
                "watcher",
                "--no-sound",
                "--width",
                width,
                "--height",
                height,
                "--quality",
                "deep",
                "-o",
                name,
            )
            w.until("bone goes, and all of it has come", lambda s: s["removed_mm3"] > 20 and s["tutor"]["heard"] == 1)
            w.key("g", "looks at the instructor's drill", lambda s: not s["camera_moves"])
            path = shot(w, name)
            if (width, height) == all_sizes[0]:
                keep(path, "window-tutor.png")
            else:
                sizes[0].mkdir(parents=True, exist_ok=True)
                (sizes[0] / f"window-tutor-{width}.png").write_bytes(path.read_bytes())
            w.close()
    host.terminate(), trainee.terminate()
    host.wait(), trainee.wait()

if "console" in wanted:
    subprocess.run(
        [
            sys.executable,
            root / "tests/window/drive_console.py",
            bin_dir,
            pathlib.Path(folder, "console"),
            pathlib.Path(folder, "pictures"),
        ],
        check=True,
    )
    # The driver's pictures are of the whole screen, which is black beside the window.
    for name, kept in (("console-silence-1100", "nerve-console"), ("console-stimulator", "nerve-stimulator")):
        path = pathlib.Path(folder, f"pictures/{name}.png")
        screen = Image.open(path).convert("RGB")
        screen.crop((0, 0, 1100, 640)).save(path)
        keep(path, f"{kept}.png")

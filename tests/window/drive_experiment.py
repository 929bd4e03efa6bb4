#!/usr/bin/env python3
"""Drives force-skill training under Xvfb: runs begin and end, what is pressed arrives, bars show where they should, a trial stopped half-way
is done again. usage: drive_experiment.py BIN_DIR WORK_DIR [PICTURES_DIR]"""

import json, os, pathlib, shutil, subprocess, sys, time

from driver import *

bin_dir, work = pathlib.Path(sys.argv[1]).absolute(), pathlib.Path(sys.argv[2]).absolute()
pictures = pathlib.Path(sys.argv[3]).absolute() if len(sys.argv) > 3 else None
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
os.environ["XDG_CONFIG_HOME"] = str(work / "config")
os.environ["XDG_STATE_HOME"] = str(work / "state-home")


class Window(Program):
    def __init__(self, device, size, *args):
        self.size = size
        super().__init__(
            [
                bin_dir / "osteo-experiment",
                "study",
                "--participant",
                "P01",
                "--device",
                device,
                "--width",
                size[0],
                "--height",
                size[1],
                *args,
            ],
            "Osteotome experiment",
        )
        x("mousemove", size[0] // 2, int(0.2 * size[1]))

    def press_space(self, page):
        """The page that the space bar leads to; pressed again where it was not heard."""
        end = time.monotonic() + PATIENCE_S
        while self.state()["page"] != page:
            assert time.monotonic() < end, (page, self.state())
            x("key", "space")
            time.sleep(0.5)

    def leave(self):
        x("key", "Escape")
        return self.end()

    def picture(self, name):
        if pictures:
            from PIL import ImageGrab

            pictures.mkdir(parents=True, exist_ok=True)
            ImageGrab.grab(xdisplay=os.environ["DISPLAY"]).crop((0, 0, *self.size)).save(pictures / f"{name}.png")


def protocol():
    j = json.loads(pathlib.Path("study/protocol.json").read_text())
    j["rate_hz"] = 250  # so that a busy machine keeps up
    pathlib.Path("study/protocol.json").write_text(json.dumps(j))


def run(window, size, page, force_share=0.5):
    """A whole run, the mouse at a share of the axis; the state seen while it was under way."""
    window.press_space(page)
    x("mousemove", size[0] // 2, int((0.2 + 0.65 * force_share) * size[1]))
    seen = window.until("force on the plane", lambda s: s["page"] == page and s["t_s"] > 4)
    window.picture(f"{seen['training'] if page == 'training' else 'T'}-{size[0]}")
    window.until("the run's end", lambda s: s["page"] != page)
    return seen


size = (1360, 860) if not pictures else tuple(map(int, os.environ.get("SIZE", "1360x860").split("x")))
with Screen("%dx%d" % size):
    done = subprocess.run(
        [bin_dir / "osteo", "experiment", "stimuli", "study", "--people", "P01", "--trials", "9"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    protocol()
    w = Window("mouse", size)
    first = w.until("the page", lambda s: s["page"] == "before_training" and s["done"] == 0)
    assert first["trials"] == 9
    seen = run(w, size, "training")
    assert abs(seen["pressed_n"] - 6) < 0.2, seen
    assert all(abs(a - b) < 3 for a, b in zip((seen["hand_mm"][0], seen["hand_mm"][2]), seen["path_mm"])), seen
    w.until("before the test", lambda s: s["page"] == "before_test" and s["done"] == 0)
    seen = run(w, size, "test")
    # What the mouse says is what the plane takes.
    assert abs(seen["applied_n"] - 6) < 0.6, seen
    w.until("saved", lambda s: s["done"] == 1)
    # Left in the middle of a run: that trial is not there.
    w.press_space("training")
    assert "1 of 9 trials are done" in w.leave()
    assert pathlib.Path("study/P01/trial-01.json").exists() and not pathlib.Path("study/P01/trial-02.json").exists()
    score = json.loads(pathlib.Path("study/P01/trial-01.json").read_text())
    assert score["by"] == "mouse" and score["simulated"] is False and 0.1 < score["score"] < 3, score
    # By keys it goes on there; more than the device gives is told.
    w = Window("keys", size)
    w.until("goes on", lambda s: s["page"] == "before_training" and s["done"] == 1)
    w.press_space("training")
    for _ in range(40):
        x("key", "Down")
    state = w.until("keys press", lambda s: s["pressed_n"] > 8)
    w.leave()
    if pictures:  # all trainings: blocks one by one
        for n in range(2, 10):
            w = Window("mouse", size)
            start = w.until("page", lambda s: s["page"].startswith("before"))
            for page in ("training", "test"):
                run(w, size, page, 0.35)
            w.until("saved", lambda s: s["done"] == n)
            w.leave()
print("driven")

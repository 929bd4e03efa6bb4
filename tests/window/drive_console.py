#!/usr/bin/env python3
"""The nerve monitor's console under Xvfb, a window of its own, beside a drilling that comes near the phantom's facial nerve and cuts it: it
waits for a server, shows every sample, goes on when the server went and came again, and its keys do what they say.
usage: drive_console.py BIN_DIR WORK_DIR [PICTURES]    with PICTURES it keeps pictures there, at three sizes"""

import csv, json, os, pathlib, shutil, signal, subprocess, sys, time

from driver import *

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from free_port import free_port

bin_dir, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
pictures = pathlib.Path(sys.argv[3]).resolve() if len(sys.argv) > 3 else None
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
os.environ.update(SDL_AUDIODRIVER="dummy", XDG_CONFIG_HOME=str(work / "config"), XDG_STATE_HOME=str(work / "state"))
sizes = [(1100, 640), (1024, 700), (1920, 1080), (3840, 2160)] if pictures else [(1100, 640)]


def osteo(*args):
    return subprocess.run(
        [bin_dir / "osteo", *map(str, args), "--quiet"], check=True, cwd=work, capture_output=True, text=True
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
# Near it, onto it, through it, away.
path = [
    (0, 62, True),
    (1.5, 50.3, True),
    (3, 47.8, True),
    (5, 47, True),
    (6.5, 44, True),
    (8, 44, True),
    (8.5, 52, False),
]
strokes = {
    "osteotome_strokes": 1,
    "burr": {"kind": "cutting", "diameter_mm": 3},
    "axis": [0.96, 0.2, 0.2],
    "waypoints": [{"t_s": t, "at_mm": [x, 9.5, -33.5], "drill": on} for t, x, on in path],
}
(work / "s.json").write_text(json.dumps(strokes))
port = free_port()


class Console(Program):
    def __init__(self, width, height, *more):
        super().__init__(
            [bin_dir / "osteo", "nerve-console", port, "--width", width, "--height", height, *more],
            "Osteotome nerve monitor",
        )
        self.until("it shows something", lambda s: s["pictures"] > 2)
        self.x("windowfocus", "--sync", self.id)

    def until(self, what, condition):
        def holds(state):
            try:
                return condition(state)
            except KeyError:  # told from when there is something to tell
                return False

        return super().until(what, holds)

    def picture(self, name):
        if pictures:
            pictures.mkdir(parents=True, exist_ok=True)
            w, h = largest
            subprocess.run(
                [
                    "ffmpeg",
                    "-v",
                    "error",
                    "-y",
                    "-f",
                    "x11grab",
                    "-video_size",
                    f"{w}x{h}",
                    "-i",
                    os.environ["DISPLAY"],
                    "-frames:v",
                    "1",
                    str(pictures / name),
                ],
                check=True,
            )

    def close(self):
        self.x("key", "q")
        self.end()


largest = max(sizes)
with Screen("%dx%d" % largest):
    for width, height in sizes:
        c = Console(width, height)
        assert "not connected" in c.until("told that nobody is there", lambda s: s["trouble"])["trouble"]
        c.picture(f"console-waiting-{width}.png")
        run = subprocess.Popen(
            [
                bin_dir / "osteo",
                "rehearse",
                "case",
                "--headless",
                "--script",
                "s.json",
                "-o",
                f"live-{width}",
                "--stream",
                f"igtl:{port}",
                "--quiet",
            ],
            cwd=work,
        )
        s = c.until("connected", lambda s: s["connected"] and s["channels"])
        c.until("something is heard", lambda s: s["lines"] >= 1)
        c.until("an alarm", lambda s: s["alarm"])
        c.picture(f"console-activity-{width}.png")
        c.until("silence behind the cut", lambda s: s["ended"] or s["seconds"] > 8)
        c.picture(f"console-silence-{width}.png")
        c.until("the session has ended", lambda s: s["ended"] or not s["connected"])
        assert run.wait(timeout=300) in (0, 8)
        s = c.until("the server has gone", lambda s: not s["connected"] and s["trouble"])
        c.picture(f"console-cut-{width}.png")
        # The finished session, from its first sample on: all of it.
        before = c.state()
        told = json.loads(osteo("stream", f"live-{width}", "--to", f"igtl:{port}", "--json"))
        assert told["dropped"] == 0, told
        s = c.until("all of it", lambda s: s["samples"] - before["samples"] == told["samples"])
        assert s["lost"] == before["lost"] and s["events"] - before["events"] == told["events"], (s, before, told)
        if width == sizes[0][0]:
            c.key("f", "frozen", lambda s: s["frozen"])
            c.key("f", "goes on", lambda s: not s["frozen"])
            c.key("m", "muted", lambda s: s["muted"])
            c.key("m", "heard", lambda s: not s["muted"])
            c.key("g", "by stimulus", lambda s: s["answers"])
            c.picture("console-answers.png")
            c.key("g", "free run", lambda s: not s["answers"])
        c.close()
        print(f"ok  {width}x{height}: {told['samples']} samples, {told['events']} events")
    # The stimulator, set from here by who has the code: a search, on, off; all of it is in the session, and comes out the same of it.
    held = dict(
        strokes,
        waypoints=[
            {"t_s": t, "at_mm": [x, 9.5, -33.5], "drill": on}
            for t, x, on in [
                (0, 62, True),
                (1.5, 50.3, True),
                (3, 47.8, True),
                (5, 47, True),
                (5.5, 47, False),
                (600, 47, False),
            ]
        ],
    )
    (work / "held.json").write_text(json.dumps(held))
    said = work / "rehearse.txt"
    with open(said, "w") as err:
        run = subprocess.Popen(
            [
                bin_dir / "osteo",
                "rehearse",
                "case",
                "--headless",
                "--script",
                "held.json",
                "-o",
                "held",
                "--stream",
                f"igtl:{port}/stimulator",
                "--quiet",
            ],
            cwd=work,
            stderr=err,
        )
    until = time.time() + 300
    while "--code" not in said.read_text() and time.time() < until:
        assert run.poll() is None, said.read_text()
        time.sleep(0.1)
    code = said.read_text().split("--code ")[1].split()[0]
    c = Console(*sizes[0], "--code", code)
    c.until("it may set the stimulator", lambda s: s["stimulates"] and s["seconds"] > 6)
    c.key("t", "it looks for the threshold", lambda s: s["search"])
    found = c.until("a threshold", lambda s: not s["search"] and s["threshold_ma"] > 0)["threshold_ma"]
    c.key("g", "by stimulus", lambda s: s["answers"])
    c.key("s", "on", lambda s: s["current_ma"] > 0)
    c.until("answers come in", lambda s: s["lines"] > 3)
    c.picture("console-stimulator.png")
    c.key("s", "off", lambda s: s["current_ma"] == 0)
    c.close()
    run.send_signal(signal.SIGINT)
    run.wait(timeout=300)
    osteo("nerve-monitor", "held", "-o", "heard")
    with open(work / "heard" / "events.csv") as f:
        events = list(csv.DictReader(f))
    current = lambda kind: [float(e["current_ma"]) for e in events if e["kind"] == kind]
    assert len(current("threshold")) == 1 and abs(current("threshold")[0] - found) < 1e-9, (found, current("threshold"))
    assert current("stimulator") == [0.5, 0.5, 0], current("stimulator")
    print(f"ok  the stimulator from the console: threshold {found:.2f} mA")

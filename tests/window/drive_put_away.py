#!/usr/bin/env python3
"""Windows that are put away draw nothing and keep no core busy; what runs goes on, and they come back as they were.
usage: drive_put_away.py put_away BIN_DIR WORK_DIR SOURCE_DIR"""

from drive_window import *  # what it drives with; the arguments are the same
from manager import bring_back, put_away

SOME_S = 3.0


def busy(app):
    """Share of a core over some seconds."""

    def used():
        fields = pathlib.Path(f"/proc/{app.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    before, began = used(), time.monotonic()
    time.sleep(SOME_S)
    return (used() - before) / (time.monotonic() - began)


def away(window, what, most):
    put_away(window.id)
    n = None

    def rests():
        # Whatever was on the way is done; then no picture comes.
        nonlocal n
        before, n = n, window.state()["pictures"]
        time.sleep(0.5)
        return n == before

    wait(f"{what} draws no more", rests)
    then = window.state().get("tick", 0)
    share = busy(window.app)
    assert window.app.poll() is None, window.said()
    assert window.state()["pictures"] == n, (what, n, window.state()["pictures"])
    assert share < most, f"{what}, put away, takes {share:.2f} of a core"
    bring_back(window.id)
    window.until(f"{what} is back", lambda s: s["pictures"] > n + 1)
    print(f"ok  {what}: {100 * share:.0f} % of a core while it is put away")
    return window.state().get("tick", 0) - then


def put_away_all():
    make_case()
    with Screen():
        start = Window(case=None)
        start.until("the list", lambda s: s["pictures"] > 2)
        away(start, "the start page", 0.25)
        start.x("windowfocus", "--sync", start.id)
        start.close()
        # The servo goes on at its thousand ticks a second, so there is more to do; what is drilled meanwhile is recorded.
        w = Window("--no-sound", "-o", "session")
        resting = busy(w.app)
        ticks = away(w, "a session", resting + 0.25)
        assert ticks > 1000 * SOME_S / 2, ticks
        w.x("windowfocus", "--sync", w.id)
        w.x("mousemove", 560, 350)
        w.key("F2", "it answers", lambda s: s["layout"] == "plan")
        w.close()
        closed("session")
        edit = Program([bin_dir / "osteo-edit", "case"], "Osteotome edit")
        edit.until("3D", lambda s: s["triangles"] > 0 and not s["previewing"])
        away(edit, "the editor", 0.25)
        edit.x("windowfocus", "--sync", edit.id)
        edit.x("key", "q")
        edit.end()
        console = Program([bin_dir / "osteo", "nerve-console", 1, "--no-sound"], "Osteotome nerve monitor")
        console.until("it shows something", lambda s: s["pictures"] > 2)
        away(console, "the nerve console", 0.25)
        console.x("windowfocus", "--sync", console.id)
        console.x("key", "q")
        console.end()


put_away_all()
print(f"window {part}: all as it should be")

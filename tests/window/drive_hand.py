#!/usr/bin/env python3
"""A mouse user's hand in the window under Xvfb: each of its keys, tilt by mouse, second hand, buttons given something to do, the keys lost to
another window, cases dropped and chosen in a dialog.
usage: drive_hand.py mouse_hand BIN_DIR WORK_DIR SOURCE_DIR"""

import json, os, pathlib, re, stat

from drive_window import *  # what it drives with; the arguments are the same
from xdnd import drop

SETTINGS = work / "config/osteotome/settings.json"


def moved(w, dx, dy):
    """How far the drill was asked to go by a motion of the mouse."""
    before = w.next()
    w.x("mousemove_relative", "--", dx, dy)
    w.next(3)
    return apart(w.state()["goal_mm"], before["goal_mm"])


def hand():
    pressed = set()
    with Screen():
        w = Window("--dust", "--no-sound", "-o", "first")

        def key(name, what, condition):
            pressed.add(name)
            return w.key(name, what, condition)

        def held(name, what, condition):
            pressed.add(name)
            w.x("keydown", name)
            return w.until(what, condition)

        # As far as the mouse goes, times the scale.
        one = moved(w, 40, 0)
        assert one > 1, one
        for n in (2, 4, 8):
            key("minus", f"1:{n}", lambda s: s["one_to"] == n)
            assert abs(moved(w, -40 if n == 2 else 40 if n == 4 else -40, 0) / one - 1 / n) < 0.02, n
        for n in (4, 2, 1):
            key("equal", f"1:{n}", lambda s: s["one_to"] == n)
        # Clutch and wrist rest, by both of their keys.
        for name in ("apostrophe", "KP_Insert"):
            held(name, "clutch", lambda s: s["clutch"])
            assert moved(w, 30, 10) == 0
            w.x("keyup", name)
            w.until("no clutch", lambda s: not s["clutch"])
            assert abs(moved(w, -30, 0) / (0.75 * one) - 1) < 0.02
        for name in ("backslash", "KP_Delete"):
            held(name, "wrist rest", lambda s: s["wrist_rest"])
            assert abs(moved(w, 40, 0) / one - 0.2) < 0.02
            w.x("keyup", name)
            w.until("no rest", lambda s: not s["wrist_rest"])
        # The handle: by keys, by mouse; the burr stays.
        w.next()
        start = w.until("at rest", lambda s: apart(s["axis"], s["axis_wanted"]) < 5e-3)
        for name in ("alt+Left", "alt+Right", "alt+Up", "alt+Down"):
            axis = w.state()["axis_wanted"]
            key(name, "tilted", lambda s: apart(s["axis_wanted"], axis) > 0.02)
        for name in ("Prior", "Next", "KP_Home", "KP_Prior"):
            axis = w.state()["axis_wanted"]
            key(name, "rolled", lambda s: apart(s["axis_wanted"], axis) > 0.02)
        key("Insert", "straight", lambda s: s["tilted_rad"] < 1e-6)
        w.x("key", "alt+Left")
        key("KP_Begin", "straight", lambda s: s["tilted_rad"] < 1e-6)
        w.x("mousemove", 480, 330)
        w.next()
        goal, eye = w.next()["goal_mm"], w.state()["eye"]
        w.x("keydown", "alt")
        s = w.drag(3, 60, -30)
        w.x("keyup", "alt")
        assert s["tilted_rad"] > 0.2 and s["eye"] == eye, s
        s = w.until("the handle has followed", lambda s: apart(s["axis"], s["axis_wanted"]) < 5e-3)
        assert apart(s["axis"], start["axis"]) > 0.2 and apart(s["goal_mm"], goal) < 1e-9, (s, goal)
        w.until("the burr stays", lambda s: apart(s["at_mm"], goal) < 0.05)
        # Right drag alone still turns the view, and the handle goes with it.
        s = w.drag(3, 60, 0)
        assert apart(s["eye"], eye) > 0.1 and s["tilted_rad"] > 0.2
        # The speed of the burr.
        for share in (0.75, 0.5):
            key("9", "slower", lambda s: s["burr_share"] == share)
        w.key("space", "drills at half its speed", lambda s: s["drill_on"])
        w.key("space", "off", lambda s: not s["drill_on"])
        for share in (0.75, 1):
            key("0", "faster", lambda s: s["burr_share"] == share)
        # The second hand goes with the mouse, and its pedal is the left button.
        goal = w.next()["goal_mm"]
        held("grave", "nothing yet", lambda s: not s["sucking"])
        w.next()
        w.x("mousemove_relative", "--", 30, 0)
        w.until("a sucker", lambda s: "suction tube" in s["message"])
        there = w.next()["second_mm"]
        w.x("mousemove_relative", "--", 0, 20)
        w.until("it moves", lambda s: apart(s["second_mm"], there) > 1)
        w.x("mousedown", 1)
        s = w.until("it sucks", lambda s: s["sucking"])
        assert not s["drill_on"] and s["goal_mm"] == goal, s
        w.x("mouseup", 1)
        w.until("it rests", lambda s: not s["sucking"])
        w.x("keyup", "grave")
        # Another window takes the keys: what is held or latched is let go.
        w.key("space", "on", lambda s: s["drill_latched"])
        held("apostrophe", "clutch", lambda s: s["clutch"])
        from xdnd import focus_away

        back = focus_away()
        w.until("off", lambda s: not s["drill_latched"] and not s["drill_on"] and not s["clutch"])
        w.x("keyup", "apostrophe")
        back(int(w.id))
        # A page of the panel, by keys alone: a row is chosen, a key given to it, and that does it.
        key("alt+h", "the page", lambda s: s["settings"])
        w.next(3)
        rows = []
        while w.state()["page_row"] != "undo":
            # Held over pictures: widgets look at keys once in each.
            w.x("keydown", "Down")
            w.next(2)
            w.x("keyup", "Down")
            rows.append(w.next(2)["page_row"])
            assert len(rows) < 40, rows
        w.x("keydown", "space")
        w.until("listens", lambda s: s["listening"] == "undo")
        w.x("keyup", "space")
        w.next(2)
        w.key("F12", "given", lambda s: s["listening"] == "")
        w.key("Escape", "keys given back", lambda s: not s["settings"])
        w.key("F12", "nothing to take back", lambda s: True)
        w.close()
    closed("first")
    assert any(r["pedal"] == "128" for r in ticks("first")), "half the speed is in the stream"
    kept = json.loads(SETTINGS.read_text())
    assert kept["buttons"] == {"key F12": "undo"} and kept["motion_one_to"] == 1 and kept["burr_share"] == 1, kept
    # Each key of the hand was pressed.
    named = {
        "'\\''": "apostrophe",
        "'\\\\'": "backslash",
        "'`'": "grave",
        "'-'": "minus",
        "'='": "equal",
        "kKeypad0": "KP_Insert",
        "kKeypadPoint": "KP_Delete",
        "kKeypad5": "KP_Begin",
        "kKeypad7": "KP_Home",
        "kKeypad9": "KP_Prior",
        "kPageUp": "Prior",
        "kPageDown": "Next",
    }
    rows = re.findall(
        r"^    \{('\\?.'|k\w+), Command::(\w+)(.*)\}", (source / "libs/app/window/src/keys.cpp").read_text(), re.M
    )
    wanted = {
        ("alt+" if "kWithAlt" in rest else "") + named.get(k, k[1].lower() if k[0] == "'" else k[1:])
        for k, command, rest in rows
        if command in HAND
    }
    assert len(wanted) > 15 and wanted == pressed, (wanted - pressed, pressed - wanted)


def drops():
    """Onto the start page, onto a session; what is no case ends nothing. Then the desktop's dialog."""
    pathlib.Path("scan.txt").write_text("no case")
    tools = work / "tools"
    tools.mkdir()
    zenity = tools / "zenity"
    os.environ["PATH"] = f"{tools}:{os.environ['PATH']}"

    def says(script):
        zenity.write_text("#!/bin/sh\n" + script + "\n")
        zenity.chmod(zenity.stat().st_mode | stat.S_IXUSR)

    says("exit 1")
    with Screen():
        w = Window("--no-sound", case=None)
        wid = int(w.id)
        assert drop(wid, [work / "scan.txt"])
        w.until("no case", lambda s: "osteo prepare" in s["message"])
        # The dialog: garbage, given up, a case.
        says("echo nonsense")
        w.key("o", "garbage", lambda s: "named no folder" in s["message"])
        says("exit 1")
        w.key("o", "given up", lambda s: s["message"] == "")
        says(f"echo '{work / 'case'}'")
        w.x("key", "o")
        first = w.until("opened", lambda s: s.get("page") != "start" and s["tick"] > 0)
        # Onto the session.
        assert drop(wid, [work / "scan.txt"])
        s = w.until("no case", lambda s: "osteo prepare" in s["message"])
        assert s["session"] == first["session"]
        now = s["tick"]
        w.until("it runs on", lambda s: s["tick"] > now)
        assert drop(wid, [work / "scan.txt", work / "other"])
        second = w.until(
            "the other case",
            lambda s: s.get("page") != "start" and s.get("session") != first["session"] and s["tick"] > 0,
        )
        assert "other" in second["session"], second
        w.close()
    closed(first["session"])
    closed(second["session"])
    notes = subprocess.run([bin_dir / "osteo", "export", first["session"], "notes.csv"], capture_output=True, text=True)
    assert (
        notes.returncode == 0 and "scan.txt" not in pathlib.Path("notes-notes.csv").read_text()
    ), "no name of a file in a session"


def mouse_hand():
    make_case()
    osteo("prepare", "ct.nrrd", "-o", "other", "--lower", "500", "--spacing-mm", "2", "--quiet")
    hand()
    drops()


if __name__ == "__main__":
    mouse_hand()
    print("window mouse_hand: all as it should be")

#!/usr/bin/env python3
"""A new user's first five minutes in the window under Xvfb: what the card of first steps says is done, word for word, and each step
ticks itself off by what came of it, not by its key. Prints the table of docs/guides/surgeon.md.
usage: drive_first_steps.py first_steps BIN_DIR WORK_DIR SOURCE_DIR"""

from drive_window import *  # what it drives with; the arguments are the same

SIZE = ("--width", 1360, "--height", 860, "--quality", "plain")
BONE = (750, 461)  # in the window: the mastoid, where one begins


def first_steps():
    make_case()
    with Screen("1360x860"):
        table = []
        w = Window(*SIZE, "--dust", "--no-sound", "-o", "first", end_page=True)

        def step(name, actions):
            """Does what the list says of it, and waits until it is ticked off: none before."""
            began = time.monotonic()
            before = w.next()
            assert before["next_step"] == name and name not in before["steps_done"], (name, before)
            said = actions()
            s = w.until(f"{name} is ticked off", lambda s: name in s["steps_done"])
            table.append((name, said, time.monotonic() - began))
            return s

        # Nothing moves: the scene is drawn no more, however often the window asks what has changed.
        rested = w.until("the picture rests", lambda s: s["at_rest"] and s["scale"] == 1)
        later = w.next(30)
        assert later["drawn"] == rested["drawn"] and later["tick"] > rested["tick"], (rested, later)

        w.key("F1", "ten keys", lambda s: s["help"] and not s["typing"])
        w.key("Escape", "away", lambda s: not s["help"])

        def wheel(times, until):
            for _ in range(times):
                if until(w.next()):
                    break
                w.x("click", 4)

        def drill():
            w.x("mousemove", *BONE)
            w.next()
            w.key("f", "brings the drill", lambda s: not s["leading"] and s["message"] == "drill brought to the bone")
            w.x("mousedown", 1)
            wheel(60, lambda s: s["removed_mm3"] > 2)
            w.x("mouseup", 1)
            w.until("off", lambda s: not s["drill_on"])
            return "point at the bone, F, hold the left button, Shift-wheel"

        def undo():
            # A burr that still runs out in the bone that it is given back begins another stroke at once.
            w.until("a stroke ends", lambda s: s["undo_steps"] > 0)
            w.key("z", "taken back", lambda s: s["message"] == "taken back")
            return "Z"

        def retract():
            w.key("u", "out", lambda s: not s["leading"] and s["message"] == "drill lifted out")
            return "U"

        def tilt():
            w.x("keydown", "alt")
            w.drag(3, 60, 0)
            w.x("keyup", "alt")
            return "Alt-right drag"

        def suck():
            w.x("mousemove", *BONE)
            w.next()
            w.key("f", "brings the drill", lambda s: not s["leading"] and s["message"] == "drill brought to the bone")
            # In the air it sucks nothing, and nothing is ticked off.
            w.x("keydown", "v")
            w.until("sucks", lambda s: s["sucking"])
            assert "Suction" not in w.next(5)["steps_done"]
            w.x("mousedown", 1)
            wheel(60, lambda s: "Suction" in s["steps_done"])
            w.x("mouseup", 1)
            w.x("keyup", "v")
            return "V and the left button, wheel"

        def zoom():
            for _ in range(4):
                w.x("click", 4)
                w.next()
            return "wheel"

        def cut():
            s = w.key("x", "the saw, where one points", lambda s: s["hand"] == "saw" and "Enter cuts" in s["message"])
            at = s["cut_at_mm"]
            assert apart(at, s["centre_mm"]) > 3, s
            w.drag(1, 25, 0)
            assert apart(w.until("moved", lambda s: s["cut_at_mm"] != at)["cut_at_mm"], at) > 1
            assert w.state()["undo_steps"] == s["undo_steps"] and "Cut" not in w.state()["steps_done"]
            w.x("key", "Return")
            return "X, drag, Enter"

        def plate():
            w.key("l", "a plate", lambda s: s["hand"] == "plate" and "Enter fixes it" in s["message"])
            w.x("mousemove", *BONE)
            w.next()
            w.x("click", 1)
            w.until("a click brings it", lambda s: s["message"] == "plate brought to the bone")
            w.x("key", "Return")
            return "L, click on bone, Enter"

        def ruler():
            w.key("F9", "ruler", lambda s: s["ruler"])
            for x, y in ((700, 430), (760, 470)):
                w.x("mousemove", x, y)
                w.next()
                w.x("click", 1)
                w.next()
            s = w.until("measured", lambda s: s["ruler_mm"] > 1)
            return "F9, two clicks"

        def picture():
            w.x("key", "s")
            return "S"

        def end():
            w.key("F9", "ruler away", lambda s: not s["ruler"])
            w.x("key", "q")
            return "Q"

        step("Drill", drill)
        step("Undo", undo)
        step("Retract", retract)
        step("Tilt", tilt)
        step("Suction", suck)
        step("Zoom", zoom)
        step("Cut", cut)
        assert step("Plate", plate)["fixtures"] == 1
        step("Ruler", ruler)
        step("Picture", picture)
        s = step("End", end)
        assert s["next_step"] == "" and s["ended"] and len(s["steps_done"]) == 11, s
        w.close()
        # In a scene without dust nobody is asked to suck; and what there is no thing for says so in words, in every layout.
        w = Window(*SIZE, "--no-sound", "-o", "second")
        w.key("F2", "four up", lambda s: s["layout"] == "plan")
        s = w.key("z", "nothing to take back, and it says so", lambda s: "nothing to take back" in s["message"])
        w.key("F2", "the picture", lambda s: s["layout"] == "operate")
        w.x("mousemove", *BONE)
        w.next()
        step("Drill", drill)
        step("Undo", undo)
        step("Retract", retract)
        step("Tilt", tilt)
        s = step("Zoom", zoom)
        assert s["next_step"] == "Cut" and "Suction" not in s["steps_done"] and not any(s["down"]), s
        # Who asks for water has it, and bone dust with it, from that tick on.
        w.key("i", "water", lambda s: s["washing"] and any(s["down"]))
        w.key("i", "no water", lambda s: not s["washing"])
        w.close()
    closed("first")
    assert "dust_mm3" in closed("second")[0]
    summary = json.loads(pathlib.Path("first/summary.json").read_text())
    assert summary["dust_mm3"]["sucked_off"] > 0.05 and summary["sawn_mm3"] > 10, summary
    for name, said, seconds in table:
        print(f"| {name} | {said} | {seconds:.1f} |")


if __name__ == "__main__":
    first_steps()
    print("window first_steps: all as it should be")

#!/usr/bin/env python3
"""Drives the window under Xvfb and checks each effect. Waits for what it wants to see, never for a time.
usage: drive_window.py keys|main_view|hand|signals|failures BIN_DIR WORK_DIR SOURCE_DIR"""

import array, csv, json, math, os, pathlib, re, resource, shutil, signal, subprocess, sys, time

from driver import *

part, bin_dir, work, source = (
    sys.argv[1],
    pathlib.Path(sys.argv[2]),
    pathlib.Path(sys.argv[3]),
    pathlib.Path(sys.argv[4]),
)
# Keys of these commands are pressed by drive_camera.py.
CAMERA = {
    "magnify",
    "focus",
    "autofocus",
    "look_there",
    "look_at_drill",
    "guide_camera",
    "bookmark",
    "camera_back",
    "orbit_left",
    "orbit_right",
    "orbit_up",
    "orbit_down",
}
# And of these by drive_hand.py.
HAND = {"tilt", "roll", "straight", "clutch", "wrist_rest", "second_mouse", "motion", "burr_speed", "hand_page"}


def osteo(*args, code=0):
    done = subprocess.run([bin_dir / "osteo", *map(str, args)], capture_output=True, text=True)
    assert done.returncode == code, (args, done.returncode, done.stderr)
    return done.stdout


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def apart(a, b):
    return math.dist(a, b)


class Window(Program):
    def __init__(self, *args, case="case", before=None, end_page=False):
        # Straight to the window's program, so that signals go to it whoever starts it.
        super().__init__(
            [bin_dir / "osteo-rehearse", *([case] if case else []), *([] if end_page else ["--no-end-page"]), *args],
            "Osteotome",
            before,
        )
        if not case or "--review" in args:  # the start page, or one at the end: nothing ticks
            return
        wait("the first tick", lambda: self.state()["tick"] > 0)
        self.x("mousemove", 560, 350)
        self.next()

    def next(self, pictures=2):
        """So many pictures later."""
        after = self.state()["pictures"] + pictures
        return wait("the next picture", lambda: (s := self.state())["pictures"] >= after and s)

    def drag(self, button, dx, dy):
        """Within one picture, if that is slow: what the mouse does is done in its order."""
        self.x("mousedown", button, "mousemove_relative", "--", dx, dy, "mouseup", button)
        return self.next()

    def deeper(self):
        """A step of the wheel with Shift."""
        self.x("keydown", "shift", "click", 4, "keyup", "shift")
        return self.next()

    def close(self, code=0):
        self.x("key", "q")
        return self.end(code)


def make_case(region="temporal"):
    osteo("phantom", "ct.nrrd", "--region", region, "--spacing-mm", "1" if region == "temporal" else "2", "--quiet")
    osteo(
        "prepare",
        "ct.nrrd",
        "-o",
        "case",
        "--lower",
        "500",
        "--spacing-mm",
        "1" if region == "temporal" else "2",
        "--quiet",
    )


def ticks(session):
    osteo("export", session, f"{session}.csv", "--quiet", "--force")
    with open(f"{session}.csv") as f:
        return list(csv.DictReader(f))


def force(row):
    return math.hypot(*(float(row[f"force_{a}_n"]) for a in "xyz"))


def closed(session):
    """A session that was closed: summary and end, and it replays to the bit."""
    summary = json.loads(pathlib.Path(session, "summary.json").read_text())
    replayed = json.loads(osteo("replay", session, "--json", "--quiet"))
    assert replayed["identical"] and replayed["complete"], replayed
    assert replayed["ticks"] == summary["ticks"], (replayed, summary)
    return summary, replayed


def loudness(raw, seconds):
    """Of the last seconds that went to the sound card."""
    samples = array.array("f")
    data = pathlib.Path(raw).read_bytes()
    samples.frombytes(data[: len(data) // 4 * 4][-int(seconds * 48000) * 4 :])
    return math.sqrt(sum(x * x for x in samples) / max(1, len(samples)))


def keys():
    make_case()
    pressed = set()
    os.environ.update(
        SDL_AUDIODRIVER="disk", SDL_DISKAUDIOFILE="heard.raw"
    )  # a sound card that writes what it would play
    with Screen():
        w = Window("--dust", "--diameter-mm", 6, "-o", "first")

        def key(name, what, condition):
            pressed.add(name)
            return w.key(name, what, condition)

        # The tool in the hand.
        for d in range(1, 8):
            key(str(d), "diameter", lambda s: s["tool"] == f"cutting {d} mm")
        key("d", "diamond", lambda s: s["tool"] == "diamond 7 mm")
        key("y", "cylinder", lambda s: s["tool"] == "diamond cylinder 7 mm")
        key("t", "taper", lambda s: s["tool"] == "diamond taper 7 mm")
        key("c", "cutting", lambda s: s["tool"] == "cutting taper 7 mm")
        key("b", "ball", lambda s: s["tool"] == "cutting 7 mm")
        key("5", "diameter", lambda s: s["tool"] == "cutting 5 mm")
        key("ctrl+h", "hints", lambda s: s["hints"])
        key("ctrl+h", "no hints", lambda s: not s["hints"])
        key(
            "ctrl+t",
            "only after a session",
            lambda s: "when it is over" in s["message"] and s["tool"] == "cutting 5 mm",
        )
        key("space", "drill on", lambda s: s["drill_latched"] and s["drill_on"])
        key("space", "drill off", lambda s: not s["drill_latched"] and not s["drill_on"])
        before = w.next()
        deeper = key("Down", "deeper", lambda s: s["goal_mm"] != before["goal_mm"])
        assert dot([a - b for a, b in zip(deeper["goal_mm"], before["goal_mm"])], before["eye"]) < -0.2, (
            before,
            deeper,
        )
        key("Up", "back", lambda s: apart(s["goal_mm"], before["goal_mm"]) < 1e-6)
        # The cuts.
        key("F3", "a cut in the middle", lambda s: s["cut_in_middle"] == 0)
        key("F3", "the bone in the middle", lambda s: s["cut_in_middle"] == -1)
        key("F4", "cuts along the tool", lambda s: s["cuts_along_tool"])
        key("F4", "cuts along the body", lambda s: not s["cuts_along_tool"])
        # The view, the help, a picture.
        turned = w.drag(3, 60, 20)
        assert dot(turned["eye"], before["eye"]) < 0.99
        key("Home", "view from the left", lambda s: dot(s["eye"], before["eye"]) > 0.9999)
        # A picture that is long in coming: a drag, a step of the wheel and a way on are one after the other all the same.
        w.app.send_signal(signal.SIGSTOP)
        w.x("mousedown", 3, "mousemove_relative", "--", 60, 20, "mouseup", 3)
        w.x("keydown", "shift", "click", 4, "click", 4, "keyup", "shift", "mousemove", 560, 350)
        w.app.send_signal(signal.SIGCONT)
        late = w.next()
        assert dot(late["eye"], turned["eye"]) > 0.999, (turned["eye"], late["eye"])
        assert dot([a - b for a, b in zip(late["goal_mm"], turned["goal_mm"])], late["eye"]) < -0.8, (turned, late)
        key("Home", "view from the left", lambda s: dot(s["eye"], before["eye"]) > 0.9999)
        key("F1", "the card of ten keys", lambda s: s["help"] and not s["typing"])
        w.key("F1", "all commands", lambda s: s["typing"])
        w.key("F1", "away", lambda s: not s["help"])
        # A command by its old name; letters are the search's, whatever keys they are.
        key("ctrl+k", "search", lambda s: s["typing"] and s["search"] == "")
        w.x("type", "--delay", "100", "zap")
        w.until("typed", lambda s: s["search"] == "zap" and s["found"] == "")
        for _ in range(3):
            w.x("key", "BackSpace")
        w.x("type", "--delay", "100", "magnif")
        w.until("found", lambda s: s["found"] == "Magnification: next step")
        times = w.state()["magnification"]
        w.key("Return", "done", lambda s: not s["typing"] and s["magnification"] > times)
        key("Home", "view from the left", lambda s: dot(s["eye"], before["eye"]) > 0.9999)
        key("ctrl+k", "search", lambda s: s["typing"])
        w.key("Escape", "away", lambda s: not s["typing"])
        # The focus goes round the window's parts, and Space presses what has it.
        for part in ("strip", "card", "cuts", "state", "bone"):
            key("Tab", f"focus: {part}", lambda s: s["focus"] == part)
        w.key("shift+Tab", "the other way", lambda s: s["focus"] == "state")
        w.key("Escape", "back to the bone", lambda s: s["focus"] == "bone")
        # The picture: as asked for; at rest in full size, and then not drawn again until something changes.
        for level in ("plain", "calm", "deep", "auto"):
            key("j", f"quality {level}", lambda s: s["quality"] == level and level in (s["level"], "auto"))
        rested = w.until("the picture rests", lambda s: s["at_rest"] and s["scale"] == 1)
        for _ in range(3):
            w.next(5)
        still = w.state()
        assert still["drawn"] <= rested["drawn"] + 2, (rested, still)
        w.drag(3, 30, 10)
        w.until("turning is drawn", lambda s: s["drawn"] > still["drawn"])
        key("Home", "view from the left", lambda s: dot(s["eye"], before["eye"]) > 0.9999)
        key("m", "a note is written", lambda s: s["writing"])
        w.x("key", "Return")
        w.until("without text it marks", lambda s: s["message"] == "marked" and not s["writing"])
        # The main view: none of it changes what is felt.
        em = w.state()["em_pixels"]
        w.key("ctrl+minus", "smaller text", lambda s: s["em_pixels"] < em)
        w.key("ctrl+0", "text as the monitor has it", lambda s: s["em_pixels"] == em)
        view = w.state()["view"]
        assert view[2] * view[3] - 200 * 200 > 0.8 * 1000 * 700, view  # with its cut on it
        key("F2", "plan", lambda s: s["layout"] == "plan" and s["view"][2] < view[2])
        key("F2", "operate", lambda s: s["layout"] == "operate" and s["view"] == view)
        key("F11", "full screen", lambda s: s["full_screen"])
        key("F11", "a window again", lambda s: not s["full_screen"])
        # Settings: what is switched takes effect at once, and the session has it noted.
        key("F10", "the settings", lambda s: s["settings"] == "view")

        def setting(row, what, condition):
            s = w.until(f"{row} is there", lambda s: row in s["rows"])
            w.x("mousemove", *map(round, s["rows"][row]))
            w.next()
            w.x("click", 1)
            return w.until(f"{row}: {what}", condition)

        setting("page sound", "its page", lambda s: s["settings"] == "sound")
        setting("sound", "off", lambda s: not s["sound"])
        setting("hints", "on", lambda s: s["hints"])
        setting("sound", "on again", lambda s: s["sound"])
        setting("page operation", "its page", lambda s: s["settings"] == "operation")
        setting("monitor", "shown, whatever it hears", lambda s: s["monitor"]["shown"])
        # The patient is turned over by the mouse: dust falls to the other side of the head, and back.
        lies = w.state()["down"]
        w.item("Patient position", "its list", lambda s: "Prone" in s["items"])
        w.item("Prone", "turned over", lambda s: dot(s["down"], lies) < -0.99 and "prone" in s["message"])
        w.item("Patient position", "its list", lambda s: "Supine" in s["items"])
        w.item("Supine", "as before", lambda s: dot(s["down"], lies) > 0.99)
        w.key("Escape", "keys given back", lambda s: not s["settings"])
        w.x("mousemove", 560, 350)
        w.key("ctrl+h", "no hints", lambda s: not s["hints"])
        key("ctrl+Tab", "wheel", lambda s: s["wheel"])
        w.key("Down", "still open", lambda s: s["wheel"])
        w.key("Down", "still open", lambda s: s["wheel"])
        w.key("Return", "the second of the wheel", lambda s: not s["wheel"] and s["tool"] == "diamond 5 mm")
        key("c", "cutting", lambda s: s["tool"] == "cutting 5 mm")
        key("ctrl+n", "the nerve monitor is hidden", lambda s: not s["monitor"]["shown"])
        key("ctrl+m", "and muted", lambda s: s["monitor"]["muted"])
        key("ctrl+g", "nobody leads here", lambda s: s["message"].startswith("nobody leads your hand"))
        key("w", "as it was", lambda s: s["before"])
        key("w", "as it is", lambda s: not s["before"])
        key("ctrl+l", "no region is planned, and it says so", lambda s: "--procedure" in s["message"])
        key("F9", "ruler", lambda s: s["ruler"])
        w.x("mousemove", 490, 300)
        w.next()
        w.x("click", 1)
        w.next()
        w.x("mousemove", 530, 330)
        w.next()
        w.x("click", 1)
        measured = w.until("measured", lambda s: s["ruler_mm"] > 1)
        assert not measured["drill_on"] and measured["removed_mm3"] == 0, measured
        w.key("F9", "ruler away", lambda s: not s["ruler"])
        w.key("m", "a note is written", lambda s: s["writing"])
        w.next(3)  # the field has the keys
        w.x("type", "--delay", "100", "spine")
        w.next()
        w.x("key", "Return")
        w.until("pinned", lambda s: s["notes"] == 1 and not s["writing"])
        w.x("mousemove", 560, 350)
        w.next()
        key(
            "s",
            "screenshot",
            lambda s: pathlib.Path("first/screenshot-1.png").exists() and s["message"].startswith("saved"),
        )
        # What the second hand holds goes round.
        for _ in range(8):
            held = key("k", "another in the second hand", lambda s: s["message"].startswith("second hand: "))["message"]
            w.next()
            if held == "second hand: nothing":
                break
        key("k", "a sucker again", lambda s: "suction tube" in s["message"])
        # To the bone, drilled, sucked and washed, out again. A short V and a long one.
        key("f", "at the bone", lambda s: not s["leading"] and s["message"] == "drill brought to the bone")
        down = w.state()
        assert down["force_n"] < 1 and not down["drill_on"], down
        w.x("mousedown", 1)
        w.until("the button drills", lambda s: s["drill_on"])
        for _ in range(40):
            if w.next()["removed_mm3"] > 2:
                break
            w.x("click", 5 if w.state()["force_n"] > 2 else 4)
        wait("the drill is heard", lambda: loudness("heard.raw", 0.05) > 0.003)
        key("n", "sound off", lambda s: not s["sound"])
        wait("silence", lambda: loudness("heard.raw", 0.1) == 0)
        key("n", "sound on", lambda s: s["sound"])
        wait("the drill is heard again", lambda: loudness("heard.raw", 0.05) > 0.003)
        w.x("mouseup", 1)
        assert w.until("drill off", lambda s: not s["drill_on"])["removed_mm3"] > 1
        w.x("keydown", "v")
        w.until("sucks", lambda s: s["sucking"])
        w.next(3)
        assert w.state()["sucking"]
        w.x("keyup", "v")
        w.until("no longer", lambda s: not s["sucking"])
        pressed.add("v")
        key("i", "irrigation runs", lambda s: s["washing"])
        w.next(3)
        assert w.state()["washing"]
        key("i", "and stops", lambda s: not s["washing"])
        key("u", "out", lambda s: not s["leading"] and s["message"] == "drill lifted out" and s["force_n"] == 0)
        out = w.state()
        assert dot([a - b for a, b in zip(out["at_mm"], out["centre_mm"])], out["eye"]) > 20, out
        # A session of V alone holds a sucker whose pedal is down, and nothing else.
        first = key("F5", "another session", lambda s: s["session"] != "first" and s["tick"] > 0)["session"]
        w.x("key", "v")
        w.next(4)
        second = key("F5", "another session", lambda s: s["session"] != first and s["tick"] > 0)["session"]
        # Saw, take apart, move, plate, back. What was drilled in the sessions before can be taken back as well.
        before = w.state()["undo_steps"]
        saw = key("x", "saw", lambda s: s["hand"] == "saw")
        left = key("a", "saw turned", lambda s: apart(s["cut_along"], saw["cut_along"]) > 0.05)
        key("e", "saw turned back", lambda s: apart(s["cut_along"], saw["cut_along"]) < 1e-6 and s != left)
        key("Return", "cut", lambda s: s["undo_steps"] == before + 1)
        key("ctrl+z", "uncut", lambda s: s["undo_steps"] == before)
        key("KP_Enter", "cut again", lambda s: s["undo_steps"] == before + 1)
        key("Escape", "drill", lambda s: s["hand"] == "drill")
        key("p", "pieces", lambda s: s["hand"] == "piece")
        apart_now = key("Return", "taken apart", lambda s: s["bodies"] > 1)
        w.x("mousemove", 440, 330)
        w.drag(1, 40, -20)
        moved = w.until("piece moved", lambda s: s["places_mm"] != apart_now["places_mm"])
        key("a", "piece turned", lambda s: s["places_mm"] != moved["places_mm"])
        plate = key("l", "plate", lambda s: s["hand"] == "plate")
        turned = key("a", "plate turned", lambda s: apart(s["plate_x"], plate["plate_x"]) > 0.05)
        key("e", "plate turned back", lambda s: apart(s["plate_x"], plate["plate_x"]) < 1e-6)
        # A click brings it where there is room for it: between two fragments there is not always.
        for at in ((440, 330), (600, 300), (560, 420), (380, 300), (640, 380)):
            w.x("mousemove", *at)
            w.next()
            w.x("click", 1)
            w.next(3)
            w.until("a click leads it", lambda s: not s["leading"] and "plate" in s["message"])
            if w.state()["message"] == "plate brought to the bone":
                break
        assert w.state()["message"] == "plate brought to the bone", w.state()["message"]
        key("Return", "plate fixed", lambda s: s["fixtures"] == 1 and s["hand"] == "drill")
        key("z", "plate off", lambda s: s["fixtures"] == 0)
        key("r", "asks", lambda s: s["asking"])
        w.key("Escape", "no", lambda s: not s["asking"] and s["session"] == second)
        w.key("r", "asks", lambda s: s["asking"])
        third = w.key(
            "Return",
            "bone whole again",
            lambda s: s["session"] not in ("first", first, second) and s["bodies"] == 1 and s["tick"] > 0,
        )["session"]
        # Heat and dust begin and end where they are switched, in the same session. The procedure it keeps from its
        # beginning: another continues from here, seen from the same side.
        eye = w.drag(3, 40, 10)["eye"]
        w.key("F10", "the settings, where they were left", lambda s: s["settings"] == "operation")
        setting("heat", "from here on", lambda s: s["hottest_c"] > 30)
        setting("dust", "gone", lambda s: not any(s["down"]))
        again = setting("dust", "from here on", lambda s: any(s["down"]))
        assert again["session"] == third and "another" not in again["rows"], again
        w.item("Procedure", "its list", lambda s: "Window into the mastoid" in s["items"])
        w.item("Window into the mastoid", "needs another session", lambda s: "another" in s["rows"])
        other = setting("another", "has it", lambda s: s["session"] != third and s["tick"] > 0 and not s["settings"])
        assert apart(other["eye"], eye) < 1e-6, (other, eye)
        w.until("goes on as it was", lambda s: s["hottest_c"] > 30 and any(s["down"]))
        fourth = other["session"]
        pressed.update({"q", "Left", "Right"})  # of the page at the end: main_view()
        said = w.close()
    for s in ("first", first, second, third, fourth):
        assert s in said
    summary, _ = closed("first")
    assert summary["removed_mm3"] > 1 and summary["dust_mm3"]["sucked_off"] >= 0, summary
    assert closed(first)[1]["actions"] == 0
    assert any(r["hand"] == "1" and r["pedal"] == "255" for r in ticks(first))
    assert closed(second)[0]["sawn_mm3"] > 10
    assert closed(third)[1]["actions"] == 6  # each of three switches after a hold
    closed(fourth)
    assert (pathlib.Path(second) / "session.json").read_text().count("resumed_from") == 1
    osteo("export", "first", "first.csv")
    notes = pathlib.Path("first-notes.csv").read_text()
    assert '"mark"' in notes and "eye_mm" in notes, notes
    assert "length_mm" in notes and "spine" in notes, notes
    switched = re.findall(r'"name"":""(\w+)"",""on"":(\w+)', notes)
    assert switched[:5] == [
        ("hints", "true"),
        ("hints", "false"),
        ("sound", "false"),
        ("hints", "true"),
        ("sound", "true"),
    ], switched
    assert ("monitor", "true") in switched, switched
    assert "width: 1000" in osteo("info", "first/screenshot-1.png"), osteo("info", "first/screenshot-1.png")
    # Each key of the table was pressed above.
    named = {"kSpace": "space", "kKeyEscape": "Escape", "kEnter": "Return", "kKeypadEnter": "KP_Enter"}
    table = re.findall(
        r"^    \{('.'|k\w+), Command::(\w+)(.*)\},$", (source / "libs/app/window/src/keys.cpp").read_text(), re.M
    )
    with_ctrl = {k[1].lower() if k[0] == "'" else k[1:] for k, command, rest in table if "kWithCtrl" in rest}
    assert {f"ctrl+{k}" for k in with_ctrl} == {k for k in pressed if k.startswith("ctrl+")}, (with_ctrl, pressed)
    pressed = {k for k in pressed if not k.startswith("ctrl+")}
    table = [k for k, command, rest in table if command not in CAMERA | HAND and "kWithCtrl" not in rest]
    assert len(table) > 30, table
    wanted = {k[1].lower() if k[0] == "'" else named.get(k, k[1:]) for k in table}
    # And those of the burr kinds, each in its row of the table.
    kinds = re.findall(
        r"^ +\.key = '(.)',$",
        (source / "libs/simulation/bone/include/osteo/simulation/bone/burr_kind.h").read_text(),
        re.M,
    )
    assert len(kinds) > 1, kinds
    wanted |= {k.lower() for k in kinds}
    assert wanted == pressed, (wanted - pressed, pressed - wanted)


def main_view():
    """From the start page to the end page, by keys alone."""
    make_case()
    osteo("import", "ct.nrrd", "series", "--quiet")
    pathlib.Path("broken").mkdir()
    pathlib.Path("broken/manifest.json").write_text('{"osteotome_case": 1')
    settings = work / "config/osteotome/settings.json"
    settings.parent.mkdir(parents=True)
    settings.write_text('{"osteotome_settings": 1, "layout": "operate",\n"colour": "red"}')
    with Screen():
        w = Window(case=None, end_page=True)
        said = w.until("warned of a key that is not known", lambda s: "no setting" in w.said())
        assert said["page"] == "start" and "line 2" in w.said(), (said, w.said())

        def choose(name):
            at = [e.split(":")[-1].strip() for e in w.state()["entries"]].index(name)
            while (now := w.state()["selected"]) != at:
                w.key("Down" if now < at else "Up", "selected moves", lambda s: s["selected"] != now)

        # A case that cannot be opened says why, and another can be chosen.
        choose("broken")
        w.x("key", "Return")
        s = w.until("says why", lambda s: s.get("page") == "start" and "JSON" in s["message"])

        def click(name, what, condition):
            at = w.until(name, lambda s: name in s["at"])["at"][name]
            w.x("mousemove", *map(round, at), "click", 1)
            return w.until(f"{name}: {what}", condition)

        # A scan becomes a case beside it.
        choose("series")
        click("prepare", "a case is being made", lambda s: s["making"].endswith("series-case"))
        made = w.until("it is there", lambda s: not s["making"] and "operate" in s["at"])
        assert made["entries"][made["selected"]] == "case: series-case" and not made["message"], made
        choose("case")
        w.x("key", "Return")
        first = w.until("the first tick", lambda s: s.get("page") != "start" and s["tick"] > 0)
        assert first["layout"] == "operate", first
        # What is changed is kept.
        w.key("F2", "plan", lambda s: s["layout"] == "plan")
        ended = w.key("q", "the page at the end", lambda s: s["ended"])
        closed(ended["session"])
        last = w.until("what there is to say of it", lambda s: s["review_s"] > 0)
        w.key("ctrl+t", "the course of the session", lambda s: s["timeline"] and s["view"][3] < last["view"][3])
        back = w.key("shift+Left", "ten seconds back", lambda s: s["review_s"] <= max(0, last["review_s"] - 9.9))
        w.key("Right", "a second on", lambda s: s["review_s"] > back["review_s"])
        w.key("space", "plays", lambda s: s["playing"] or s["review_s"] == last["review_s"])
        # The player by the mouse: from event to event as far as the ends; it plays, faster, and rests.
        w.until("at rest", lambda s: not s["playing"])

        def jump(button, way, end):
            for _ in range(20):
                here = w.state()["review_s"]
                if here == end:
                    return
                w.item(button, "another event", lambda s: (s["review_s"] - here) * way > 0)
            raise AssertionError((button, w.state()["review_s"], end))

        jump("before", -1, 0)
        jump("after", 1, last["review_s"])
        jump("before", -1, 0)
        speed = w.state()["speed"]
        shown = next(n for n in w.state()["items"] if re.fullmatch(r"[0-9.]+x", n) and float(n[:-1]) == speed)
        fast = w.item(shown, "another speed", lambda s: s["speed"] != speed)["speed"]
        w.item(f"{fast:g}x", "and another", lambda s: s["speed"] not in (speed, fast))
        w.item("play", "plays", lambda s: s["playing"] and s["review_s"] > 0 or s["review_s"] == last["review_s"])
        w.until("to the end, and rests there", lambda s: not s["playing"] and s["review_s"] == last["review_s"])
        w.key("ctrl+t", "away again", lambda s: not s["timeline"] and not s["playing"])
        again = w.key("F5", "goes on", lambda s: not s["ended"] and s["tick"] > 0 and s["session"] != ended["session"])
        w.key("q", "the page at the end", lambda s: s["ended"])
        w.key("r", "again", lambda s: not s["ended"] and s["tick"] > 0 and s["session"] != again["session"])
        w.key("q", "the page at the end", lambda s: s["ended"])
        w.key("Home", "another case", lambda s: s.get("page") == "start")
        assert any("case" in e for e in w.state()["entries"][:1]), w.state()
        # The demo ear by the mouse alone: made, and opened with a procedure and with dust.
        demo = w.state()["entries"].index("demo ear")
        click(f"card {demo}", "chosen", lambda s: s["selected"] == demo)
        click("make demo", "is being made", lambda s: s["making"])
        w.until("the demo can be opened", lambda s: not s["making"] and "operate" in s["at"])
        assert not w.state()["message"] and w.state()["selected"] == demo, w.state()
        click("procedure", "its list", lambda s: "mastoidectomy" in s["at"])
        click("mastoidectomy", "chosen", lambda s: s["procedure"] == "mastoidectomy")
        click("dust", "on", lambda s: s["dust"])
        shot = click("operate", "opened", lambda s: s.get("page") != "start" and s["tick"] > 0)
        assert shot["layout"] == "operate", shot
        # In plan a click on a structure's eye shows it solid, clear, hidden in turns.
        w.key("F2", "plan", lambda s: s["layout"] == "plan")
        plan = w.until("its list of structures", lambda s: set(s["items"]) & set(s["structures"]))
        eye = sorted(set(plan["items"]) & set(plan["structures"]))[0]
        looks = [plan["structures"][eye]]
        for _ in range(3):
            looks.append(w.item(eye, "another look", lambda s: s["structures"][eye] != looks[-1])["structures"][eye])
        assert set(looks[:3]) == {"solid", "clear", "hidden"} and looks[3] == looks[0], looks
        w.key("F2", "operate", lambda s: s["layout"] == "operate")
        on_demo = pathlib.Path(w.key("q", "the page at the end", lambda s: s["ended"])["session"])
        w.key("Home", "another case", lambda s: s.get("page") == "start")
        w.x("key", "q")
        w.end(0)
    summary = json.loads((on_demo / "summary.json").read_text())
    assert summary["structures_opened"] == ["air cells", "antrum"] and "dust_mm3" in summary, summary
    osteo("replay", on_demo, "--quiet")
    kept = json.loads(settings.read_text())
    assert kept["layout"] == "operate" and kept["colour"] == "red" and len(kept["recent_cases"]) == 2, kept
    assert kept["procedure"] == "mastoidectomy" and kept["dust"], kept
    sessions = sorted(p for p in pathlib.Path("case/sessions").iterdir())
    assert len(sessions) == 3, sessions
    assert json.loads((sessions[1] / "session.json").read_text()).get("resumed_from"), sessions

    # One of them, looked at again: nothing is written into it, and no other is begun.
    def held(folder):
        return {p: (p.stat().st_mtime_ns, p.read_bytes()) for p in sorted(folder.rglob("*")) if p.is_file()}

    before = held(sessions[0])
    with Screen():
        w = Window("--review", sessions[0], end_page=True)
        last = w.until("what there is to say of it", lambda s: s["ended"] and s["review_s"] > 0)
        w.key("ctrl+t", "the course of the session", lambda s: s["timeline"])
        w.key("shift+Left", "back in time", lambda s: s["review_s"] < last["review_s"])
        for key in ("r", "F5"):
            w.x("key", key)
        w.next(3)
        assert w.state()["ended"], w.state()
        w.x("key", "q")
        w.end(0)
    assert held(sessions[0]) == before
    assert len(list(pathlib.Path("case/sessions").iterdir())) == 3
    osteo("rehearse", "case", "--review", sessions[0], "--resume", sessions[0], code=2)


def hand():
    make_case("head")
    with Screen():
        w = Window("-o", "session")
        seen = []
        start = w.state()
        for turn in range(6):
            w.x("mousemove", 550, 350)
            w.next()
            s = w.key("f", "on the way", lambda s: s["leading"])
            began = s["tick"]
            s = w.until("arrived", lambda s: not s["leading"])
            seen.append((s["message"], s["eye"], began, s["tick"]))
            assert s["force_n"] < 1 and not s["drill_on"], s
            # Pressed and drilled a little; the next F starts from there.
            w.deeper()
            w.x("mousedown", 1)
            w.until("drills", lambda s: s["drill_on"])
            w.x("mouseup", 1)
            w.until("off", lambda s: not s["drill_on"])
            eye = s["eye"]
            for _ in range(100):  # a slow machine sees few of them
                w.x("mousemove", 600, 330)
                # Around, then up, then down again: the head stays up, so the camera does not go over the top.
                s = w.drag(3, *((-170, 0) if turn < 4 else (0, 60) if turn == 4 else (0, -60)))
                if dot(s["eye"], eye) < 0.4:
                    break
            assert dot(s["eye"], eye) < 0.4, (turn, s)
        # While it drills, the picture is drawn in every pixel, and what lies still is not drawn again.
        w.x("mousemove", 550, 350)
        w.key("f", "on the way", lambda s: s["leading"])
        w.until("arrived", lambda s: not s["leading"])
        w.deeper()
        w.x("mousedown", 1)
        first = w.until("drills", lambda s: s["drill_on"])
        n, sharp = 0, []
        while len(sharp) < 10 and n < 400:
            n += 1
            w.x("mousemove", 550 + n % 5, 350 + n % 7)
            s = w.next(1)
            if s["drawn"] >= first["drawn"] + 5 and s["kept"] > 0:
                sharp.append(s)
        w.x("mouseup", 1)
        assert len(sharp) == 10 and all(s["scale"] == 1 for s in sharp), [(s["scale"], s["kept"]) for s in sharp]
        w.key("u", "out", lambda s: not s["leading"] and s["message"].startswith("drill lifted"))
        # With saw, plate or fragments in the hand it rests, in full, and the window sleeps: a few turns a second.
        for tool, name in (("x", "saw"), ("l", "plate"), ("p", "piece")):
            w.key(tool, name, lambda s: s["hand"] == name)
            rested = w.until("the picture rests", lambda s: s["at_rest"] and s["scale"] == 1)
            still = w.until("nobody did anything", lambda s: s["tick"] >= rested["tick"] + 3000)
            slept = w.until("nothing is drawn", lambda s: s["tick"] >= still["tick"] + 5000)
            assert slept["drawn"] <= rested["drawn"] + 2, (name, rested, slept)
            assert slept["pictures"] <= still["pictures"] + 60, (name, still, slept)  # 100 where it never sleeps
            w.key("Escape", "away", lambda s: s["hand"] == "drill")
        w.close()
    assert sum(s[0] == "drill brought to the bone" for s in seen) >= 4, seen
    summary, _ = closed("session")
    rows = ticks("session")
    first = rows[0]
    assert force(first) == 0, first
    at = [float(first[f"{a}_mm"]) for a in "xyz"]
    assert apart(at, start["centre_mm"]) > 60, at
    assert len(rows) == summary["ticks"]
    # What it was pressed with before takes a moment to go; then it is lifted, carried and set down without touching hard, drill off.
    for _, _, began, ended in seen:
        way = rows[began + 100 : ended]
        hard = [(r["tick"], round(force(r), 2)) for r in way if force(r) > 1.5]
        assert not hard, f"of the way from tick {began} to {ended}: {hard[:1]} to {hard[-1:]}, {len(hard)} ticks"
        assert not any(int(float(r["pedal"])) for r in way)
    print(
        "most force on",
        len(seen),
        "ways:",
        max(max(map(force, rows[b + 100 : e])) for _, _, b, e in seen),
        "N; first tick",
        force(first),
        "N",
    )


def signals():
    make_case()
    with Screen() as screen:
        for name, sent in (
            ("term", [signal.SIGTERM]),
            ("int", [signal.SIGINT]),
            ("hup", [signal.SIGHUP]),
            ("logout", [signal.SIGTERM, signal.SIGHUP, signal.SIGTERM]),
        ):
            w = Window("-o", name)
            for s in sent:
                w.app.send_signal(s)
            said = w.end(130)
            assert "the session is saved" in said, said
            assert closed(name)[0]["ticks"] > 0
        # The X server goes first, as at some logouts.
        w = Window("-o", "display")
        screen.server.kill()
        said = w.end(130)
        assert "the display is gone" in said, said
        closed("display")


def failures():
    make_case()
    # No window: nothing is left behind.
    os.environ["DISPLAY"] = ":nowhere"
    done = subprocess.run([bin_dir / "osteo", "rehearse", "case"], capture_output=True, text=True)
    assert done.returncode == 7 and "no window can be opened" in done.stderr, done
    assert not pathlib.Path("case/sessions").exists()
    for wrong in (["--script", "x.json"], ["--fast"], ["--seconds", "5"]):
        done = subprocess.run([bin_dir / "osteo", "rehearse", "case", *wrong], capture_output=True, text=True)
        assert done.returncode == 2 and "has no effect in the window" in done.stderr, done
    osteo("rehearse", "case", "--headless", "--width", "800", code=2)
    # One set of flags.
    of_window = subprocess.run([bin_dir / "osteo-rehearse", "--help"], capture_output=True, text=True).stdout
    flags = set(re.findall(r"--[a-z][a-z-]+", of_window))
    assert "--width" in flags and flags <= set(re.findall(r"--[a-z][a-z-]+", osteo("help", "rehearse"))), flags
    with Screen():
        # A folder that is taken: said at once.
        pathlib.Path("taken").mkdir()
        pathlib.Path("taken/file").write_text("mine")
        done = subprocess.run(
            [bin_dir / "osteo", "rehearse", "case", "-o", "taken", "--width", "800", "--height", "600"],
            capture_output=True,
            text=True,
        )
        assert done.returncode == 6 and "exists already" in done.stderr, done
        assert os.listdir("taken") == ["file"]

        # What the next session goes on from is damaged behind its back.
        def spoil(w, folder):
            pathlib.Path(folder, "stream.oss").write_bytes(b"not a session any more")
            return w.key("F5", "tells what failed", lambda s: s["failure"])

        w = Window("-o", "spoilt")
        s = spoil(w, "spoilt")
        assert (
            s["session"] == "spoilt" and not pathlib.Path("case/sessions").exists()
        ), s  # no empty folder of the one that was not begun
        w.close(4)
        # From there the case itself is a way on, and then all is well but for what was lost.
        w = Window("-o", "spoilt-2")
        spoil(w, "spoilt-2")
        w.key("F5", "fails again", lambda s: s["failure"])
        s = w.key("r", "begun anew", lambda s: not s["failure"] and s["tick"] > 0)
        w.close(0)
        closed(s["session"])

        # No place for another session.
        shutil.rmtree("case/sessions", ignore_errors=True)
        pathlib.Path("case/sessions").write_text("a file")
        w = Window("-o", "no-place")
        s = w.key("F5", "tells what failed", lambda s: s["failure"])
        assert "cannot make the folder" in s["failure"], s
        w.close(6)
        closed("no-place")
        pathlib.Path("case/sessions").unlink()

        # A disk that is full: by a limit on the size of files. The window ends with the reason, whatever key comes first.
        def full():
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

        w = Window("-o", "full", before=full)
        wait("the file is as large as it may be", lambda: pathlib.Path("full/stream.oss").stat().st_size > 40_000)
        w.next(4)
        if not w.state()["failure"]:
            w.x("key", "F5")
        s = w.until("tells what failed", lambda s: s["failure"])
        assert "full" in s["failure"] or "write" in s["failure"], s
        said = w.close(6)
        assert "full" in said or "write" in said, said


work = work.absolute()
bin_dir, source = bin_dir.absolute(), source.absolute()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
os.environ["LIBGL_ALWAYS_SOFTWARE"] = "1"
os.environ["XDG_CONFIG_HOME"] = str(work / "config")  # nobody's own settings, and none are left behind
os.environ["XDG_DATA_HOME"] = str(work / "data")
if __name__ == "__main__":
    {"keys": keys, "main_view": main_view, "hand": hand, "signals": signals, "failures": failures}[part]()
    print(f"window {part}: all as it should be")

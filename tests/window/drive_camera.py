#!/usr/bin/env python3
"""Drives the microscope of the window under Xvfb: each of its keys, the mouse, stereo down to the pixels of the screen, a timed view.
usage: drive_camera.py camera BIN_DIR WORK_DIR SOURCE_DIR"""

import pathlib, re, struct, zlib

from drive_window import *  # what it drives with; the arguments are the same

LEFT, WIDE, HIGH = 56, 944, 636  # of the picture, beside the strip of tools and above the state; pixels


def png(path):
    """Rows of (r, g, b) bytes of a picture without a palette."""
    data = pathlib.Path(path).read_bytes()
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
            assert (depth, interlaced) == (8, 0) and colour in (2, 6), body
        if kind == b"IDAT":
            packed += body
        at += 12 + size
    n = 3 if colour == 2 else 4
    raw, rows, before = zlib.decompress(packed), [], bytearray(width * n)
    for y in range(height):
        how, line = raw[y * (width * n + 1)], bytearray(raw[y * (width * n + 1) + 1 : (y + 1) * (width * n + 1)])
        for i in range(len(line)):
            a, b, c = (line[i - n] if i >= n else 0), before[i], (before[i - n] if i >= n else 0)
            p = a + b - c
            line[i] = (line[i] + (0, a, b, (a + b) // 2, min((a, b, c), key=lambda v: abs(p - v)))[how]) & 255
        rows.append([line[k::n] for k in range(3)])
        before = line
    return rows


def far(s):
    return [a + b * s["working_distance_mm"] for a, b in zip(s["focus_mm"], s["view_back"])]


def rests(w):
    """The state when the camera has arrived."""
    w.next()
    return w.until("the camera arrives", lambda s: not s["camera_moves"])


def camera():
    make_case()
    pressed = set()
    with Screen():
        w = Window("--no-sound", "--experiment", "camera", "-o", "first")

        def key(name, what, condition):
            pressed.add(name)
            w.key(name, what, condition)
            return rests(w)

        begun = w.state()
        eye = key("bracketright", "4 times", lambda s: s["magnification"] == 4)
        six = key("bracketright", "6 times", lambda s: s["magnification"] == 6)
        assert apart(far(six), far(eye)) < 1e-9 and six["focus_mm"] == eye["focus_mm"], "parfocal"
        assert abs(six["pixels_per_mm"] / eye["pixels_per_mm"] - 1.5) < 1e-9
        key("bracketleft", "4 times", lambda s: s["magnification"] == 4)
        for name, sign in (("period", -1), ("comma", 1)):
            before = w.state()
            after = key(name, "focus", lambda s: s["focus_mm"] != before["focus_mm"])
            assert sign * dot([a - b for a, b in zip(after["focus_mm"], before["focus_mm"])], before["view_back"]) > 0.3
        # The autofocus goes back to the bone that the changer had found.
        for _ in range(4):
            w.x("key", "period")
        w.next()
        key("slash", "autofocus", lambda s: apart(s["focus_mm"], eye["focus_mm"]) < 0.2)
        w.x("mousemove", 540, 371)
        there = key("semicolon", "look there", lambda s: apart(s["focus_mm"], eye["focus_mm"]) > 1)
        key("f", "drill at the bone", lambda s: not s["leading"] and "bone" in s["message"])
        at = key("g", "look at the drill", lambda s: apart(s["focus_mm"], s["at_mm"]) < 1)
        w.x("key", "shift+F6")
        w.until("kept", lambda s: s["message"] == "view 1 kept")
        # Along the handle as it is; then the mouse's handle follows the view.
        handle = w.next()["axis"]
        while apart(handle, (now := w.next()["axis"])) > 1e-4:
            handle = now
        w.x("key", "shift+g")
        w.until("along the drill", lambda s: dot(s["view_back"], handle) > 0.9999 and not s["camera_moves"])
        key(
            "F6",
            "back to the view",
            lambda s: dot(s["view_back"], at["view_back"]) > 0.99999 and apart(s["focus_mm"], at["focus_mm"]) < 1e-9,
        )
        for name, n in (("F7", 2), ("F8", 3)):
            key(name, "says that none is kept", lambda s: f"no view {n}" in s["message"])
        key("BackSpace", "along the drill again", lambda s: dot(s["view_back"], handle) > 0.9999)
        for name in ("KP_Left", "KP_Right", "KP_Up", "KP_Down"):
            pressed.add(name)
            before = rests(w)
            w.x("keydown", name)
            w.until(name, lambda s: dot(s["view_back"], before["view_back"]) < 0.9999)
            w.x("keyup", name)
            assert apart(w.next()["focus_mm"], before["focus_mm"]) < 1e-9
        # Mouse.
        before = rests(w)
        turned = w.drag(3, 60, 20)
        assert turned["focus_mm"] == before["focus_mm"] and dot(turned["view_back"], before["view_back"]) < 0.999
        shifted = w.drag(2, 30, 0)
        assert abs(apart(shifted["focus_mm"], turned["focus_mm"]) * turned["pixels_per_mm"] - 30) < 8, (turned, shifted)
        w.x("click", 4)
        w.until("the wheel", lambda s: s["magnification"] > 4.2)
        w.x("click", 5)
        w.until("and back", lambda s: s["magnification"] < 4.2)
        w.x("keydown", "ctrl")
        w.x("click", 4)
        w.until("Ctrl-wheel", lambda s: s["magnification"] > 4.2)
        w.x("keyup", "ctrl")
        # O: the mouse moves the camera, the drill rests.
        before = rests(w)
        w.x("keydown", "o")
        pressed.add("o")
        w.next()
        w.x("mousemove", 500, 380)  # in the middle of the view, wherever it was
        w.next()
        before = rests(w)
        for by in (40, -40, 40):  # how far it goes on by itself depends on how fast it came
            w.x("mousemove_relative", "--", by, 0)
            w.next(3)
            if apart(w.state()["focus_mm"], before["focus_mm"]) > 1:
                break
        moved = w.until("O: it moves", lambda s: apart(s["focus_mm"], before["focus_mm"]) > 1)
        assert apart(moved["goal_mm"], before["goal_mm"]) < 1e-9
        assert dot(moved["view_back"], before["view_back"]) > 0.999999
        w.x("keyup", "o")
        w.next()
        assert rests(w)["focus_mm"] == rests(w)["focus_mm"]
        key("Home", "the whole bone", lambda s: abs(s["magnification"] - begun["magnification"]) < 1e-9)
        pressed.discard("Home")
        # The timed views: the first is found by its rings, here by the state.
        w.close()
        assert there and not pathlib.Path("first/camera-trial.csv").exists(), "no view was reached"
        # Stereo: what is on the screen.
        pictures, places = {}, []
        for mode in ("anaglyph", "side_by_side", "interlaced", "top_bottom"):
            w = Window("--no-sound", "--stereo", mode, "--stereo-base", 30, "-o", mode)
            w.key("bracketright", "4 times", lambda s: s["magnification"] == 4 and not s["camera_moves"])
            # The drill to the same place, where the squeezed picture shows it; then the mouse away.
            w.x(
                "mousemove",
                LEFT + 130 // (2 if mode == "side_by_side" else 1),
                240 // (2 if mode == "top_bottom" else 1),
            )
            w.next(3)  # it has been heard of
            w.until("the drill rests", lambda s: apart(s["at_mm"], s["goal_mm"]) < 1e-3)
            w.x("mousemove", 2, 2)
            w.next(3)
            assert w.state()["view"] == [LEFT, 0, WIDE, HIGH], w.state()["view"]
            places.append(w.state()["at_mm"])
            w.key("s", "screenshot", lambda s: s["message"].startswith("saved"))
            assert w.state()["stereo"] > 0
            w.close()
            pictures[mode] = png(f"{mode}/screenshot-1.png")
    assert all(apart(p, places[0]) < 0.01 for p in places), places
    red, blue = 0, 2
    rows, columns = range(100, 460, 3), range(
        LEFT + 20, 760, 5
    )  # where no card and no cut lies on the picture, squeezed or not
    eyes = pictures["anaglyph"]
    differs = sum(eyes[y][red][x] != eyes[y][blue][x] for y in rows for x in columns)
    assert differs > 1000, "two eyes see two pictures"
    # Interlaced: even rows of the screen are the left eye's, as red of the anaglyph; odd ones the right eye's.
    lines = pictures["interlaced"]
    for y in rows:
        channel = red if y % 2 == 0 else blue
        assert all(abs(lines[y][channel][x] - eyes[y][channel][x]) <= 1 for x in columns), y
    wrong = sum(abs(lines[y][blue][x] - eyes[y][blue][x]) > 1 for y in rows if y % 2 == 0 for x in columns)
    assert wrong > 500, "and not the other's"
    # Squeezed to half: a pixel is the mean of two.
    width = WIDE
    beside, above = pictures["side_by_side"], pictures["top_bottom"]
    for eye, channel in ((0, red), (1, blue)):
        off = [
            abs(
                beside[y][channel][LEFT + eye * width // 2 + x]
                - (eyes[y][channel][LEFT + 2 * x] + eyes[y][channel][LEFT + 2 * x + 1]) / 2
            )
            for y in rows
            for x in range(20, 240, 3)
        ]
        assert sum(d > 2 for d in off) < 0.002 * len(off), (eye, max(off))
        off = [
            abs(above[eye * (HIGH // 2) + y][channel][x] - (eyes[2 * y][channel][x] + eyes[2 * y + 1][channel][x]) / 2)
            for y in range(85, 155, 3)
            for x in columns
        ]
        assert sum(d > 2 for d in off) < 0.002 * len(off), (eye, max(off))
    # Notes of the camera carry the magnification.
    osteo("export", "first", "first.csv")
    notes = pathlib.Path("first-notes.csv").read_text()
    assert "magnification" in notes and "view 1 kept" in notes, notes[:400]
    # Each key of the camera was pressed.
    named = {
        "kBackspace": "BackSpace",
        "kKeypad4": "KP_Left",
        "kKeypad6": "KP_Right",
        "kKeypad8": "KP_Up",
        "kKeypad2": "KP_Down",
        "'['": "bracketleft",
        "']'": "bracketright",
        "','": "comma",
        "'.'": "period",
        "'/'": "slash",
        "';'": "semicolon",
    }
    table = re.findall(
        r"^    \{('.'|k\w+), Command::(\w+)", (source / "libs/app/window/src/keys.cpp").read_text(), re.M
    )
    wanted = {named.get(k, k[1].lower() if k[0] == "'" else k[1:]) for k, command in table if command in CAMERA}
    assert wanted == pressed - {"f"}, (wanted - pressed, pressed - wanted)


if __name__ == "__main__":
    camera()
    print("window camera: all as it should be")

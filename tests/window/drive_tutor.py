#!/usr/bin/env python3
"""Live tutoring and a lesson in the window under Xvfb: others join, hands are led and let go, a link drops and comes back.
usage: drive_tutor.py lesson|live|follow|asked BIN_DIR WORK_DIR SOURCE_DIR"""

import re, signal

from drive_window import *  # what it drives with; the arguments are the same


def invited(w):
    """Address and code, as the window shows them."""
    text = w.until("invites", lambda s: s["tutor"]["invitation"])["tutor"]["invitation"]
    return re.search(r"--join (\S+)", text)[1], re.search(r"code (\S+)", text)[1]


def fades(session, hand):
    """The longest time that the pull's strength of a leader fell for until there was none; s."""
    rows = [r for r in ticks(session) if r["hand"] == str(hand)]
    strength = [int(r["buttons"]) & 127 for r in rows]
    longest, begun = None, 0
    for t, (before, v) in enumerate(zip(strength, strength[1:]), 1):
        if v >= before:  # it rises again where a packet comes after all
            begun = t
        elif v == 0:
            longest = max(longest or 0, (t - begun) / 1000)
    return longest


def live():
    with Screen():
        w = Window("--tutor", "--two-way", "--no-sound", "-o", "taught")
        assert w.state()["tutor"]["title"].startswith("You teach"), w.state()["tutor"]
        # People, steps and harm have a column; the picture is as much narrower.
        s = w.state()
        assert s["view"][0] + s["view"][2] < 1000 - 250 and s["tutor"]["harm"] == [], (s["view"], s["tutor"])
        w.x("mousemove", 408, 350)  # the middle of what the column leaves
        w.next()
        address, code = invited(w)
        guest = subprocess.Popen(
            [
                bin_dir / "osteo",
                "join",
                address,
                "--case-folder",
                "case",
                "--code",
                code,
                "--silence-s",
                "300",
                "--json",
            ],
            stdout=open("guest.json", "w"),
            stderr=open("guest.txt", "w"),
        )
        w.until(
            "the trainee is there, and pulls",
            lambda s: s["tutor"]["heard"] == 1 and s["tutor"]["pull"] == 1 and s["tutor"]["guiding"],
        )
        # The drill finds its way with nobody at it: the hand is let go by itself, and led again when it is there.
        w.key(
            "f",
            "at the bone, led again",
            lambda s: not s["leading"]
            and s["message"].startswith("drill brought to the bone")
            and s["message"].endswith("your hand is led again"),
        )
        w.until("it pulls", lambda s: s["tutor"]["guiding"] and s["tutor"]["pull"] == 1)
        w.key("ctrl+g", "let go", lambda s: not s["tutor"]["guiding"] and s["tutor"]["pull"] == 0)
        w.key("f", "at the bone", lambda s: not s["leading"] and s["message"].startswith("drill brought to the bone"))
        assert not w.state()["tutor"]["guiding"], "who had let go is not led again"
        w.x("mousedown", 1)
        for _ in range(20):
            w.x("key", "Down")
            if w.next()["removed_mm3"] > 0.5:
                break
        w.until("bone goes", lambda s: s["removed_mm3"] > 0.5)
        w.x("mouseup", 1)
        s = w.until("apart", lambda s: 0 <= s["tutor"]["apart_mm"] < 20)
        w.key("s", "screenshot", lambda s: pathlib.Path("taught/screenshot-1.png").exists())
        w.key("ctrl+g", "led", lambda s: s["tutor"]["guiding"] and s["tutor"]["pull"] == 1)
        # A link that drops is told, and comes back.
        guest.send_signal(signal.SIGSTOP)
        w.until("not heard", lambda s: s["tutor"]["heard"] == 0 and s["tutor"]["pull"] == 0)
        guest.send_signal(signal.SIGCONT)
        w.until("heard again", lambda s: s["tutor"]["heard"] == 1 and s["tutor"]["pull"] > 0)
        # One who watches, in a window of his own.
        watcher = Window("--join", address, "--code", code, "--role", "watcher", "--no-sound", "-o", "watched")
        s = watcher.until("all of it", lambda s: s["removed_mm3"] > 0.5 and s["tutor"]["heard"] == 1)
        assert s["tutor"]["title"] == "You watch" and s["view"][2] < 700, (s["tutor"], s["view"])
        watcher.x("windowraise", watcher.id)
        watcher.key("s", "screenshot", lambda s: pathlib.Path("watched/screenshot-1.png").exists())
        watcher.close()
        w.x("windowraise", w.id)
        w.close()
        guest.wait(PATIENCE_S)
    summary, _ = closed("taught")
    closed("watched")  # a part of the same session
    joined = json.loads(pathlib.Path("guest.json").read_text())
    assert joined["bone_hash"] == summary["bone_hash"] and joined["whole"], (joined, summary)
    # The link's fade is of 20 ms of silence and 30 ms.
    assert fades("taught", 1) <= 0.05, fades("taught", 1)
    notes = pathlib.Path("taught-notes.csv").read_text()
    assert "your hand is let go until it is there" in notes, notes
    assert "\"on\":false" in pathlib.Path("taught-notes.csv").read_text().replace('""', '"'), "the wish is a note"


def follow():
    """Who has joined goes on with the host when it saves and goes on (F5) and when it begins anew (R); and one who comes later joins too."""

    def drill(host, mm3):
        host.key(
            "f", "at the bone", lambda s: not s["leading"] and s["message"].startswith("drill brought to the bone")
        )
        host.x("mousedown", 1)
        for _ in range(40):
            host.x("key", "Down")
            if host.next()["removed_mm3"] > mm3:
                break
        host.until("bone goes", lambda s: s["removed_mm3"] > mm3)
        host.x("mouseup", 1)

    def front(w):
        w.x("windowraise", w.id)
        w.x("windowfocus", "--sync", w.id)
        w.x("mousemove", 408, 350)
        w.next()

    with Screen():
        host = Window("--tutor", "--no-sound", "-o", "one")
        host.x("mousemove", 408, 350)
        address, code = invited(host)
        watcher = Window("--join", address, "--code", code, "--role", "watcher", "--no-sound", "-o", "w-one")
        watcher.until("watches", lambda s: s["tutor"]["heard"] == 1)
        front(host)
        drill(host, 0.5)
        watcher.until("sees it", lambda s: s["removed_mm3"] > 0.5)
        begun = watcher.state()["session"]
        two = host.key("F5", "goes on", lambda s: s["session"] != "one" and s["tick"] > 0 and s["tutor"]["invitation"])[
            "session"
        ]
        assert invited(host) == (address, code), "the same place and code"
        followed = watcher.until(
            "follows",
            lambda s: s["session"] != begun and s["tick"] > 0 and s["tutor"]["heard"] == 1 and not s["failure"],
        )["session"]
        front(host)
        drill(host, 0.5)
        watcher.until("sees it", lambda s: s["session"] == followed and s["removed_mm3"] > 0.5)
        # One who comes only now has all that both sessions did.
        late = Window("--join", address, "--code", code, "--role", "watcher", "--no-sound", "-o", "late")
        done = host.state()["removed_mm3"]
        late.until("the same is gone", lambda s: s["tutor"]["heard"] == 1 and abs(s["removed_mm3"] - done) < 1e-3)
        front(late)
        late.close()
        front(host)
        host.key("r", "asks", lambda s: s["asking"])
        three = host.key(
            "Return", "begins anew", lambda s: s["session"] not in ("one", two) and s["tick"] > 0 and not s["asking"]
        )["session"]
        watcher.until(
            "follows",
            lambda s: s["session"] not in (begun, followed)
            and s["tick"] > 0
            and s["tutor"]["heard"] == 1
            and not s["failure"],
        )
        front(watcher)
        watcher.close()
        front(host)
        host.close()
    assert pathlib.Path("late-before/stream.oss").exists()
    for session in ("one", two, three, "w-one", followed, "late"):
        closed(session)


def lesson():
    osteo("rehearse", "case", "--headless", "--fast", "--seconds", "20", "-o", "expert", "--quiet")
    with Screen():
        w = Window("--playback", "expert", "--playback-as", "mode=show", "--no-sound", "-o", "led")
        w.until("it is led", lambda s: s["tutor"]["title"].startswith("Lesson: show") and s["tutor"]["pull"] == 1)
        w.key("ctrl+g", "let go", lambda s: not s["tutor"]["guiding"] and s["tutor"]["pull"] == 0)
        w.key("s", "screenshot", lambda s: pathlib.Path("led/screenshot-1.png").exists())
        w.key("ctrl+g", "led", lambda s: s["tutor"]["guiding"] and s["tutor"]["pull"] == 1)
        w.close()
        # Who teaches, and how, is said in the language of the window.
        english, everywhere = os.environ["LANGUAGE"], os.environ.get("LC_ALL")
        os.environ.update(LANGUAGE="", LC_ALL="de_DE.UTF-8")
        for flags, title in (
            (("--playback", "expert", "--playback-as", "mode=show"), "Lektion: vorführen, "),
            (("--tutor", "--two-way"), "Sie unterrichten; "),
        ):
            w = Window(*flags, "--no-sound", "-o", f"german-{flags[0][2:]}")
            w.until("in German", lambda s: s["tutor"]["title"].startswith(title))
            w.close()
        os.environ["LANGUAGE"] = english
        os.environ.pop("LC_ALL") if everywhere is None else os.environ.update(LC_ALL=everywhere)
    closed("led")
    assert fades("led", 1) <= 0.06, fades("led", 1)


def asked():
    """The code is asked for in the window; a wrong one is refused, and is in no text."""
    with Screen():
        host = Window("--tutor", "--no-sound", "-o", "asked")
        address, code = invited(host)
        for flag in ("--dust", "--heat"):
            refused = subprocess.run(
                [bin_dir / "osteo-rehearse", "case", "--join", address, "--code", code, "--no-sound", flag],
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
            )
            assert refused.returncode == 2 and f"{flag} does not go with --join" in refused.stderr, refused
        app = subprocess.Popen(
            [
                bin_dir / "osteo-rehearse",
                "case",
                "--join",
                address,
                "--role",
                "watcher",
                "--state-file",
                "asking.json",
                "--no-end-page",
                "--no-sound",
                "-o",
                "typed",
            ],
            stderr=open("typed.txt", "w"),
        )
        wait("it asks", lambda: pathlib.Path("asking.json").exists())
        wid = wait("its window", lambda: host.x("search", "--onlyvisible", "--name", "^Osteotome$").split())[-1]
        host.x("windowraise", wid)
        host.x("windowfocus", "--sync", wid)
        host.x("mousemove", "--window", wid, 5, 5)
        time.sleep(0.5)
        host.x("type", "--window", wid, "--delay", "60", code)
        host.x("key", "--window", wid, "Return")
        wait(
            "it watches", lambda: json.loads(pathlib.Path("asking.json").read_text()).get("tutor", {}).get("heard") == 1
        )
        app.terminate()
        app.wait(PATIENCE_S)
        assert code not in pathlib.Path("typed.txt").read_text()
        host.x("windowfocus", host.id)
        host.app.terminate()
        host.app.wait(PATIENCE_S)


if __name__ == "__main__":
    make_case()
    {"lesson": lesson, "live": live, "follow": follow, "asked": asked}[part]()
    print(f"window {part}: all as it should be")

#!/usr/bin/env python3
"""The window in each language at 1024 x 700 under Xvfb: start page, operating, menu, keys, commands, end, course. No text loses a part for want of room, and the
pictures lie in WORK_DIR to be looked at (LANGUAGE-PAGE.png).
usage: drive_languages.py languages BIN_DIR WORK_DIR SOURCE_DIR"""

from drive_window import *  # what it drives with; the arguments are the same

SIZE = ("--width", 1024, "--height", 700, "--quality", "plain")
LOCALES = {"en": "C", "de": "de_DE.UTF-8", "es": "es_ES.UTF-8", "fr": "fr_FR.UTF-8", "zh_CN": "zh_CN.UTF-8"}


def picture(window, name):
    window.next(2)
    if shutil.which("ffmpeg"):  # to be looked at; nothing else depends on them
        grab = ["-f", "x11grab", "-video_size", "1024x700", "-i", os.environ["DISPLAY"], "-frames:v", "1"]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *grab, f"{name}.png"])


def languages():
    make_case()
    cut = {}
    with Screen("1024x700"):
        for language, locale in LOCALES.items():
            # The locales need not be installed.
            os.environ.update(LANGUAGE="", LC_ALL=locale)
            # Where one chooses a case.
            start = Window(*SIZE, case=None)
            s = start.until("the list", lambda s: s.get("page") == "start" and s["pictures"] > 2)
            assert s["language"] == language, (s["language"], language)
            picture(start, f"{language}-start")
            start.close()
            w = Window(*SIZE, "--dust", "--no-sound", "-o", f"session-{language}", end_page=True)
            s = w.until("a picture", lambda s: s["at_rest"])
            assert s["language"] == language, (s["language"], language)
            picture(w, f"{language}-operate")
            w.key("F10", "the menu", lambda s: s["settings"])
            picture(w, f"{language}-menu")
            w.key("Escape", "away", lambda s: not s["settings"])
            w.key("F1", "the help", lambda s: s["help"])
            picture(w, f"{language}-help")
            w.key("F1", "all commands", lambda s: s["typing"])
            picture(w, f"{language}-commands")
            w.key("Escape", "away", lambda s: not s["help"])
            for key, name in (
                ("x", "saw"),
                ("Escape", None),
                ("p", "pieces"),
                ("Escape", None),
                ("l", "plate"),
                ("Escape", None),
            ):
                w.x("key", key)
                if name:
                    picture(w, f"{language}-{name}")
            w.key("r", "asks", lambda s: s["asking"])
            picture(w, f"{language}-question")
            w.key("Escape", "no", lambda s: not s["asking"])
            w.key("F2", "plan", lambda s: s["layout"] == "plan")
            picture(w, f"{language}-plan")
            w.key("F2", "operate, which is kept", lambda s: s["layout"] == "operate")
            w.x("key", "q")
            w.until("the end", lambda s: s["ended"] and s["review_s"] > 0)
            picture(w, f"{language}-end")
            w.key("ctrl+t", "the course of the session", lambda s: s["timeline"])
            picture(w, f"{language}-course")
            cut[language] = w.state()["texts_cut"]
            w.x("key", "q")
            w.end()
    print(json.dumps(cut, ensure_ascii=False, indent=1))
    # What has no room in English either is a name or a figure; of the rest nothing may be lost.
    for language, texts in cut.items():
        assert not texts, (language, texts)


languages()
print(f"window {part}: all as it should be")

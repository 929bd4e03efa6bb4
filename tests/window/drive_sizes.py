#!/usr/bin/env python3
"""The window, the editor and the nerve console at small sizes with text of once and twice its size, dark and light: nothing outside the
window, nothing on something else, no text cut. The pictures lie in WORK_DIR to be looked at (NAME-SIZE-SCALE.png).
usage: drive_sizes.py sizes BIN_DIR WORK_DIR SOURCE_DIR"""

from drive_window import *  # what it drives with; the arguments are the same

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from free_port import free_port

SIZES = [(1024, 700), (1280, 800)]


def picture(size, name):
    if shutil.which("ffmpeg"):  # to be looked at; nothing else depends on them
        grab = ["-f", "x11grab", "-video_size", size, "-i", os.environ["DISPLAY"], "-frames:v", "1"]
        subprocess.run(["ffmpeg", "-v", "error", "-y", *grab, f"{name}.png"])


def overlap(a, b):
    return (
        min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0]) > 1.5 and min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1]) > 1.5
    )


def look(w, size, name, over=()):
    """`over`: windows that lie over others because somebody opened them."""
    s = w.until(name, lambda s: s["pictures"] > 2)
    n = s["pictures"]
    # A list that has just become longer has its scroll bar in the picture after the next.
    s = w.until("it stands, and nothing is cut off", lambda s: s["pictures"] > n + 3 and not s["windows_cut"])
    picture(size, name)
    wide, high = map(int, size.split("x"))
    # Not those within others, nor what the mouse asked for.
    boxes = {k: v for k, v in s["windows"].items() if "/" not in k and not k.startswith("##Tooltip")}
    for k, (x0, y0, dx, dy) in boxes.items():
        assert x0 >= -1 and y0 >= -1 and x0 + dx <= wide + 1 and y0 + dy <= high + 1, (name, k, boxes[k])
    names = [k for k in boxes if k not in over]
    for n, a in enumerate(names):
        for b in names[:n]:
            assert not overlap(boxes[a], boxes[b]), (name, a, boxes[a], b, boxes[b])
    assert not s["texts_cut"], (name, s["texts_cut"])
    return s


def window(size, scale, theme):
    wide, high = map(int, size.split("x"))
    flags = ["--width", wide, "--height", high, "--scale", scale, "--quality", "plain", "--no-sound"]
    folder = f"{size}-{scale}"
    w = Window("--dust", "--monitor", *flags, "-o", folder, end_page=True)
    s = w.until("a picture", lambda s: s["at_rest"])
    assert s["em_pixels"] == 16 * scale, (s["em_pixels"], scale)
    look(w, size, f"operate-{folder}")
    w.key("ctrl+n", "no monitor", lambda s: not s["monitor"]["shown"])
    look(w, size, f"quiet-{folder}")
    w.key("F10", "settings", lambda s: s["settings"])
    look(w, size, f"settings-{folder}", over=("settings",))
    w.key("Escape", "away", lambda s: not s["settings"])
    for key, name in (("x", "saw"), ("l", "plate"), ("p", "piece")):
        w.key(key, name, lambda s: s["hand"] == name)
        look(w, size, f"{name}-{folder}", over=("first steps",))
        w.key("Escape", "drill", lambda s: s["hand"] == "drill")
    w.key("ctrl+k", "commands", lambda s: s["typing"])
    look(w, size, f"commands-{folder}", over=("commands",))
    w.key("Escape", "away", lambda s: not s["typing"])
    w.key("F2", "plan, or why not", lambda s: s["layout"] == "plan" or "no room" in s["message"])
    look(w, size, f"plan-{folder}")
    w.key("F2", "operate", lambda s: s["layout"] == "operate")
    w.key("F3", "a cut in the middle", lambda s: s["cut_in_middle"] == 0)
    w.key("F3", "and back", lambda s: s["cut_in_middle"] == -1)
    w.x("key", "q")
    w.until("the end", lambda s: s["ended"] and s["review_s"] > 0)
    look(w, size, f"end-{folder}")
    w.key("ctrl+t", "the course", lambda s: s["timeline"])
    look(w, size, f"course-{folder}")
    w.x("key", "q")
    w.end()


def others(size, scale, theme):
    wide, high = map(int, size.split("x"))
    flags = ["--width", wide, "--height", high, "--scale", scale]
    edit = Program([bin_dir / "osteo-edit", "case", *flags], "Osteotome edit")
    edit.until("3D", lambda s: s["triangles"] > 0 and not s["previewing"])
    for n, tool in ((3, "Threshold"), (5, "Small fragments"), (9, "Brush")):
        edit.x("mousemove", wide * 2 // 3, high // 4)
        edit.key(n, tool, lambda s: s["tool"] == tool)
        look(edit, size, f"edit-{n}-{size}-{scale}-{theme}")
    edit.key("F1", "help", lambda s: s["help"])
    look(edit, size, f"edit-help-{size}-{scale}-{theme}", over=("Mouse and keys",))
    edit.key("F1", "away", lambda s: not s["help"])
    edit.x("key", "q")
    edit.end()
    port = free_port()
    live = subprocess.Popen(
        [bin_dir / "osteo", "rehearse", "case", "--headless", "--seconds", "600", "-o", f"heard-{size}-{scale}-{theme}"]
        + ["--stream", f"igtl:{port}", "--quiet"]
    )
    try:
        console = Program([bin_dir / "osteo", "nerve-console", port, "--no-sound", *flags], "Osteotome nerve monitor")
        console.until("channels", lambda s: s["connected"] and s.get("channels"))
        look(console, size, f"console-{size}-{scale}-{theme}")
        console.x("windowfocus", "--sync", console.id)
        console.key("g", "by stimulus", lambda s: s["answers"])
        look(console, size, f"console-answers-{size}-{scale}-{theme}")
        console.x("key", "q")
        console.end()
    finally:
        live.send_signal(signal.SIGINT)
        live.wait(PATIENCE_S)


def sizes():
    osteo("phantom", "ct.nrrd", "--labels-out", "l.nrrd", "--region", "temporal", "--spacing-mm", 1, "--quiet")
    osteo(
        *("prepare", "ct.nrrd", "-o", "case", "--spacing-mm", 1, "--structures", "l.nrrd", "--no-report", "--quiet"),
        *("--names", "6=facial nerve, 13=chorda tympani"),
    )
    settings = work / "config/osteotome/settings.json"
    settings.parent.mkdir(parents=True)
    for theme in ("dark", "light"):
        settings.write_text(json.dumps({"osteotome_settings": 1, "theme": theme}))
        for wide, high in SIZES:
            for scale in (1, 2):
                size = f"{wide}x{high}"
                with Screen(size):
                    if theme == "dark":
                        window(size, scale, theme)
                    others(size, scale, theme)
                print(f"ok  {size} at {scale}, {theme}", flush=True)


sizes()
print(f"window {part}: all as it should be")

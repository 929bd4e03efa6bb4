#!/usr/bin/env python3
"""Draws the sketches of window.md as SVG and prints the contrast table. usage: sketches.py (needs Pillow; reads ../images, tabler.json)

Numbers and names in the sketches are invented. Bone and cuts are the project's own pictures of the phantom (../images).
"""

import base64, io, json, pathlib
from PIL import Image

here = pathlib.Path(__file__).parent
ICONS = json.loads((here / "tabler.json").read_text())
# Instruments of our own, 24 x 24, stroke 2, as Tabler's.
ICONS |= {
    "drill": ["M4 17a3 3 0 1 0 6 0a3 3 0 1 0 -6 0", "M9.5 14.5l5 -5", "M13 8l3 3l5 -5l-3 -3z"],
    "saw": ["M3 15h14v-4h-14z", "M4 15v2m3 -2v2m3 -2v2m3 -2v2", "M17 11l4 -2v8l-4 -2"],
    "plate": [
        "M3 12a2.5 2.5 0 0 1 4.5 -1.5h1.5a2.5 2.5 0 0 1 6 0h1.500a2.500 2.500 0 1 1 0 3h-1.500a2.500 2.500 0 0 1 -6 0h-1.500a2.500 2.500 0 0 1 -4.500 -1.500",
        "M5.500 12h.01m6.490 0h.01m6.490 0h.01",
    ],
    "fragments": ["M4 5l6 -1l1 6l-6 2z", "M14 4l6 2l-2 6l-4 -2z", "M7 15l7 -2l4 5l-7 3z"],
    "suction": ["M3 20c5 0 7 -4 9 -8l4 -8", "M19 5l-4 -2", "M4 15v.01m3 -4v.01m-4 0v.01"],
    "probe": ["M5 20a1 1 0 1 0 0 -.01", "M6 19l13 -15"],
}
DARK = dict(
    ground="#10151C",
    surface="#171E27",
    raised="#212A35",
    line="#6C7B8A",
    text="#EDF1F5",
    quiet="#A9B4C0",
    accent="#8C8CFF",
)
LIGHT = dict(
    ground="#F1F4F7",
    surface="#FFFFFF",
    raised="#E3E8ED",
    line="#75828F",
    text="#141C24",
    quiet="#47535F",
    accent="#4A3FC4",
)
HIGH = dict(
    ground="#000000",
    surface="#000000",
    raised="#1A1A1A",
    line="#FFFFFF",
    text="#FFFFFF",
    quiet="#FFFFFF",
    accent="#B9B0FF",
)
STATUS = dict(note="#56B4E9", near="#F0E442", close="#E69F00", contact="#D55E00", good="#009E73")
C = DARK
FONT = "'Noto Sans','DejaVu Sans',sans-serif"


def lum(h):
    f = lambda c: c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
    r, g, b = (f(int(h[i : i + 2], 16) / 255) for i in (1, 3, 5))
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def ratio(a, b):
    hi, lo = sorted((lum(a), lum(b)), reverse=True)
    return (hi + 0.05) / (lo + 0.05)


def picture(name, box, size, quality=64):
    im = Image.open(here / "../images" / name).convert("RGB").crop(box).resize(size, Image.LANCZOS)
    data = io.BytesIO()
    im.save(data, "JPEG", quality=quality, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(data.getvalue()).decode()


PICTURES = {
    "cavity": (("window.png", (288, 20, 1088, 500), (1000, 600)), 5 / 3),
    "whole": (("session-mastoid.png", (0, 60, 530, 560), (636, 600)), 1.06),
    "axial": (("window.png", (1132, 126, 1302, 296), (306, 306)), 1),
    "coronal": (("window.png", (1132, 362, 1302, 532), (306, 306)), 1),
    "sagittal": (("structures-ear.png", (130, 560, 560, 920), (307, 257)), 1.2),
    "plan_axial": (("structures-ear.png", (150, 10, 560, 490), (410, 480)), 0.854),
    "plan_coronal": (("structures-ear.png", (810, 20, 1220, 490), (410, 470)), 0.872),
    "plan_sagittal": (("structures-ear.png", (60, 505, 640, 985), (580, 480)), 1.208),
    "jaw": (("saw-by-hand.png", (0, 0, 760, 415), (440, 240)), 1.83),
    "ear": (("session-mastoid.png", (0, 40, 540, 580), (300, 300)), 1),
    "head": (("light.png", (530, 410, 1040, 700), (422, 240)), 1.76),
    "skull": (("light.png", (680, 900, 900, 1120), (280, 280)), 1),
}


class Sketch:
    def __init__(self, w, h, title, words):
        self.w, self.h, self.used, self.out = w, h, {}, []
        self.title, self.words, self.clips = title, words, 0
        self.rect(0, 0, w, h, C["ground"])

    def add(self, s):
        self.out.append(s)

    def rect(self, x, y, w, h, fill="none", r=0, stroke=None, sw=1, op=None):
        self.add(
            f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" rx="{r}" fill="{fill}"'
            + (f' stroke="{stroke}" stroke-width="{sw}"' if stroke else "")
            + (f' fill-opacity="{op}"' if op is not None else "")
            + "/>"
        )

    def text(self, x, y, s, size=16, fill=None, weight=400, anchor="start"):
        s = s.replace("&", "&amp;").replace("<", "&lt;")
        self.add(
            f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{fill or C["text"]}"'
            + (f' font-weight="{weight}"' if weight != 400 else "")
            + (f' text-anchor="{anchor}"' if anchor != "start" else "")
            + f">{s}</text>"
        )

    def lines(self, x, y, rows, size=16, fill=None, step=24):
        for n, row in enumerate(rows):
            self.text(x, y + n * step, row, size, fill)

    def path(self, d, stroke=None, sw=2, fill="none", more=""):
        self.add(f'<path d="{d}" fill="{fill}" stroke="{stroke or "none"}" stroke-width="{sw}" {more}/>')

    def icon(self, name, x, y, size=24, fill=None):
        k = size / 24
        self.add(
            f'<g transform="translate({x:g} {y:g}) scale({k:g})" fill="none" stroke="{fill or C["text"]}" stroke-width="{2 if size > 20 else 2.2}" stroke-linecap="round" stroke-linejoin="round">'
            + "".join(f'<path d="{d}"/>' for d in ICONS[name])
            + "</g>"
        )

    def image(self, key, x, y, w, h, r=0):
        """Covers the box."""
        args, aspect = PICTURES[key]
        self.used[key] = args
        iw, ih = (w, w / aspect) if w / h > aspect else (h * aspect, h)
        self.clips += 1
        self.add(
            f'<clipPath id="c{self.clips}"><rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" rx="{r}"/></clipPath>'
            f'<g clip-path="url(#c{self.clips})"><use href="#{key}" transform="translate({x + (w - iw) / 2:.1f} {y + (h - ih) / 2:.1f}) scale({iw / 1000:.4f} {ih / 1000:.4f})"/></g>'
        )

    # Components, once each.
    def tile(self, x, y, name, key="", on=False, off=False, size=40):
        if on == "lit":
            self.rect(x, y, size, size, C["raised"], 8)
            self.rect(x + 12, y + size - 6, size - 24, 3, C["text"], 1.5)
        elif on:
            self.rect(x, y, size, size, C["raised"], 8, C["accent"], 2)
            self.rect(x, y + 8, 4, size - 16, C["accent"], 2)
        self.icon(
            name,
            x + (size - 24) / 2,
            y + (size - 24) / 2,
            24,
            C["line"] if off else C["text"] if on else "#CFD7DF" if C is DARK else C["text"],
        )

    def button(self, x, y, w, s, name=None, main=False, quiet=False, h=40):
        self.rect(
            x, y, w, h, C["text"] if main else "none" if quiet else C["raised"], 8, None if main or quiet else C["line"]
        )
        ink = C["ground"] if main else C["text"]
        dx = 32 if name else 0
        if name:
            self.icon(name, x + 12, y + h / 2 - 10, 20, ink)
        self.text(x + (w + dx) / 2 - (4 if name else 0), y + h / 2 + 6, s, 16, ink, 600 if main else 400, "middle")

    def segments(self, x, y, items, on, widths, h=40):
        self.rect(x, y, sum(widths), h, C["ground"], 8, C["line"])
        for n, (s, w) in enumerate(zip(items, widths)):
            if n == on:
                self.rect(x + 2, y + 2, w - 4, h - 4, C["raised"], 6, C["accent"], 2)
            self.text(
                x + w / 2, y + h / 2 + 6, s, 16, C["text"] if n == on else C["quiet"], 600 if n == on else 400, "middle"
            )
            x += w

    def sign(self, x, y, state, r=9):
        c = STATUS[state]
        if C is LIGHT:  # yellow and orange alone would be too faint on white
            k = len(self.out)
            self.shape(x, y, state, r, c)
            self.out[k:] = [
                (
                    part.replace('stroke="none" stroke-width="2"', 'stroke="#141C24" stroke-width="1.5"').replace(
                        "/>", ' stroke="#141C24" stroke-width="1.5"/>'
                    )
                    if "circle" in part
                    else part.replace('stroke="none" stroke-width="2"', 'stroke="#141C24" stroke-width="1.5"')
                )
                for part in self.out[k:]
            ]
        else:
            self.shape(x, y, state, r, c)

    def shape(self, x, y, state, r, c):
        if state == "near":
            self.path(f"M{x} {y - r}l{r} {1.8 * r}h{-2 * r}z", fill=c)
        elif state == "close":
            self.path(f"M{x} {y - r}l{r} {r}l{-r} {r}l{-r} {-r}z", fill=c)
        elif state == "contact":
            k = r * 0.42
            self.path(
                f"M{x - k} {y - r}h{2 * k}l{r - k} {r - k}v{2 * k}l{k - r} {r - k}h{-2 * k}l{k - r} {k - r}v{-2 * k}z",
                fill=c,
            )
        else:
            self.add(f'<circle cx="{x}" cy="{y}" r="{r * .8:g}" fill="{c}"/>')

    def chip(self, x, y, w, state, s, full=False):
        c = STATUS[state]
        self.rect(x, y, w, 32, c if full else C["raised"], 16, c, 1.5)
        if full:
            self.path(f"M{x + 20} {y + 8}v9m0 5v.1", "#000", 3, more='stroke-linecap="round"')
        else:
            self.sign(x + 20, y + 16, state)
        self.text(x + 36, y + 22, s, 16, "#000000" if full else C["text"], 600 if full else 400)

    def slider(self, x, y, w, name, value, share):
        self.text(x, y + 21, name, 16, C["quiet"])
        self.text(x + w, y + 21, value, 16, anchor="end")
        self.rect(x, y + 34, w, 4, C["line"], 2)
        self.add(f'<circle cx="{x + w * share:g}" cy="{y + 36}" r="8" fill="{C["text"]}"/>')

    def switch(self, x, y, w, s, on, note=""):
        self.text(x, y + 21, s, 16)
        if note:
            self.text(x, y + 41, note, 14, C["quiet"])
        self.rect(x + w - 40, y + 5, 40, 22, C["raised"] if not on else C["text"], 11, C["line"])
        self.add(
            f'<circle cx="{x + w - (11 if on else 29)}" cy="{y + 16}" r="7" fill="{C["ground"] if on else C["quiet"]}"/>'
        )

    def key(self, x, y, s, w=None):
        w = w or max(28, 12 + 8.5 * len(s))
        self.rect(x, y, w, 24, C["raised"], 4, C["line"])
        self.text(x + w / 2, y + 17, s, 14, C["text"], 400, "middle")
        return w

    def burr(self, x, y, mm, px=3.78, diamond=False, on=False, shape="ball"):
        r = max(1.9, mm * px / 2)
        if on:
            self.rect(x - 19, y - 19, 38, 38, C["raised"], 8, C["accent"], 2)
        self.path(f"M{x} {y - r}V{y - r - 8}", "#9AA5B1", max(1.5, r * 0.35))
        if shape == "ball":
            self.add(f'<circle cx="{x}" cy="{y}" r="{r:g}" fill="url(#{"grit" if diamond else "metal"})"/>')
            if not diamond and mm > 2:
                for k in (-0.5, 0, 0.5):
                    self.path(f"M{x + k * r} {y - r * .85}q{r * .45} {r * .85} 0 {r * 1.7}", "#4B545D", 0.9)

    def bar(self, x, y, w, share, state):
        self.rect(x, y, w, 8, C["raised"], 4)
        self.rect(x, y, max(8, w * share), 8, STATUS[state], 4)

    def save(self, name):
        defs = "".join(
            f'<image id="{k}" width="1000" height="1000" preserveAspectRatio="none" href="{picture(*a)}"/>'
            for k, a in self.used.items()
        )
        defs += (
            '<radialGradient id="metal" cx=".35" cy=".3" r=".8"><stop offset="0" stop-color="#F7F9FB"/><stop offset=".5" stop-color="#A7B0BA"/><stop offset="1" stop-color="#4A535C"/></radialGradient>'
            '<radialGradient id="grit" cx=".35" cy=".3" r=".8"><stop offset="0" stop-color="#E8DDB8"/><stop offset=".6" stop-color="#A39468"/><stop offset="1" stop-color="#574D32"/></radialGradient>'
        )
        (here / name).write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.w} {self.h}" width="{self.w}" height="{self.h}" font-family="{FONT}" role="img" aria-labelledby="t d">\n'
            f'<title id="t">{self.title}</title><desc id="d">{self.words}</desc>\n<defs>{defs}</defs>\n'
            + "\n".join(self.out)
            + "\n</svg>\n"
        )


STRIP, STATE = 56, 64


def strip(s, on="drill", held=()):
    """Tools at the left: what is in the hand, the second hand, what is done, what is looked at; the menu above, commands below."""
    s.rect(0, 0, STRIP, s.h, C["surface"])
    s.tile(8, 8, "menu-2")
    y = 56
    groups = [
        ["drill", "saw", "plate", "fragments"],
        ["suction", "droplet"],
        ["arrow-bar-to-down", "arrow-bar-up", "arrow-back-up"],
        ["versions", "ruler-measure", "note", "camera"],
    ]
    tight = s.h < 800
    for group in groups:
        s.rect(12, y, 32, 1, C["line"])
        y += 4 if tight else 8
        for name in group:
            s.tile(8, y, name, on="lit" if name in held else name == on)
            y += 40 if tight else 44
        y += 4
    s.tile(8, s.h - 48, "command")


def state(s, near=("near", "sigmoid sinus", "1.4 mm", 0.72), message=None, time="1:46", volume="627 mm³"):
    """What is going on, at the bottom; each number always in its place."""
    x0, y = STRIP, s.h - STATE
    s.rect(x0, y, s.w - x0, STATE, C["surface"])
    wide = s.w >= 1200
    col = [(88, "Force", "1.2 N", 24), (88, "Speed", "60 000/min", 24), (128, "Bone below", "1.7 mm", 24)]
    x = x0 + 16
    for w, name, value, size in zip(
        (88, 128, 128), ("Force", "Burr, per min", "Bone below"), ("1.2 N", "60 000", "1.7 mm"), (24, 24, 24)
    ):
        s.text(x, y + 22, name, 14, C["quiet"])
        s.text(x, y + 50, value, size, weight=600)
        x += w if wide else w - 16
    w = 344 if wide else 256
    st, name, dist, share = near
    s.text(x, y + 22, name, 14 if not wide else 16, C["text"])
    s.sign(x + w - (78 if wide else 74), y + 17, st, 8)
    s.text(x + w, y + 23, dist, 16, weight=600, anchor="end")
    s.bar(x, y + 40, w, share, st)
    x += w + 24
    if message and wide:
        s.chip(x, y + 16, 40 + 8.6 * len(message[1]), *message)
    s.text(s.w - 24 - (104 if wide else 88), y + 28, time, 16, anchor="end")
    s.text(s.w - 24 - (104 if wide else 88), y + 50, volume, 14, C["quiet"], anchor="end")
    s.button(s.w - (112 if wide else 96), y + 12, 96 if wide else 80, "End …")


def drill_card(s, x, y, size=4):
    """Beside the instrument in hand: only what belongs to it. Burrs as large as they are."""
    w = 560 if s.w >= 1200 else 520
    s.rect(x, y, w, 64, C["surface"], 12, op=0.94)
    s.segments(x + 12, y + 12, ("Cutting", "Diamond"), 0, (88, 96) if s.w >= 1200 else (80, 88))
    bx = x + (228 if s.w >= 1200 else 208)
    for mm in range(1, 8):
        s.burr(bx + (mm - 1) * 40 + 4, y + 26, mm, 3.3, on=False)
        if mm == size:
            s.rect(bx + (mm - 1) * 40 - 15, y + 4, 38, 56, "none", 8, C["accent"], 2)
        s.text(bx + (mm - 1) * 40 + 4, y + 57, str(mm), 14, C["text"] if mm == size else C["quiet"], 400, "middle")
    s.text(bx + 276, y + 57, "mm", 14, C["quiet"], 400, "middle")
    s.icon("chevron-down", x + w - 32, y + 20, 24, C["quiet"])


def cut(s, x, y, w, h, key, name, letters="", cross=True, field=True):
    s.rect(x - 1, y - 1, w + 2, h + 2, "#000", 8, C["line"])
    s.image(key, x, y, w, h, 7)
    s.rect(x + 6, y + 6, 12 + 8.6 * len(name), 24, "#000", 4, op=0.75)
    s.text(x + 12, y + 23, name, 14, "#EDF1F5")


def operate(
    w,
    h,
    name,
    extra=None,
    near=("near", "sigmoid sinus", "1.4 mm", 0.72),
    message=("near", "Thin bone over the sinus"),
    on="drill",
):
    s = Sketch(
        w,
        h,
        "Operate",
        "The bone fills the picture; tools at the left, the state below, three cuts at the right or one cut on a small screen.",
    )
    s.image("cavity", STRIP, 0, w - STRIP, h - STATE)
    strip(s, on, ("droplet",))
    drill_card(s, STRIP + 16, 16)
    if w >= 1200:
        side = 200
        for n, (k, t) in enumerate((("axial", "Axial"), ("coronal", "Coronal"), ("sagittal", "Sagittal"))):
            cut(s, w - side - 16, 16 + n * (side + 8), side, side, k, t)
        s.text(w - 16 - side, 16 + 3 * (side + 8) + 16, "", 14)
        bx = w - side - 232
    else:
        side = 200
        cut(s, w - side - 16, 16, side, side, "axial", "Axial")
        s.segments(w - side - 16, 16 + side + 8, ("A", "C", "S", "Drill"), 0, (44, 44, 44, 68), 32)
        bx = w - 128
    y = h - STATE - 24
    s.rect(bx - 12, y - 28, 120, 40, "#000", 8, op=0.6)
    s.text(bx + 48, y - 8, "5 mm", 14, "#EDF1F5", 400, "middle")
    s.path(f"M{bx} {y}h96", "#EDF1F5", 3)
    if w < 1200 and message:
        s.chip(STRIP + 16, h - STATE - 48, 40 + 8.8 * len(message[1]), *message)
    state(s, near, message)
    if extra:
        extra(s)
    s.save(name)


def key_card(s):
    x, y, w = STRIP + 16, s.h - STATE - 16 - 320, 304
    s.rect(x, y, w, 320, C["surface"], 12, C["line"], op=0.96)
    s.text(x + 16, y + 30, "Ten keys", 16, weight=600)
    s.icon("x", x + w - 36, y + 12, 20, C["quiet"])
    rows = (
        ("left button", "drill"),
        ("Shift-wheel", "deeper, back"),
        ("F", "approach"),
        ("U", "retract"),
        ("1 – 7", "burr size"),
        ("V", "suction, while held"),
        ("I", "irrigation on, off"),
        ("Z", "undo"),
        ("W", "compare with start"),
        ("Ctrl-K", "all commands"),
    )
    for n, (k, t) in enumerate(rows):
        s.key(x + 16, y + 44 + n * 27, k, 104)
        s.text(x + 136, y + 62 + n * 27, t, 16)
    # The next step, where the eye is.
    px, py = STRIP + 616, 96
    s.rect(px - 240, py + 4, 392, 112, C["surface"], 12, C["line"], op=0.96)
    s.text(px - 224, py + 32, "2 of 11: take one stroke back", 16, weight=600)
    s.text(px - 224, py + 58, "Press Z. Again takes the stroke before.", 16)
    s.rect(px - 224, py + 72, 360, 4, C["raised"], 2)
    s.rect(px - 224, py + 72, 66, 4, C["text"], 2)
    s.text(px - 224, py + 100, "Skip this list", 14, C["quiet"])
    s.icon("circle-check", px + 116, py + 84, 20, C["quiet"])


def palette(s):
    w, h = 560, 400
    x, y = (s.w - w) / 2, 88
    s.rect(x, y, w, h, C["surface"], 12, C["line"])
    s.rect(x + 12, y + 12, w - 24, 48, C["ground"], 8, C["accent"], 2)
    s.icon("search", x + 26, y + 24, 24, C["quiet"])
    s.text(x + 62, y + 42, "pat", 20)
    s.path(f"M{x + 94} {y + 24}v24", C["text"], 2)
    rows = (
        ("hand-stop", "Patient position: supine", "", True),
        ("rotate-clockwise", "Patient position: head turned 30°", "", False),
        ("layout-grid", "Plan: regions to remove and keep", "Ctrl-L", False),
        ("bone", "Plates: take one", "L", False),
        ("drill", "Haptics: path to follow", "", False),
    )
    for n, (i, t, k, on) in enumerate(rows):
        yy = y + 72 + n * 52
        if on:
            s.rect(x + 12, yy, w - 24, 48, C["raised"], 8, C["accent"], 2)
        s.icon(i, x + 28, yy + 12, 24, C["quiet"])
        s.text(x + 64, yy + 30, t, 16)
        if k:
            kw = 64
            s.key(x + w - 28 - kw, yy + 12, k, kw)
    s.rect(x + 12, y + h - 48, w - 24, 1, C["line"])
    s.text(x + 28, y + h - 18, "↑ ↓ choose,  Enter runs it,  Esc closes", 14, C["quiet"])
    s.text(x + w - 28, y + h - 18, "5 of 96", 14, C["quiet"], anchor="end")


def head(s, title, on):
    """Screens that are pages have their name and the way to the others above."""
    s.rect(0, 0, s.w, 56, C["surface"])
    s.icon("bone", 20, 14, 28)
    s.text(60, 36, "Osteotome", 20, weight=600)
    names, widths = ("Open", "Plan", "Operate", "Review", "Teach"), (80, 80, 104, 96, 88)
    s.segments((s.w - 448) / 2, 8, names, names.index(on), widths)
    s.icon("search", s.w - 136, 16, 24, C["quiet"])
    s.key(s.w - 104, 16, "Ctrl-K", 60)
    s.icon("settings", s.w - 36, 16, 24, C["quiet"])


def card(s, x, y, w, h, pic, title, sub, chip=None, on=False, bad=None):
    s.rect(x, y, w, h, C["surface"], 12, C["accent"] if on else C["raised"], 2 if on else 1)
    ph = h - 96
    if pic:
        s.image(pic, x + 3, y + 3, w - 6, ph - 3, 10)
    else:
        s.rect(x + 3, y + 3, w - 6, ph - 3, C["ground"], 10)
        s.icon("file-alert", x + w / 2 - 20, y + ph / 2 - 20, 40, C["quiet"])
    s.text(x + 16, y + ph + 26, title, 16, weight=600)
    s.text(x + 16, y + ph + 48, sub, 14, C["quiet"])
    if bad:
        s.sign(x + 24, y + ph + 70, "close", 8)
        s.text(x + 40, y + ph + 76, bad, 14)
    elif chip:
        s.icon(chip[0], x + 16, y + ph + 59, 20, STATUS["good"] if chip[0] == "shield-check" else C["quiet"])
        s.text(x + 42, y + ph + 75, chip[1], 14, C["text"])


def open_(w, h, name):
    s = Sketch(
        w,
        h,
        "Open",
        "Cases as pictures with approval and last session; the chosen case's switches and the button Operate at the right.",
    )
    head(s, "Open", "Open")
    wide = w >= 1200
    pane = 376 if wide else 328
    gw = w - pane - 48
    s.text(24, 96, "Cases", 24, weight=600)
    s.button(24 + gw - (304 if wide else 152), 68, 144, "Open folder", "folder-open")
    if wide:
        s.button(24 + gw - 152, 68, 152, "Prepare CT …", "plus")
    cols = 3 if wide else 2
    cw = (gw - 16 * (cols - 1)) / cols
    ch = 248 if wide else 264
    cards = [
        ("ear", "Demo ear", "comes with Osteotome", ("info-circle", "try it: no patient"), False, None),
        ("cavity", "Temporal bone, left", "0.3 mm · today 9:40", ("shield-check", "approved 21 Nov"), True, None),
        ("jaw", "Jaw", "0.5 mm · 2 sessions", ("shield-check", "approved 3 Nov"), False, None),
        ("head", "Head, UNC", "0.5 mm · public CT", ("clock", "not approved"), False, None),
        ("skull", "Skull phantom", "0.5 mm · 1 session", ("clock", "not approved"), False, None),
        (None, "Temporal bone, right", "no grid: prepare stopped", None, False, "prepare it again"),
    ]
    for n, c in enumerate(cards[: cols * 2 if wide else 4]):
        card(s, 24 + (n % cols) * (cw + 16), 128 + (n // cols) * (ch + 16), cw, ch, c[0], c[1], c[2], c[3], c[4], c[5])
    yb = 128 + 2 * (ch + 16)
    if wide:
        s.text(24, yb + 24, "Last sessions", 20, weight=600)
        for n, (t, u, v) in enumerate(
            (
                ("Temporal bone, left", "today 9:40 · 24 min", "nearest 0.4 mm, sinus"),
                ("Jaw", "yesterday · 11 min", "2 cuts, 1 plate"),
                ("Demo ear", "18 Nov · 6 min", "627 mm³ removed"),
            )
        ):
            yy = yb + 40 + n * 48
            s.rect(24, yy, gw, 44, C["surface"], 8)
            s.icon("player-play", 36, yy + 12, 20, C["quiet"])
            s.text(72, yy + 28, t, 16)
            s.text(304, yy + 28, u, 16, C["quiet"])
            s.text(24 + gw - 16, yy + 28, v, 16, anchor="end")
    px = w - pane
    s.rect(px, 56, pane, h - 56, C["surface"])
    x, pw = px + 24, pane - 48
    s.text(x, 96, "Temporal bone, left", 20, weight=600)
    s.text(x, 122, "facial nerve, sigmoid sinus, dura, 6 more", 14, C["quiet"])
    s.text(x, 160, "Procedure", 14, C["quiet"])
    s.rect(x, 168, pw, 40, C["raised"], 8, C["line"])
    s.text(x + 12, 194, "Cortical mastoidectomy", 16)
    s.icon("chevron-down", x + pw - 36, 176, 24, C["quiet"])
    rows = [
        ("Bone dust and irrigation", True),
        ("Sound", True),
        ("Heat", False),
        ("Nerve monitor", False),
        ("Hints", False),
        ("Second device", False),
    ]
    step = 40 if wide else 36
    for n, (t, on) in enumerate(rows):
        s.switch(x, 224 + n * step, pw, t, on)
    yy = 224 + len(rows) * step + 8
    s.text(x, yy + 14, "Patient position", 14, C["quiet"])
    s.rect(x, yy + 22, pw, 40, C["raised"], 8, C["line"])
    s.text(x + 12, yy + 48, "Supine, head turned 30°", 16)
    s.icon("chevron-down", x + pw - 36, yy + 30, 24, C["quiet"])
    s.button(x, h - 72, pw - 120 if not wide else pw - 136, "Operate", "drill", main=True, h=48)
    s.button(x + pw - (112 if not wide else 128), h - 72, 112 if not wide else 128, "Plan", "target", h=48)
    s.save(name)


def plan(w, h, name):
    s = Sketch(
        w,
        h,
        "Plan",
        "Four pictures of one size; structures, regions and planned cuts in a list; a red plane with its words before it cuts.",
    )
    head(s, "Plan", "Plan")
    wide = w >= 1200
    pane = 320 if wide else 264
    top, foot = 56, 64
    gw, gh = (w - pane - 8) / 2, (h - top - foot - 8) / 2
    pics = (
        ("whole", "3D, from the left"),
        ("plan_axial", "Axial"),
        ("plan_coronal", "Coronal"),
        ("plan_sagittal", "Sagittal"),
    )
    for n, (k, t) in enumerate(pics):
        x, y = pane + (n % 2) * (gw + 8), top + (n // 2) * (gh + 8)
        s.rect(x, y, gw, gh, "#000")
        s.image(k, x, y, gw, gh)
        s.rect(x + 8, y + 8, 16 + 8.4 * len(t), 28, "#000", 4, op=0.75)
        s.text(x + 16, y + 28, t, 16, "#EDF1F5")
        s.icon("arrows-maximize", x + gw - 32, y + 8, 24, "#CFD7DF")
    # The plane, red with its words: in 3D and in a cut.
    x, y = pane, top
    s.path(
        f"M{x + gw * .60:.0f} {y + gh * .34:.0f}l{gw * .13:.0f} {gh * .05:.0f}v{gh * .52:.0f}l{-gw * .13:.0f} {-gh * .05:.0f}z",
        STATUS["contact"],
        2,
        STATUS["contact"],
        'fill-opacity=".45"',
    )
    s.path(f"M{pane + gw + 8 + gw * .45:.0f} {top + 44}V{top + gh - 12:.0f}", STATUS["contact"], 3)
    s.rect(0, top, pane, h - top, C["surface"])
    px, pw = 16, pane - 32
    y = 72
    s.text(px, y + 20, "Structures", 16, weight=600)
    names = [
        ("facial nerve", "#F0E442", "eye"),
        ("sigmoid sinus", "#3764C8", "eye"),
        ("dura", "#C67B9C", "adjustments-horizontal"),
        ("air cells", "#7CA3C4", "eye-off"),
        ("ear canal", "#55919F", "eye"),
    ]
    for n, (t, c, i) in enumerate(names):
        yy = y + 32 + n * 36
        s.rect(px, yy + 8, 16, 16, c, 4)
        s.text(px + 28, yy + 22, t, 16)
        s.icon(i, px + pw - 28, yy + 4, 24, C["quiet"])
    y += 32 + 5 * 36 + 16
    s.text(px, y + 20, "Planned cuts", 16, weight=600)
    s.icon("plus", px + pw - 28, y + 2, 24, C["quiet"])
    for n, (t, on) in enumerate((("Cut 1", True), ("Cut 2", False))):
        yy = y + 32 + n * 44
        s.rect(px, yy, pw, 40, C["raised"] if on else C["surface"], 8, C["accent"] if on else None, 2)
        s.icon("saw", px + 10, yy + 8, 24)
        s.text(px + 46, yy + 26, t, 16)
        s.text(px + pw - 12, yy + 26, "kerf 1.0 mm" if wide else "1.0 mm", 14, C["quiet"], anchor="end")
    y += 32 + 88 + 8
    s.slider(px, y, pw, "Kerf", "1.0 mm", 0.4)
    s.slider(px, y + 48, pw, "Depth", "through", 1)
    y += 104
    if h > 800:
        s.text(px, y + 20, "Distances", 16, weight=600)
        s.icon("ruler-measure", px + pw - 28, y + 2, 24, C["quiet"])
        s.text(px, y + 48, "canal to sinus", 16)
        s.text(px + pw, y + 48, "9.6 mm", 16, anchor="end")
        y += 64
    # What the plane would do, before it does.
    yb = h - foot
    s.rect(pane, yb, w - pane, foot, C["surface"])
    text = "Cut 1 would go through the facial nerve, 2.4 mm³" if wide else "Cut 1: through facial nerve"
    s.chip(pane + 16, yb + 16, 44 + (8.3 if wide else 8.6) * len(text), "contact", text, True)
    s.button(w - (296 if wide else 256), yb + 12, 104 if wide else 88, "Cut", "scissors")
    s.button(w - (176 if wide else 152), yb + 12, 160 if wide else 136, "Operate", "drill", main=True)
    s.save(name)


def review(w, h, name):
    s = Sketch(
        w,
        h,
        "Review",
        "Three findings with a picture each, the place in 3D, a player below with the course of the session.",
    )
    head(s, "Review", "Review")
    wide = w >= 1200
    pane = 416 if wide else 336
    foot = 184 if wide else 160
    s.image("cavity", pane, 56, w - pane, h - 56 - foot)
    cx, cy = pane + (w - pane) * 0.33, 56 + (h - 56 - foot) * 0.62
    s.add(
        f'<circle cx="{cx:g}" cy="{cy:g}" r="34" fill="none" stroke="#000" stroke-width="6"/><circle cx="{cx:g}" cy="{cy:g}" r="34" fill="none" stroke="{STATUS["close"]}" stroke-width="3"/>'
    )
    s.rect(cx + 44, cy - 40, 248, 60, C["surface"], 8, op=0.94)
    s.text(cx + 56, cy - 16, "0.4 mm from the sinus", 16, weight=600)
    s.text(cx + 56, cy + 8, "cutting 6 mm, at 11:32", 14, C["quiet"])
    s.rect(0, 56, pane, h - 56 - foot, C["surface"])
    x, pw = 16, pane - 32
    s.text(x + 8, 96, "Session saved", 24, weight=600)
    s.text(x + 8, 122, "Cortical mastoidectomy, 24 min, 1 820 mm³", 14, C["quiet"])
    finds = [
        ("close", "Close to the sinus", "0.4 mm, cutting burr, 11:32", True, "cavity"),
        ("near", "Pressed hard near nerve", "3.1 N at 0.9 mm, 17:05", False, "axial"),
        ("good", "Sinus plate shown", "82 % shown, limit 40 %", False, "coronal"),
    ]
    rh = 96 if wide else 80
    for n, (st, t, u, on, pic) in enumerate(finds):
        yy = 140 + n * (rh + 8)
        s.rect(x, yy, pw, rh, C["raised"], 12, C["accent"] if on else None, 2)
        iw = rh - 8 if wide else rh - 24
        s.image(pic, x + 8, yy + 8, iw, rh - 16, 6)
        s.sign(x + iw + 30, yy + 28, st, 9)
        s.text(x + iw + 46, yy + 34, t, 16, weight=600)
        s.text(x + iw + 22, yy + (60 if wide else 58), u, 14, C["quiet"])
    y = 140 + 3 * (rh + 8) + 8
    s.text(x + 8, y + 16, "All 14 figures", 16, C["text"])
    s.icon("chevron-down", x + pw - 32, y - 2, 24, C["quiet"])
    yb = h - foot
    if wide:
        s.text(x + 8, y + 56, "Next", 14, C["quiet"])
        s.button(x, y + 68, pw, "Repeat the sinus plate from 11:00", "refresh", main=True)
        s.button(x, y + 116, (pw - 8) / 2, "Continue", "player-play")
        s.button(x + (pw + 8) / 2, y + 116, (pw - 8) / 2, "Reset bone", "bone")
        s.button(x, y + 164, (pw - 8) / 2, "Page", "file-description")
        s.button(x + (pw + 8) / 2, y + 164, (pw - 8) / 2, "Movie", "movie")
    else:
        s.button(x, yb - 52, pw, "Repeat from 11:00", "refresh", main=True)
    s.rect(0, yb, w, foot, C["surface"])
    s.rect(0, yb, w, 1, C["line"])
    for n, i in enumerate(("player-track-prev", "player-play", "player-track-next")):
        s.tile(16 + n * 44, yb + 12, i)
    s.text(160, yb + 38, "11:32 / 24:06", 16, weight=600)
    s.segments(288, yb + 12, ("1×", "4×", "16×"), 0, (48, 48, 56), 40)
    if wide:
        s.switch(472, yb + 16, 200, "Surgeon's view", True)
    else:
        s.icon("eye", 464, yb + 20, 24)
    lanes = (
        (
            "Force",
            [0.2, 0.3, 0.25, 0.5, 0.4, 0.6, 0.3, 0.2, 0.5, 0.7, 0.4, 0.3, 0.35, 0.2, 0.9, 0.4, 0.3, 0.2, 0.3, 0.4],
        ),
        (
            "Nearness",
            [0.1, 0.1, 0.2, 0.2, 0.3, 0.4, 0.3, 0.4, 0.9, 0.7, 0.5, 0.4, 0.3, 0.5, 0.7, 0.6, 0.4, 0.3, 0.2, 0.2],
        ),
    )
    lx, lw, lh = 112, w - 128, (foot - 88) / 2
    for n, (t, v) in enumerate(lanes):
        yy = yb + 64 + n * (lh + 4)
        s.text(16, yy + lh / 2 + 6, t, 14, C["quiet"])
        s.rect(lx, yy, lw, lh, C["ground"], 4)
        d = (
            f"M{lx} {yy + lh}"
            + "".join(f"L{lx + lw * (k + .5) / 20:.0f} {yy + lh * (1 - a):.0f}" for k, a in enumerate(v))
            + f"L{lx + lw} {yy + lh}z"
        )
        s.path(d, "#8FA0B2", 1.5, "#8FA0B2", 'fill-opacity=".35"')
    at = lx + lw * 0.4792
    for share, st in ((0.4792, "close"), (0.708, "near"), (0.86, "good")):
        s.sign(lx + lw * share, yb + 56 if share != 0.4792 else yb + 56, st, 7)
    s.path(f"M{at:.0f} {yb + 64}V{h - 12}", C["text"], 2)
    for k in range(0, 25, 4):
        s.text(lx + lw * k / 24.1, h - 4, "", 14)
    s.save(name)


def teach(w, h, name):
    s = Sketch(
        w,
        h,
        "Teach",
        "The trainee's picture live; steps of the procedure with what is done; guidance, note and who is connected.",
    )
    head(s, "Teach", "Teach")
    wide = w >= 1200
    lp, rp, foot = (304, 320, 72) if wide else (240, 264, 72)
    s.image("cavity", lp, 56, w - lp - rp, h - 56 - foot)
    s.rect(lp + 16, 72, 208, 36, C["surface"], 8, op=0.94)
    s.add(f'<circle cx="{lp + 34}" cy="90" r="6" fill="{STATUS["good"]}"/>')
    s.text(lp + 50, 96, "Trainee 1, live, 24 ms", 16)
    s.rect(0, 56, lp, h - 56, C["surface"])
    s.text(16, 96, "Cortical mastoidectomy" if wide else "Mastoidectomy", 20, weight=600)
    steps = (
        ("Cortex opened", 2),
        ("Sinus plate shown", 1),
        ("Tegmen followed", 0),
        ("Antrum opened", 0),
        ("Canal wall thinned", 0),
        ("Facial recess", 0),
    )
    for n, (t, st) in enumerate(steps):
        yy = 116 + n * 48
        if st == 1:
            s.rect(8, yy, lp - 16, 44, C["raised"], 8)
        if st == 2:
            s.icon("circle-check", 20, yy + 10, 24, STATUS["good"])
        else:
            s.add(
                f'<circle cx="32" cy="{yy + 22}" r="9" fill="none" stroke="{C["text"] if st == 1 else C["line"]}" stroke-width="2"/>'
            )
        s.text(56, yy + 28, t, 16, C["text"] if st else C["quiet"], 600 if st == 1 else 400)
        if st == 1 and wide:
            s.text(lp - 20, yy + 28, "46 %", 16, anchor="end")
    yy = 116 + 6 * 48 + 24
    s.text(16, yy + 8, "Harm so far", 14, C["quiet"])
    s.sign(28, yy + 34, "near", 8)
    s.lines(48, yy + 40, ["1 time near the sinus", "no contact, no violation"], 16, step=26)
    if h > 800:
        s.text(16, yy + 120, "Lesson file", 14, C["quiet"])
        s.button(16, yy + 132, lp - 32, "Change items …", "list-check")
    x, pw = w - rp + 16, rp - 32
    s.rect(w - rp, 56, rp, h - 56, C["surface"])
    s.text(x, 96, "People", 20, weight=600)
    for n, (t, u) in enumerate((("You, instructor", "cuts"), ("Trainee 1", "cuts"), ("2 watch", ""))):
        yy = 112 + n * 44
        s.icon("users", x, yy + 8, 24, C["quiet"])
        s.text(x + 36, yy + 26, t, 16)
        s.text(x + pw, yy + 26, u, 14, C["quiet"], anchor="end")
    s.rect(x, 252, pw, 64, C["ground"], 8, C["line"])
    s.text(x + 12, 276, "Invitation code", 14, C["quiet"])
    s.text(x + 12, 304, "7 K 4 – 2 9 M", 20, weight=600)
    s.icon("lock", x + pw - 36, 272, 24, C["quiet"])
    s.text(x, 352, "Haptic guidance", 16, weight=600)
    s.segments(
        x,
        364,
        ("Off", "Show", "Guide", "Fade") if wide else ("Off", "Show", "Guide"),
        2,
        (56, 72, 80, 80) if wide else (56, 80, 96),
    )
    s.slider(x, 416, pw, "Pull at most", "2.0 N", 0.33)
    s.slider(x, 464, pw, "Tolerance radius", "5 mm", 0.5)
    s.switch(x, 524, pw, "Hints for the trainee", False)
    if h > 800:
        s.switch(x, 568, pw, "Nerve monitor", True)
        s.switch(x, 612, pw, "Trainee's cuts shown", True)
        s.text(x, 692, "Apart", 14, C["quiet"])
        s.text(x, 722, "1.8 mm", 24, weight=600)
    s.rect(lp, h - foot, w - lp - rp, foot, C["surface"])
    s.rect(lp, h - foot, w - lp - rp, 1, C["line"])
    bw = (w - lp - rp - 32 - 24) / 4
    for n, (i, t) in enumerate((("flag", "Mark"), ("note", "Note"), ("camera", "Picture"), ("hand-stop", "Pause"))):
        s.button(lp + 16 + n * (bw + 8), h - foot + 16, bw, t if wide or len(t) < 6 else t, i)
    s.save(name)


def components(name):
    s = Sketch(
        1440,
        900,
        "Components",
        "Each component once, with its states, in the dark and the light theme; instruments and burrs in true size.",
    )
    global C
    for k, theme in enumerate((DARK, LIGHT)):
        C = theme
        x0 = k * 720
        s.rect(x0, 0, 720, 900, C["ground"])
        s.text(x0 + 24, 44, ("Dark", "Light")[k], 24, weight=600)
        y = 72
        s.text(x0 + 24, y + 16, "Button: main, usual, quiet, focus, off", 14, C["quiet"])
        s.button(x0 + 24, y + 28, 128, "Operate", "drill", main=True)
        s.button(x0 + 164, y + 28, 112, "Plan", "target")
        s.button(x0 + 288, y + 28, 96, "End …", quiet=True)
        s.rect(x0 + 396, y + 24, 120, 48, "none", 11, C["accent"], 3)
        s.button(x0 + 400, y + 28, 112, "Undo")
        s.rect(x0 + 528, y + 28, 112, 40, "none", 8, C["line"])
        s.text(x0 + 584, y + 54, "Undo", 16, C["line"], anchor="middle")
        y = 168
        s.text(x0 + 24, y + 16, "Tool tile: usual, selected, on, off", 14, C["quiet"])
        s.tile(x0 + 24, y + 28, "saw")
        s.tile(x0 + 80, y + 28, "drill", on=True)
        s.tile(x0 + 136, y + 28, "droplet", on="lit")
        s.tile(x0 + 192, y + 28, "plate", off=True)
        s.rect(x0 + 256, y + 28, 200, 40, C["raised"], 8, C["line"])
        s.text(x0 + 270, y + 54, "Suction, while held", 16)
        s.key(x0 + 464, y + 36, "V")
        s.text(x0 + 504, y + 54, "what hovering shows", 14, C["quiet"])
        y = 264
        s.text(x0 + 24, y + 16, "Slider, its text beside it; switch; choice", 14, C["quiet"])
        s.slider(x0 + 24, y + 24, 208, "Kerf", "1.0 mm", 0.4)
        s.switch(x0 + 264, y + 32, 160, "Bone dust", True)
        s.switch(x0 + 264, y + 68, 160, "Heat", False)
        s.segments(x0 + 456, y + 36, ("Cutting", "Diamond"), 0, (96, 104))
        y = 384
        s.text(x0 + 24, y + 16, "Row of a list: usual, selected", 14, C["quiet"])
        for n, on in enumerate((False, True)):
            yy = y + 28 + n * 44
            s.rect(x0 + 24, yy, 320, 40, C["raised"] if on else C["surface"], 8, C["accent"] if on else None, 2)
            if on:
                s.rect(x0 + 24, yy + 8, 4, 24, C["accent"], 2)
            s.icon("saw", x0 + 40, yy + 8, 24)
            s.text(x0 + 76, yy + 26, ("Cut 1", "Cut 2")[n], 16)
            s.text(x0 + 332, yy + 26, "1.0 mm", 14, C["quiet"], anchor="end")
        s.text(x0 + 376, y + 16, "Status chip: sign, word and colour", 14, C["quiet"])
        s.chip(x0 + 376, y + 28, 132, "near", "near 1.4")
        s.chip(x0 + 520, y + 28, 140, "close", "close 0.4")
        s.chip(x0 + 376, y + 68, 132, "contact", "contact", True)
        s.chip(x0 + 520, y + 68, 140, "good", "approved")
        y = 512
        s.text(x0 + 24, y + 16, "Dialog", 14, C["quiet"])
        s.rect(x0 + 24, y + 28, 400, 152, C["surface"], 12, C["line"])
        s.text(x0 + 40, y + 60, "Reset bone?", 20, weight=600)
        s.lines(x0 + 40, y + 88, ["This session is saved and ends. A new one", "begins with the bone of the case."], 16)
        s.button(x0 + 136, y + 128, 128, "Cancel")
        s.button(x0 + 276, y + 128, 132, "Reset bone", main=True)
        s.text(x0 + 448, y + 16, "Toast", 14, C["quiet"])
        s.rect(x0 + 448, y + 28, 248, 72, C["surface"], 12, C["line"])
        s.icon("info-circle", x0 + 460, y + 40, 24, C["quiet"])
        s.text(x0 + 492, y + 58, "Picture saved", 16)
        s.text(x0 + 492, y + 84, "Show in folder", 16, C["text"], 600)
        s.text(x0 + 448, y + 132, "Type: 14, 16, 20, 24", 14, C["quiet"])
        for n, z in enumerate((14, 16, 20, 24)):
            s.text(
                x0 + 448 + (0, 52, 110, 172)[n],
                y + 168,
                "1.4 mm"[: 6 if z < 20 else 3],
                z,
                weight=600 if z > 16 else 400,
            )
        y = 720
        s.text(x0 + 24, y + 8, "Burrs at 3.78 pixels a mm (96 a inch): cutting, diamond; instruments", 14, C["quiet"])
        for mm in range(1, 8):
            s.burr(x0 + 24 + mm * 40, y + 48, mm)
            s.burr(x0 + 24 + mm * 40, y + 104, mm, diamond=True)
            s.text(x0 + 24 + mm * 40, y + 148, f"{mm}", 14, C["quiet"], anchor="middle")
        s.text(x0 + 24 + 8 * 40, y + 148, "mm", 14, C["quiet"], anchor="middle")
        for n, i in enumerate(("drill", "saw", "plate", "fragments", "suction", "probe")):
            s.icon(i, x0 + 392 + (n % 3) * 104, y + 32 + (n // 3) * 64, 32)
            s.text(x0 + 408 + (n % 3) * 104, y + 84 + (n // 3) * 64, i, 14, C["quiet"], anchor="middle")
    C = DARK
    s.save(name)


for w, h in ((1440, 900), (1024, 700)):
    size = f"{w}x{h}"
    open_(w, h, f"open-{size}.svg")
    plan(w, h, f"plan-{size}.svg")
    operate(w, h, f"operate-{size}.svg")
    review(w, h, f"review-{size}.svg")
    teach(w, h, f"teach-{size}.svg")
operate(1440, 900, "operate-first.svg", key_card, message=None)
operate(
    1440,
    900,
    "operate-commands.svg",
    palette,
    near=("contact", "sigmoid sinus", "contact", 1),
    message=("contact", "Contact: sigmoid sinus", True),
)
components("components.svg")

print("| pair | dark | light | high contrast | needs |\n|---|---|---|---|---|")
for a, b, n in (
    ("text", "ground", 4.5),
    ("text", "surface", 4.5),
    ("text", "raised", 4.5),
    ("quiet", "surface", 4.5),
    ("quiet", "raised", 4.5),
    ("accent", "surface", 3),
    ("accent", "raised", 3),
    ("line", "surface", 3),
    ("line", "raised", 3),
):
    print(f"| {a} on {b} | " + " | ".join(f"{ratio(t[a], t[b]):.1f}" for t in (DARK, LIGHT, HIGH)) + f" | {n} |")
for k, v in STATUS.items():
    print(
        f"| {k} on surface, sign | "
        + " | ".join(f"{ratio(v, t['surface']):.1f}" for t in (DARK, LIGHT, HIGH))
        + f" | 3 |  black on it {ratio(v, '#000000'):.1f}"
    )

#!/usr/bin/env python3
"""The review of a session, read by others: the page by Python, its script by Chromium where there is one, the PDF by poppler; and that it asks for nothing.

usage: check_review.py BIN_DIR FIXTURES WORK_DIR
"""

import html.parser, json, os, pathlib, re, resource, shutil, subprocess, sys

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
source = pathlib.Path(__file__).resolve().parents[2]
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, code=0, **more):
    r = subprocess.run([bin_dir / "osteo", *map(str, args)], cwd=work, capture_output=True, **more)
    assert r.returncode == code, (args, r.returncode, r.stderr.decode())
    return r.stdout.decode(), r.stderr.decode()


class Page(html.parser.HTMLParser):
    VOID = {"meta", "img", "br", "input"}

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.pictures, self.asks, self.texts = [], [], {}, [], []

    def handle_starttag(self, tag, attrs):
        a = dict(attrs)
        self.ids += [a["id"]] if "id" in a else []
        self.asks += [
            (tag, k, a[k])
            for k in ("src", "href", "data", "srcset", "poster", "action")
            if k in a and not a[k].startswith("data:")
        ]
        self.asks += [(tag, k) for k in a if k.startswith("on")]
        if tag == "img":
            assert a["alt"], "a picture that is not told"
            self.pictures[a["id"]] = a["alt"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, (tag, self.getpos())

    def handle_data(self, data):
        self.texts.append(data)


def page_of(path):
    text = path.read_text(encoding="utf-8")
    p = Page()
    p.feed(text)
    assert not p.open and not p.asks, (p.open, p.asks)
    assert len(p.ids) == len(set(p.ids)), [i for i in p.ids if p.ids.count(i) > 1]
    assert not re.search(r"https?:|@import|url\(", text), "the page names an address"
    assert path.stat().st_size < 15e6
    return p, " ".join(p.texts)


# A mastoid drilled under the camera, with structures, a procedure, a reference and an earlier session.
osteo("phantom", "ct.nrrd", "--labels-out", "l.nrrd", "--region", "temporal", "--spacing-mm", "1.2", "--quiet")
osteo(
    "prepare",
    "ct.nrrd",
    "-o",
    "c",
    "--lower",
    "500",
    "--spacing-mm",
    "1.2",
    "--structures",
    "l.nrrd",
    "--names",
    "6=facial nerve, 7=sigmoid sinus",
    "--quiet",
)
script = json.loads((source / "pipelines/sessions/mastoid.json").read_text())
del script["actions"]
for w in script["waypoints"]:
    w["t_s"] /= 4
    w.get("cavity", {}).update({k: v for k, v in (("over_s", 12), ("turns_per_s", 2)) if "cavity" in w})
(work / "s.json").write_text(json.dumps(script))
osteo("rehearse", "c", "--headless", "--fast", "--script", "s.json", "-o", "s", "--quiet")
script["waypoints"][2]["cavity"]["depth_mm"] = 8
(work / "e.json").write_text(json.dumps(script))
osteo("rehearse", "c", "--headless", "--fast", "--script", "e.json", "-o", "e", "--quiet")
(work / "ref").mkdir()
(work / "ref/reference.json").write_text(
    json.dumps({"osteotome_reference": 1, "sessions": [{"session": "../e", "subject": "P1", "group": "expert"}]})
)
procedure = source / "pipelines/procedures/mastoidectomy.json"
out, _ = osteo("review", "s", "-o", "r", "--procedure", procedure, "--reference", "ref", "--earlier", "e")
assert out.startswith("Scripted: "), out
page, said = page_of(work / "r/review.html")
j = json.loads((work / "r/review.json").read_text())
score = json.loads(osteo("score", "s", "--procedure", procedure, "--reference", "ref", "--json")[0])
assert (
    j["score"]["metrics"] == score["metrics"] and j["score"]["items"] == score["items"]
), "the review is of another score"
for f in j["findings"]["findings"]:
    assert f["text"] in said, f["text"]
for p in j["pictures"]:
    assert "picture-" + p["id"] in page.pictures or p["id"] in ("before", "after", "unseen", "unseen-side"), p
assert {"picture-before", "picture-after", "picture-unseen", "picture-unseen-side"} <= set(page.pictures), page.pictures
assert {m["id"] for m in j["meshes"]} >= {"after", "before", "seen", "structure-6", "structure-7"}, [
    m["id"] for m in j["meshes"]
]
t = j["timeline"]
assert t["samples"] == len(t["force_n"]) == len(t["at_mm"])
metric = {(m["name"], m["of"]): m["value"] for m in score["metrics"]}
assert abs(sum(t["hidden_mm3"]) - metric["hidden_mm3", None]) < 1e-2 * max(1, metric["hidden_mm3", None])
assert abs(t["samples"] / t["rate_hz"] - metric["duration_s", None]) <= 0.1001
assert j["comparison"]["earlier_sessions"] == 1 and j["comparison"]["expert_sessions"] == 1
time = next(m for m in j["comparison"]["metrics"] if m["name"] == "removed_mm3")
assert time["value"] == metric["removed_mm3", None] and len(time["earlier"]) == 1 and len(time["experts"]) == 1

try:
    import io, base64
    from PIL import Image

    text = (work / "r/review.html").read_text()
    for name, png in re.findall(r'<img id="picture-([^"]+)"[^>]* src="data:image/png;base64,([^"]+)"', text):
        with Image.open(io.BytesIO(base64.b64decode(png))) as im:
            colours = im.convert("RGB").getcolors(1 << 24)
            assert len(colours) > 50, name  # shows something
            orange = sum(n for n, (r, g, b) in colours if r > 1.6 * g > 1.6 * 1.2 * b and r > 90)
            if name not in ("before", "after", "unseen", "unseen-side"):
                assert orange > 30, (name, orange)  # and the evidence in it
except ImportError:
    print("pictures not decoded: no Pillow")

if shutil.which("pdftotext"):
    pdf = subprocess.run(
        ["pdftotext", "-layout", work / "r/review.pdf", "-"], capture_output=True, check=True
    ).stdout.decode()
    assert "Scripted" in pdf and "What was found" in pdf and "Force by distance" in pdf, pdf[:400]
else:
    print("PDF not read: no poppler")

# The script: it draws the timeline, fills the table and makes the view, with no network at all, and says nothing on its console.
chromium = shutil.which("chromium")
if chromium:
    alone = (
        ["unshare", "-rn"] if subprocess.run(["unshare", "-rn", "true"], capture_output=True).returncode == 0 else []
    )
    env = {**os.environ, "HOME": str(work)}
    r = subprocess.run(
        [
            *alone,
            chromium,
            "--headless",
            "--no-sandbox",
            "--disable-gpu-sandbox",
            "--enable-unsafe-swiftshader",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-logging=stderr",
            "--virtual-time-budget=4000",
            f"--user-data-dir={work}/chromium",
            "--dump-dom",
            f"file://{work}/r/review.html",
        ],
        capture_output=True,
        env=env,
        timeout=600,
    )
    dom, log = r.stdout.decode(), r.stderr.decode()
    wrong = [line for line in log.splitlines() if ":CONSOLE" in line and ("rror" in line or "Refused" in line)]
    assert not wrong, wrong
    assert 'id="cross"' in dom and 'data-n="0"' in dom, "the script did not run"
    assert dom.count('aria-pressed="') >= 5 or 'id="no-view">' in dom, "neither the view in 3D nor its word"
    print("Chromium: script ran" + (", without any network" if alone else ""))
else:
    print("script not run: no Chromium")

# The disk is full: nothing is left, and what was there stays.
before = (work / "r/review.html").read_bytes()
r = subprocess.run(
    [bin_dir / "osteo", "review", "s", "-o", "r", "--force", "--no-pictures", "--quiet"],
    cwd=work,
    capture_output=True,
    preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
)
assert r.returncode == 6, (r.returncode, r.stderr)
assert (work / "r/review.html").read_bytes() == before and not [
    p for p in work.iterdir() if p.name.startswith((".r", "r.", ".osteo"))
], list(work.iterdir())

# Cut short: a label, and what there is.
shutil.copytree(work / "s", work / "cut")
whole = (work / "cut/stream.oss").read_bytes()
(work / "cut/stream.oss").write_bytes(whole[: len(whole) // 2])
osteo("review", "cut", "-o", "rc", "--no-pictures", "--quiet")
_, said = page_of(work / "rc/review.html")
assert "Cut short" in said
# Damaged in the middle: what comes before it, and exit code 4.
damaged = bytearray(whole)
damaged[len(whole) // 2] ^= 16
(work / "cut/stream.oss").write_bytes(damaged)
osteo("review", "cut", "-o", "rd", "--no-pictures", "--quiet", code=4)
_, said = page_of(work / "rd/review.html")
assert "behind the first gap" in said and "not recorded" in said

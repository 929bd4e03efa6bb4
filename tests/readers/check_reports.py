#!/usr/bin/env python3
"""The report of a case, read by others: HTML by Python, pictures by Pillow, the PDF by poppler; and what must not be in it.

usage: check_reports.py BIN_DIR FIXTURES WORK_DIR
"""

import base64, html.parser, io, json, os, pathlib, re, resource, shutil, signal, subprocess, sys

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def osteo(*args, code=0, env=None):
    r = subprocess.run([bin_dir / "osteo", *map(str, args)], cwd=work, capture_output=True, env=env)
    assert r.returncode == code, (args, r.returncode, r.stderr.decode())
    return r.stdout.decode(), r.stderr.decode()


class Page(html.parser.HTMLParser):
    VOID = {"meta", "img", "col", "br", "link", "rect", "line"}

    def __init__(self):
        super().__init__()
        self.open, self.texts, self.pictures, self.links, self.scripts = [], [], {}, [], 0

    def handle_starttag(self, tag, attrs):
        a = dict(attrs)
        self.scripts += tag == "script" or any(k.startswith("on") for k in a)
        self.links += [a[k] for k in ("href", "src") if k in a and not a[k].startswith("data:")]
        if tag == "img":
            assert a["alt"] is not None and a["id"] not in self.pictures
            self.pictures[a["id"]] = base64.b64decode(a["src"].split(",", 1)[1], validate=True)
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
    p = Page()
    p.feed(path.read_text(encoding="utf-8"))
    assert not p.open, p.open
    assert p.scripts == 0 and not p.links, (p.scripts, p.links)
    return p


# With structures, from DICOM: everything there is.
osteo("phantom", "ct", "--labels-out", "labels.nrrd", "--region", "temporal", "--spacing-mm", "1.5", "--quiet")
osteo(
    "prepare",
    "ct",
    "-o",
    "case",
    "--lower",
    "500",
    "--spacing-mm",
    "1",
    "--structures",
    "labels.nrrd",
    "--names",
    "6=facial nerve, 7=sigmoid sinus",
    "--quiet",
)
html_file, pdf_file = work / "case.report.html", work / "case.report.pdf"
page = page_of(html_file)
wanted = {f"{w}-{p}" for w in ("soft", "bone") for p in ("axial", "coronal", "sagittal")} | {
    f"slice-{n}" for n in range(1, 9)
}
wanted |= {f"side-{s}" for s in ("front", "back", "left", "right", "above", "below")} | {
    "thin-left-front",
    "thin-below",
    "structures",
}
assert wanted <= set(page.pictures), wanted - set(page.pictures)
text = " ".join(page.texts)
for said in ("facial nerve", "sigmoid sinus", "Not approved", "500 HU", "Table, holder", "voxels across"):
    assert said in text, said
assert "phantom" not in text.lower() and "OSTEOTOME^" not in text
assert not {p.name for p in (work / "case").iterdir()} & {"case.report.html", "report.html"}
try:
    from PIL import Image

    for name, png in page.pictures.items():
        with Image.open(io.BytesIO(png)) as im:
            im.load()
            assert im.width >= 100 and len(im.convert("RGB").getcolors(1 << 24)) > 8, name  # shows something
    print(f"{len(page.pictures)} pictures decode")
except ImportError:
    print("pictures not decoded: no Pillow")


def pdf_text():
    return subprocess.run(["pdftotext", "-layout", pdf_file, "-"], capture_output=True, check=True).stdout.decode()


poppler = shutil.which("pdftotext") and shutil.which("pdfinfo")
if poppler:
    info = subprocess.run(["pdfinfo", pdf_file], capture_output=True, check=True, text=True).stdout
    assert re.search(r"^Pages: +2$", info, re.M) and "A4" in info, info
    assert "CreationDate" not in info
    fonts = subprocess.run(["pdffonts", pdf_file], capture_output=True, check=True, text=True).stdout.splitlines()[2:]
    # It can be read aloud: in this order, with a table that is one and pictures that say what they show.
    assert re.search(r"^Tagged: +yes$", info, re.M) and "Title:           Case report" in info, info
    tree = subprocess.run(["pdfinfo", "-struct-text", pdf_file], capture_output=True, check=True).stdout.decode()
    parts = re.findall(r"^ *(\w+)(?: \(|:?$)", tree, re.M)
    assert parts[:3] == ["Document", "H1", "P"] and parts.count("H1") == parts.count("Document") == 1, parts
    words = [w for w in re.findall(r'^ *"(.*)"$', tree, re.M) if w]
    heads = re.findall(r'^ *H2 \(block\)\n *"(.*)"$', tree, re.M)
    assert words[0] == "Case report" and "Not a medical device." in words[-1], (words[0], words[-1])
    markup = html_file.read_text()
    assert heads == re.findall("<h2>(.*?)</h2>", markup), heads
    assert parts.count("TH") > 3 and parts.count("TD") > 9 and parts.count("Table") == markup.count("<table"), parts
    raw = pdf_file.read_bytes()
    spoken = [
        bytes.fromhex(h.decode()).decode("utf-16") for h in re.findall(rb"/S /Figure\n   /Alt <([0-9A-F]+)>", raw)
    ]
    assert "patient's left" in spoken and len(spoken) == parts.count("Figure") and b"/Lang (en)" in raw, spoken
    if shutil.which("qpdf"):
        subprocess.run(["qpdf", "--check", pdf_file], check=True, capture_output=True)
    assert fonts and all(re.search(r"(Type|CID).* yes +(yes|no) +(yes|no) ", f) for f in fonts), fonts  # embedded
    said = pdf_text()
    for word in ("facial nerve", "sigmoid sinus", "Not approved", "500 HU", "1/2", "2/2"):
        assert word in said or word in said.replace(" / ", "/"), word
    # And so can the pages of markers: their heads and what to do with them. The markers themselves are for a camera.
    osteo("markers", "markers.pdf")
    info = subprocess.run(["pdfinfo", work / "markers.pdf"], capture_output=True, check=True, text=True).stdout
    assert re.search(r"^Tagged: +yes$", info, re.M) and re.search(r"^Pages: +2$", info, re.M), info
    tree = subprocess.run(["pdfinfo", "-struct-text", work / "markers.pdf"], capture_output=True, check=True).stdout
    parts = re.findall(r"^ *(\w+)(?: \(|:?$)", tree.decode(), re.M)
    assert parts[:3] == ["Document", "H1", "P"] and parts.count("H2") == 1, parts
    assert "markers of pen 1" in tree.decode() and "Hold a ruler to it" in tree.decode(), tree
else:
    print("PDF not read: no poppler-utils")

# One that another version wrote is made again and has to be looked at first.
written = html_file.read_bytes()
html_file.write_bytes(written.replace(b"Not a medical device", b"Not a medical gadget"))
assert "look at it" in osteo("approve", "case", "--by", "A", code=7)[1]
assert html_file.read_bytes() == written and not (work / "case/approval.json").exists()

# Approved: nothing but the signature changes, and the scan is not needed for it.
before = html_file.read_bytes()
(work / "ct").rename(work / "away")
no_memory = dict(os.environ, XDG_STATE_HOME=str(work / "no-state"))
osteo("approve", "case", "--by", "Łucja Żak <x>", "--note", "mastoid only", env=no_memory)
signed = html_file.read_bytes()
cut = lambda b: re.sub(rb"<!--signature-->.*<!--/signature-->", b"", b, flags=re.S)
assert signed != before and cut(signed) == cut(before)
page = page_of(html_file)
assert "Łucja Żak <x>" in " ".join(page.texts) and wanted <= set(page.pictures)
if poppler:
    said = pdf_text()  # each once, and the labels under the lines
    assert said.count("Łucja Żak <x>") == 1 and said.count("mastoid only") == 1 and "approved by" in said, said
assert json.loads(osteo("info", "case", "--json")[0])["approval"]["state"] == "valid"
said = osteo("info", "case")[0]
assert "approved by Łucja Żak <x> on 20" in said and re.search(r"^Asked for .*--lower 500", said, re.M), said
assert not re.search(r"\d\.\d{6}", said), said  # digits that mean nothing
osteo("rehearse", "case", "--headless", "--fast", "--seconds", "1", "--require-approved", "-o", "s1", "--quiet")
assert json.loads((work / "s1/session.json").read_text())["approval"]["state"] == "valid"

# Another report of the same state without scan: the pictures stay.
osteo("report", "case", env=no_memory)
assert html_file.read_bytes() == signed

# What came of surgery later has a page of its own, and leaves the approval as it is.
outcome = work / "case/outcome.json"
outcome.write_text('{"osteotome_outcome": 1, "fragments": [{"name": "the back", "reference": true}]}')
assert "earlier state" in osteo("info", "case")[0]
osteo("report", "case", env=no_memory)
later = osteo("info", "case")[0]
assert "approved by" in later and "no longer valid" not in later and "earlier state" not in later, later
page = page_of(html_file)
assert "the back" in page.texts and wanted <= set(page.pictures), page.texts
if poppler:
    assert "the back" in pdf_text() and "3/3" in pdf_text().replace(" / ", "/"), pdf_text()
outcome.unlink()
osteo("report", "case", env=no_memory)
assert html_file.read_bytes() == signed

# A report changed by hand; then a case changed by prepare.
html_file.write_bytes(signed.replace(b"voxels across", b"voxels acros!"))
assert "the report" in osteo("info", "case")[0].split("Verdict")[0]
osteo("rehearse", "case", "--headless", "--fast", "--seconds", "1", "--require-approved", "-o", "s2", code=7)
assert not (work / "s2").exists()
html_file.write_bytes(signed)
(work / "away").rename(work / "ct")
osteo("prepare", "ct", "-o", "case", "--lower", "550", "--no-report", "--quiet")
out = osteo("info", "case")[0]
assert "no longer valid" in out and "earlier state" in out, out
osteo("approve", "case", "--by", "A", code=7)  # nobody has looked at what it is now
osteo("report", "case")
assert "no longer valid" in " ".join(page_of(html_file).texts)
osteo("approve", "case", "--by", "A")
osteo("approve", "case", "--withdraw")
assert "Not approved" in " ".join(page_of(html_file).texts)
osteo("approve", "case", "--withdraw", code=7)
# A byte of the bone.
osteo("approve", "case", "--by", "A")
bone = bytearray((work / "case/bone.vdb").read_bytes())
bone[len(bone) // 2] ^= 1
(work / "case/bone.vdb").write_bytes(bone)
assert "no longer valid" in osteo("info", "case")[0]
osteo("approve", "case", "--by", "A", code=4)

# Without a report; and where one cannot be written the case is whole.
osteo("prepare", "ct", "-o", "plain", "--lower", "500", "--spacing-mm", "1", "--no-report", "--quiet")
assert not (work / "plain.report.html").exists()
(work / "full.report.html").mkdir()
said = osteo("prepare", "ct", "-o", "full", "--lower", "500", "--spacing-mm", "1", code=6)[1]
assert "the case is whole" in said, said
osteo("rehearse", "full", "--headless", "--fast", "--seconds", "1", "-o", "s3", "--quiet")
for f in sorted((work / "plain").iterdir()):
    if not f.name.endswith((".prov.json", "manifest.json")):
        assert f.read_bytes() == (work / "full" / f.name).read_bytes(), f.name


# A disk that is full by the time of the report: here a limit on the size of files, below the report's and above that of the case's.
def small_files():
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))


r = subprocess.run(
    [bin_dir / "osteo", "prepare", "ct", "-o", "tight", "--lower", "500", "--spacing-mm", "2.5"],
    cwd=work,
    capture_output=True,
    preexec_fn=small_files,
)
assert r.returncode == 6 and b"the case is whole" in r.stderr, (r.returncode, r.stderr.decode())
assert not list(work.glob("tight.report*")) and not list(work.glob(".osteo*")) and not list(work.glob("*tmp*"))
osteo("rehearse", "tight", "--headless", "--fast", "--seconds", "1", "-o", "s4", "--quiet")

# Without the scan: bone alone, and it says what is missing.
said = osteo("report", "plain", env=no_memory)[1]
page = page_of(work / "plain.report.html")
assert "left out" in said and "soft-axial" not in page.pictures and "bone-axial" in page.pictures
osteo("report", "plain", "--scan", "ct")
assert "soft-axial" in page_of(work / "plain.report.html").pictures
osteo("report", "plain", "--scan", fixtures / "ct.nrrd", code=4)
# The same again gives the same bytes.
first = (work / "plain.report.html").read_bytes(), (work / "plain.report.pdf").read_bytes()
(work / "plain.report.html").unlink()
osteo("report", "plain", "--threads", "1")
assert ((work / "plain.report.html").read_bytes(), (work / "plain.report.pdf").read_bytes()) == first
print("reports hold, approvals end when they should")

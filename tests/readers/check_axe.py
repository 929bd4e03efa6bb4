#!/usr/bin/env python3
"""Pages that people read, judged by axe-core in Chromium: WCAG 2.2 A and AA. Report of a case, of a batch, of a study; form for raters; review.
usage: check_axe.py BIN_DIR FIXTURES WORK_DIR   (axe.min.js: $OSTEO_AXE, or of `npm install --prefix build/axe axe-core`)
"""

import html, json, os, pathlib, re, shutil, subprocess, sys

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
root = pathlib.Path(__file__).resolve().parents[2]
script = pathlib.Path(os.environ.get("OSTEO_AXE", root / "build/axe/node_modules/axe-core/axe.min.js"))
RUN = """axe.run(document, {runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"], resultTypes: ["violations", "incomplete"]}).then(r => {
  const p = document.createElement("pre"); p.id = "axe-result";
  const list = a => a.map(v => ({id: v.id, impact: v.impact, nodes: v.nodes.map(n => n.target.join(" ") + ": " + n.any.concat(n.all, n.none).map(c => c.message).join("; "))}));
  p.textContent = JSON.stringify({violations: list(r.violations), passes: r.passes.length}); document.body.append(p); });"""


if gone := [
    what for what, there in (("chromium", shutil.which("chromium")), ("axe-core", script.is_file())) if not there
]:
    print(f"skipped: no {', '.join(gone)}")
    sys.exit(77)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def violations(page):
    """What axe finds; and how many of its rules the page passes."""
    text = page.read_text(encoding="utf-8")
    judged = work / "axe.html"
    # Into the body's end: pages forbid what comes from elsewhere, not what stands in them.
    head, tail = text.rsplit("</body>", 1) if "</body>" in text else (text, "")
    judged.write_text(
        head
        + "<script>"
        + script.read_text(encoding="utf-8").replace("</script", "<\\/script")
        + "</script><script>"
        + RUN
        + "</script></body>"
        + tail,
        encoding="utf-8",
    )
    r = subprocess.run(
        [
            "chromium",
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--window-size=1280,1000",
            "--virtual-time-budget=20000",
            f"--user-data-dir={work}/chromium-axe",
            "--dump-dom",
            f"file://{judged}",
        ],
        capture_output=True,
        text=True,
        timeout=120,
    )
    found = re.search(r'<pre id="axe-result">(.*?)</pre>', r.stdout, re.S)
    assert found, (page, r.stderr[-2000:])
    said = json.loads(html.unescape(found[1]))
    return said["violations"], said["passes"]


def osteo(*args, code=0):
    r = subprocess.run([bin_dir / "osteo", *map(str, args), "--quiet"], cwd=work, capture_output=True, text=True)
    assert r.returncode == code, (args, r.returncode, r.stderr)


shutil.copytree(fixtures / "case", work / "case")
osteo("report", "case")
osteo("review", fixtures / "session", "-o", "review", "--no-pictures")
(work / "t.csv").write_text(f"case,source,lower,spacing_mm\nA1,{fixtures}/ct.nrrd,500,2\nB1,MISSING.nrrd,,\n")
osteo("batch", "t.csv", "-o", "batch", "--no-report", code=8)
osteo("study", "new", "study", "--groups", "novice, expert", "--cases", "a, b")
for group in ("novice", "expert") * 3:
    osteo("study", "add", "study", "--group", group)
(work / "m.json").write_text('{"seconds": 40}')
osteo("study", "add", "study", "m.json", "--participant", "P01", "--case-name", "a")
osteo("study", "analyse", "study")
osteo("study", "form", "study", "--rater", "R1")
pages = sorted(p for p in work.rglob("*.html"))
assert len(pages) == 5, pages

# That it sees what is wrong.
planted = work / "planted.html"
planted.write_text(
    pages[0]
    .read_text(encoding="utf-8")
    .replace("</body>", '<img src="data:,x"><p style="color:#bbb;background:#fff">pale</p></body>', 1),
    encoding="utf-8",
)
assert {v["id"] for v in violations(planted)[0]} == {"color-contrast", "image-alt"}
bad = 0
for page in pages:
    found, passed = violations(page)
    bad += len(found)
    print(f"{page.relative_to(work)}: {passed} rules passed, {len(found)} violated")
    for v in found:
        print(
            f"  {v['impact']} {v['id']}, {len(v['nodes'])} places:\n    "
            + "\n    ".join(n[:300] for n in v["nodes"][:4])
        )
sys.exit(1 if bad else 0)

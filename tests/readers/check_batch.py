#!/usr/bin/env python3
"""The same table through 'osteo batch' and through the Snakemake workflow: the same records and reports, broken cases recorded and no other
lost, a case killed in the middle done again. The workflow is run by the very line of docs/how-to/cluster.md, in a folder as it is installed: read only, and
nothing in it executable. Snakemake must be at hand.

usage: check_batch.py BIN_DIR FIXTURES WORK_DIR      exits 77 (skipped) without snakemake
"""

import json, os, pathlib, re, shutil, signal, subprocess, sys, time

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
source = pathlib.Path(__file__).resolve().parents[2]
if shutil.which("snakemake") is None:
    print("skipped: no snakemake")
    sys.exit(77)
for p in work.glob("installed/**/"):
    p.chmod(0o755)
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
osteo = bin_dir / "osteo"

# Bone and no pictures: what is tried here is who does what, not how it looks.
(work / "p.json").write_text(
    json.dumps(
        {
            "osteotome": 1,
            "variables": {"source": {}, "case": {}, "lower": {"default": 500}},
            "stages": [
                {
                    "id": "scan",
                    "stage": "import",
                    "in": {"source": {"file": "${source}"}},
                    "out": {"verdict": "${case}/import.json"},
                },
                {"id": "mask", "stage": "threshold", "in": {"image": "scan"}, "params": {"lower": "${lower}"}},
                {
                    "id": "bone",
                    "stage": "resample",
                    "in": {"image": "scan", "mask": "mask"},
                    "params": {"spacing_mm": 3},
                    "out": {"bone": "${case}/bone.vdb", "hu": "${case}/hu.vdb"},
                },
                {
                    "id": "surface",
                    "stage": "surface",
                    "in": {"bone": "bone"},
                    "out": {"surface": "${case}/surface.ply"},
                },
            ],
        }
    )
)
(work / "torn.nrrd").write_text("torn")
cases, broken = int(os.environ.get("OSTEO_BATCH_CASES", "8")), int(os.environ.get("OSTEO_BATCH_BROKEN", "2"))
rows = [(f"C{i:03d}", "torn.nrrd" if i % (cases // broken) == 1 else fixtures / "ct.nrrd") for i in range(cases)]
# As a spreadsheet with other settings writes it, with a row of nothing at the end.
(work / "t.csv").write_text("case;source\n" + "".join(f"{c};{s}\n" for c, s in rows) + ";\n", encoding="utf-16")
bad = [c for c, s in rows if s == "torn.nrrd"]
profile = os.environ.get("OSTEO_BATCH_PROFILE", "local")


def report(out):
    return json.loads((work / out / "report.json").read_text())


installed = work / "installed" / "snakemake"
shutil.copytree(source / "pipelines/snakemake", installed)
for p in [installed, *installed.rglob("*")]:
    p.chmod(0o555 if p.is_dir() else 0o444)
files_before = sorted(installed.rglob("*"))
page = re.search(r"```\n(.*?)```", (source / "docs/how-to/cluster.md").read_text(), re.DOTALL)[1].splitlines()
(line,) = (text for text in page if f"--profile profiles/{profile} " in text)
assert page[0] == "cd pipelines/snakemake" and "/data/OUT" in line and "/data/TABLE.csv" in line, page
line = line.replace("/data/TABLE.csv", f"{work}/t.csv").replace("/data/OUT", f"{work}/s")
# What is added makes it small, and goes to the end: a later setting counts.
line += f" pipeline={work}/p.json cases_per_job={max(2, cases // 20)} flags=--no-report memory_mb=1000 threads=1"
os.environ["PATH"] = f"{bin_dir}:{os.environ['PATH']}"


def snakemake():
    return subprocess.Popen(
        ["sh", "-c", line], cwd=installed, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


start = time.time()
r = subprocess.run([osteo, "batch", "t.csv", "-o", "b", "--pipeline", "p.json", "--no-report", "--quiet"], cwd=work)
assert r.returncode == 8, r.returncode
alone = time.time() - start

start = time.time()
run = snakemake()
# A worker dies: the first that is seen at a case which has not ended.
killed = 0
while run.poll() is None and not killed:
    for p in pathlib.Path("/proc").iterdir():
        try:
            words = (p / "cmdline").read_bytes().split(b"\0")
        except (OSError, ValueError):
            continue
        if (
            p.name.isdigit()
            and len(words) > 3
            and words[0] == b"osteo"
            and words[1] == b"batch"
            and b"--only" in words
            and f"{work}/s".encode() in words
        ):
            os.kill(int(p.name), signal.SIGKILL)
            killed = int(p.name)
            break
    time.sleep(0.02)
said, _ = run.communicate()
assert killed, said
if run.returncode != 0:  # its second try may have met the first one's last breath
    run = snakemake()
    said, _ = run.communicate()
assert run.returncode == 0, said
workflow = time.time() - start
assert sorted(installed.rglob("*")) == files_before, "nothing is written where it is installed"
assert list((work / "s.snakemake/.snakemake/log").iterdir())

one, other = report("b"), report("s")
for r in (one, other):
    assert r["cases"] == cases and r["done"] == cases - len(bad) and r["refused"] == len(bad) and r["waiting"] == 0, r
    assert [x["case"] for x in r["rows"] if x["state"] == "refused"] == bad
for a, b in zip(one["rows"], other["rows"]):
    assert all(a[k] == b[k] for k in ("case", "state", "exit_code", "verdict", "bone_mm3", "triangles", "why")), (a, b)
for c, s in rows:
    if c not in bad:
        assert (work / "b/cases" / c / "bone.vdb").read_bytes() == (work / "s/cases" / c / "bone.vdb").read_bytes(), c
# Again: nothing is left to do, and nothing is touched.
stamp = (work / "s/records/C000.json").stat().st_mtime_ns
assert (
    subprocess.run(
        [osteo, "batch", "t.csv", "-o", "s", "--pipeline", "p.json", "--no-report", "--quiet"], cwd=work
    ).returncode
    == 8
)
assert (work / "s/records/C000.json").stat().st_mtime_ns == stamp
print(
    f"ok  {cases} cases, {len(bad)} broken, one worker killed: the same by both; osteo batch {alone:.1f} s, the workflow {workflow:.1f} s"
)

#!/usr/bin/env python3
"""Each stage as a module of 3D Slicer. Slicer's parser (SlicerExecutionModel, ModuleDescriptionParser.cxx) is in no package and cannot be
fetched here, so its rules are checked as they stand in its source, commit 0064380c26e2: which tags there are and where they may stand, which
attributes they have and with which values, that names and long flags are letters, digits and underscores and begin with no digit, that an
index and a flag exclude each other, no more than ten levels. Besides, what Slicer's start of a module rests on: parameters are told apart by
name, indices are 0, 1, 2, ... without a gap, a flag is off by default, a default lies in its range or among its choices.
Then modules are run as Slicer runs them.

usage: check_slicer_modules.py BIN_DIR FIXTURES WORK_DIR
"""

import json, os, pathlib, re, shutil, subprocess, sys
import xml.etree.ElementTree as tree

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
(work / "share").mkdir(parents=True)

VARIABLE = re.compile(r"[_A-Za-z][_A-Za-z0-9]*\Z")
BOOL = {"true", "false"}
ANY = None
PLAIN = {"multiple": {"true"}}
PARAMETERS = {
    "integer": PLAIN,
    "float": PLAIN,
    "double": PLAIN,
    "string": PLAIN,
    "directory": PLAIN,
    "boolean": {"hidden": BOOL},
    "integer-vector": {},
    "float-vector": {},
    "double-vector": {},
    "string-vector": {},
    "string-enumeration": {"hidden": BOOL},
    "integer-enumeration": {"hidden": BOOL},
    "float-enumeration": {"hidden": BOOL},
    "double-enumeration": {"hidden": BOOL},
    "point": {"multiple": BOOL, "coordinateSystem": {"ijk", "lps", "ras"}},
    "region": {"multiple": BOOL, "coordinateSystem": {"ijk", "lps", "ras"}},
    "pointfile": {"multiple": BOOL, "fileExtensions": ANY, "coordinateSystem": {"ijk", "lps", "ras"}},
    "file": {"multiple": BOOL, "fileExtensions": ANY},
    "image": {
        "multiple": BOOL,
        "hidden": BOOL,
        "reference": ANY,
        "fileExtensions": ANY,
        "type": {"scalar", "label", "vector", "tensor", "diffusion-weighted", "dynamic-contrast-enhanced"},
    },
    "geometry": {"multiple": BOOL, "aggregate": BOOL, "fileExtensions": ANY, "type": {"fiberbundle", "model"}},
    "transform": {
        "multiple": BOOL,
        "type": {"linear", "nonlinear", "bspline"},
        "fileExtensions": ANY,
        "reference": ANY,
    },
    "table": {"multiple": BOOL, "reference": ANY, "hidden": BOOL, "type": {"color"}, "fileExtensions": ANY},
}
OF_EXECUTABLE = {
    "category",
    "title",
    "description",
    "version",
    "documentation-url",
    "license",
    "contributor",
    "acknowledgements",
    "index",
    "parameters",
}
OF_PARAMETER = {
    "name",
    "longflag",
    "flag",
    "label",
    "description",
    "default",
    "element",
    "channel",
    "index",
    "constraints",
}


def refusals(text):
    """What Slicer would refuse, or run wrongly; empty when all is well."""
    wrong = []
    if not text.startswith("<?xml"):
        wrong.append("does not begin with <?xml")
    root = tree.fromstring(text)
    if root.tag != "executable":
        return wrong + ["no <executable>"]
    wrong += [f"<{e.tag}> in <executable>" for e in root if e.tag not in OF_EXECUTABLE]
    wrong += [
        f"no <{t}>" for t in ("category", "title", "description", "version") if not (root.findtext(t) or "").strip()
    ]
    names, flags, indices = [], [], []
    for group in root.findall("parameters"):
        wrong += [f"<parameters> has {k}={v}" for k, v in group.attrib.items() if k != "advanced" or v not in BOOL]
        wrong += [f"a group without <{t}>" for t in ("label", "description") if not (group.findtext(t) or "").strip()]
        for p in group:
            if p.tag in ("label", "description"):
                continue
            if p.tag not in PARAMETERS:
                wrong.append(f"<{p.tag}> is no parameter")
                continue
            name = (p.findtext("name") or "").strip()
            here = f"{p.tag} '{name}': "
            for k, v in p.attrib.items():
                if k not in PARAMETERS[p.tag] or (PARAMETERS[p.tag][k] is not ANY and v not in PARAMETERS[p.tag][k]):
                    wrong.append(here + f"attribute {k}={v}")
            wrong += [here + f"<{c.tag}>" for c in p if c.tag not in OF_PARAMETER]
            if not VARIABLE.match(name):
                wrong.append(here + "no name of a variable")
            names.append(name)
            long, short, index = p.findtext("longflag"), p.findtext("flag"), p.findtext("index")
            if long is not None:
                long = long.strip().lstrip("-")
                flags.append(long)
                if not VARIABLE.match(long):
                    wrong.append(here + f"long flag '{long}'")
            if short is not None and len(short.strip().lstrip("-")) != 1:
                wrong.append(here + f"flag '{short}'")
            if index is not None:
                indices.append(int(index))
            if (index is None) == (long is None and short is None):
                wrong.append(here + "must have either an index or a flag")
            wrong += [here + f"no <{t}>" for t in ("label", "description") if not (p.findtext(t) or "").strip()]
            if p.tag in ("image", "geometry", "file", "pointfile", "directory", "transform", "table") and p.findtext(
                "channel"
            ) not in ("input", "output"):
                wrong.append(here + "no <channel>")
            default, choices = p.findtext("default"), [e.text for e in p.findall("element")]
            if p.tag.endswith("-enumeration") and (
                not choices or default not in choices or len(set(choices)) < len(choices)
            ):
                wrong.append(here + f"default {default} among {choices}")
            if p.tag == "boolean" and default != "false":
                wrong.append(here + "Slicer cannot turn off what is on by default")
            if p.tag.endswith("-vector") and not all(
                re.match(r"-?[0-9.e+-]+\Z", n) for n in (default or "x").split(",")
            ):
                wrong.append(here + f"default {default}")
            bounds = p.find("constraints")
            if bounds is not None:
                wrong += [
                    here + f"<{c.tag}> in <constraints>" for c in bounds if c.tag not in ("minimum", "maximum", "step")
                ]
                low, high, step = (float(bounds.findtext(t)) for t in ("minimum", "maximum", "step"))
                if not (low <= float(default) <= high and step > 0):
                    wrong.append(here + f"default {default} is not in {low} to {high}")
    for what, all_of in (("name", names), ("flag", flags)):
        wrong += [f"the {what} '{n}' twice" for n in sorted({n for n in all_of if all_of.count(n) > 1})]
    if sorted(indices) != list(range(len(indices))):
        wrong.append(f"indices {indices}")
    return wrong


# The check itself must refuse what Slicer refuses.
GOOD = """<?xml version="1.0"?><executable><category>a</category><title>a</title><description>a</description><version>1</version><parameters><label>a</label>
<description>a</description><double><name>spacing_mm</name><longflag>--spacing_mm</longflag><label>a</label><description>a</description><default>1</default></double>
</parameters></executable>"""
assert refusals(GOOD) == [], refusals(GOOD)
for old, new in (
    ("--spacing_mm", "--spacing-mm"),
    ("<name>spacing_mm", "<name>2nd"),
    ("</longflag>", "</longflag><index>0</index>"),
    ("double>", "number>"),
    ("<double>", '<double type="x">'),
    ("<default>1", "<constraints><minimum>2</minimum><maximum>3</maximum><step>1</step></constraints><default>1"),
    ("<label>a</label>\n", ""),
):
    assert refusals(GOOD.replace(old, new)) != [], f"{old} -> {new} passes"

osteo = bin_dir / "osteo"
subprocess.run([osteo, "docs", "--shared", work / "share"], check=True)
(work / "bin").mkdir()
(work / "bin" / "osteo").symlink_to(osteo)
modules = work / "share" / "osteo" / "slicer"
stages = [
    s["name"] for s in json.loads(subprocess.run([osteo, "list", "--json"], capture_output=True, check=True).stdout)
]
scripts = sorted(p.name for p in modules.iterdir() if p.suffix == "")
assert len(scripts) == len(stages) and all(
    os.access(modules / s, os.X_OK) and (modules / (s + ".xml")).is_file() for s in scripts
), scripts
bad = {s: r for s in scripts if (r := refusals((modules / (s + ".xml")).read_text()))}
assert not bad, json.dumps(bad, indent=1)
print(f"ok  {len(scripts)} modules have nothing that Slicer's parser refuses")

# What Slicer chooses in its scene: nothing of it is typed as text.
chosen = {}
for s in scripts:
    for p in tree.fromstring((modules / (s + ".xml")).read_text()).iter():
        if p.tag in ("transform", "point", "pointfile", "region"):
            chosen.setdefault(s[5:], {})[p.findtext("name")] = p
assert {m: {n: p.tag for n, p in c.items()} for m, c in chosen.items()} == {
    "Register": {"transform_out": "transform"},
    "Tube": {"points_mm": "point", "points": "pointfile"},
    "DistanceAt": {"points": "pointfile"},
    "VirtualFixture": {"curve": "pointfile", "path": "pointfile"},
    "FindStructures": {"labyrinth_mm": "point"},
    "Snapshot": {"centre_mm": "point"},
    "Saw": {"at_mm": "point"},
    "Simulate": {"tool_from_mm": "point", "tool_to_mm": "point"},
    "FitDamping": {"at_mm": "point"},
    "Crop": {"box": "region"},
    "Resample": {"box": "region"},
}, chosen
assert chosen["Register"]["transform_out"].attrib == {"type": "linear", "fileExtensions": ".tfm"}
assert chosen["Tube"]["points_mm"].attrib["multiple"] == "true"
assert all(p.get("coordinateSystem") == "lps" for c in chosen.values() for p in c.values() if p.tag != "transform")


def run(module, *args, code=0):
    r = subprocess.run([modules / module, *map(str, args)], cwd="/", capture_output=True, text=True)
    assert r.returncode == code, (module, args, r.returncode, r.stdout, r.stderr)
    return r


r = run("OsteoThreshold", "--xml")
assert r.stdout == (modules / "OsteoThreshold.xml").read_text() and r.stderr == ""

# As Slicer calls it: flags by their long names, values as they stand in the panel, then files in the order of the index.
for _ in range(2):  # the second time into files that are there
    r = run(
        "OsteoThreshold",
        "--lower",
        "500",
        "--min_volume_mm3",
        "10",
        "--preset",
        "fixed",
        "--threads",
        "1",
        fixtures / "ct.nrrd",
        work / "m.nrrd",
    )
    assert r.stderr == "", r.stderr
    steps = [float(x) for x in re.findall(r"<filter-progress>([0-9.e-]+)</filter-progress>", r.stdout)]
    assert steps and steps == sorted(steps) and steps[-1] == 1 and 0 <= steps[0], r.stdout
r = run("OsteoThreshold", "--lower", "5000", "--upper", "4000", fixtures / "ct.nrrd", work / "n.nrrd", code=2)
assert r.stderr != "" and not (work / "n.nrrd").exists()
# A chain through the types that Slicer has.
run("OsteoResample", "--spacing_mm", "1.5", "--lower", "500", fixtures / "ct.nrrd", work / "m.nrrd", work / "b.vdb")
run("OsteoSurface", work / "b.vdb", work / "b.vtp")
assert (work / "b.vtp").stat().st_size > 10000
print("ok  modules run as Slicer runs them")

# A transform is one that Slicer loads: its own suffix, ITK's text.
run("OsteoRegister", fixtures / "ct.nrrd", fixtures / "ct.nrrd", work / "t.tfm")
assert (work / "t.tfm").read_text().startswith("#Insight Transform File"), "not ITK's text"


def plain(*args):
    subprocess.run([osteo, *map(str, args), "--quiet"], cwd=work, check=True)


def same(a, b):
    assert (work / a).read_bytes() == (work / b).read_bytes(), (a, b)


# A box of the scene goes as centre and half edges.
run("OsteoCrop", "--region", "whole", "--box", "60,10,-5,15,10,5", fixtures / "ct.nrrd", work / "box.nrrd")
plain("crop", fixtures / "ct.nrrd", "box2.nrrd", "--region", "box", "--centre-mm", "60,10,-5", "--size-mm", "30,20,10")
same("box.nrrd", "box2.nrrd")
run(
    "OsteoResample",
    "--spacing_mm",
    "1.5",
    "--lower",
    "500",
    "--box",
    "60,10,-5,15,10,5",
    fixtures / "ct.nrrd",
    work / "m.nrrd",
    work / "rb.vdb",
)
plain(
    "resample",
    fixtures / "ct.nrrd",
    "m.nrrd",
    "rb2.vdb",
    "--spacing-mm",
    "1.5",
    "--lower",
    "500",
    "--centre-mm",
    "60,10,-5",
    "--box-mm",
    "30,20,10",
)
for v in ("rb", "rb2"):
    plain("surface", f"{v}.vdb", f"{v}.stl")
same("rb.stl", "rb2.stl")
assert (
    "three half edges" in run("OsteoCrop", "--box", "60,10,-5,15", fixtures / "ct.nrrd", work / "n.nrrd", code=2).stderr
)
# A point of the scene is where the scene has it; of several the flag is repeated.
run("OsteoSaw", "--at_mm", "60,10,-5", "--kerf_mm", "2", work / "b.vdb", work / "cut.vdb")
plain("saw", "b.vdb", "cut2.vdb", "--at-mm", "60,10,-5", "--no-from-centre", "--kerf-mm", "2")
for v in ("cut", "cut2"):
    plain("surface", f"{v}.vdb", f"{v}.stl")
same("cut.stl", "cut2.stl")
run("OsteoPhantom", "--region", "temporal", "--spacing_mm", "1", work / "ear.nrrd")
NERVE = ["36,-2,-12", "38.5,1.5,-14", "41,5.5,-16", "42.5,7.5,-19", "44.5,9.3,-31"]
each = [w for p in NERVE for w in ("--points_mm", p)]
run("OsteoTube", *each[:4], "--max_unsure_mm", "40", *each[4:], work / "ear.nrrd", work / "a.nrrd")
plain("tube", "ear.nrrd", "a2.nrrd", "--points-mm", "; ".join(NERVE), "--max-uncertain-mm", "40")
same("a.nrrd", "a2.nrrd")
# Points as Slicer writes them to a file, in LPS as asked, or in RAS as older versions do.
plain("surface", "b.vdb", "b.ply")
(work / "p.csv").write_text("53.4,25.9,-15.6\n48,24,-28\n")
HEAD = "# Markups fiducial file version = 4.10\n# CoordinateSystem = {}\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
for name, sign in (("LPS", 1), ("1", 1), ("RAS", -1), ("0", -1)):
    rows = "".join(
        f"vtkMRMLMarkupsFiducialNode_{i},{sign * x},{sign * y},{z},0,0,0,1,1,1,0,F-{i},,\n"
        for i, (x, y, z) in enumerate(((53.4, 25.9, -15.6), (48, 24, -28)))
    )
    (work / "p.fcsv").write_text(HEAD.format(name) + rows)
    run("OsteoDistanceAt", work / "b.vtp", work / "p.fcsv", work / "d.json")
    plain("distance-at", "b.vtp", "p.csv", "d2.json", "--force")
    assert (
        json.loads((work / "d.json").read_text())["points"] == json.loads((work / "d2.json").read_text())["points"]
    ), name
(work / "p.fcsv").write_text(HEAD.format("IJK") + "1,2,3,4\n")
assert "IJK" in run("OsteoDistanceAt", work / "b.vtp", work / "p.fcsv", work / "d.json", code=4).stderr
print("ok  transform, points and boxes go as Slicer's own")

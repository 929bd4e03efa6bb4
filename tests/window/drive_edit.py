#!/usr/bin/env python3
"""Drives the editor under Xvfb and checks each effect, down to the voxels that the saved corrections give. Waits for what it wants to see.
usage: drive_edit.py BIN_DIR WORK_DIR"""

import array, gzip, json, os, pathlib, re, shutil, subprocess, sys, time

from driver import *

bin_dir, work = pathlib.Path(sys.argv[1]).absolute(), pathlib.Path(sys.argv[2]).absolute()


def osteo(*args, code=0):
    done = subprocess.run([bin_dir / "osteo", *map(str, args)], capture_output=True, text=True)
    assert done.returncode == code, (args, done.returncode, done.stderr)
    return done.stdout + done.stderr


class Window(Program):
    def __init__(self, *args, case="case"):
        super().__init__([bin_dir / "osteo-edit", case, *args], "Osteotome edit")
        self.x("mousemove", *self.place(0, 0.5, 0.5))
        self.until("3D", lambda s: s["triangles"] > 0 and not s["previewing"])

    def place(self, view, across, down):
        v = self.state()["views"][view]
        return round(v["x"] + across * v["width"]), round(v["y"] + down * v["height"])

    def shown(self):
        """So that what was done with the mouse is known to be seen."""
        n = self.state()["pictures"]
        return self.until("next picture", lambda s: s["pictures"] > n)

    def drag(self, begin, end, button=1):
        self.x("mousemove", *begin)
        self.shown()
        self.x("mousedown", button)
        self.shown()
        self.x("mousemove", *end)
        self.shown()
        self.x("mouseup", button)
        return self.shown()

    def double_click(self, what, condition):
        """Again where a busy machine made two single clicks of it."""

        def clicked():
            time.sleep(0.5)
            self.x("click", "--repeat", 2, "--delay", 40, 1)
            self.shown()
            return condition(self.shown())

        wait(what, clicked)


def nrrd(path):
    data = pathlib.Path(path).read_bytes()
    head, body = data.split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    if fields["encoding"].startswith("gz"):
        body = gzip.decompress(body)
    sizes = [int(n) for n in fields["sizes"].split()]
    values = array.array("h" if fields["type"] in ("short", "int16", "signed short") else "B")
    values.frombytes(body[: sizes[0] * sizes[1] * sizes[2] * values.itemsize])
    numbers = lambda text: [float(n) for n in re.findall(r"-?[0-9.]+(?:e-?[0-9]+)?", text)]
    origin, steps = numbers(fields["space origin"]), numbers(fields["space directions"])
    if "posterior" in fields["space"] and "left" in fields["space"]:
        spacing = [steps[0], steps[4], steps[8]]
    at = lambda mm: values[
        sum(round((mm[a] - origin[a]) / spacing[a]) * (1, sizes[0], sizes[0] * sizes[1])[a] for a in range(3))
    ]
    return values, at


def world(state, view, px, py):
    """LPS mm of a pixel of the window, as SliceView has it."""
    v = state["views"][view]
    x = (px - v["x"] + 0.5 - v["width"] / 2) * v["mm_per_pixel"]
    y = (py - v["y"] + 0.5 - v["height"] / 2) * v["mm_per_pixel"]
    c, cross = v["centre_mm"], state["cross_mm"]
    return [(c[0] + x, c[1] + y, cross[2]), (c[0] + x, cross[1], c[2] - y), (cross[0], c[1] + x, c[2] - y)][view]


shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
os.chdir(work)
os.environ["LIBGL_ALWAYS_SOFTWARE"] = "1"
os.environ["XDG_STATE_HOME"] = str(work / "state")
osteo("phantom", "ct.nrrd", "--labels-out", "labels.nrrd", "--region", "temporal", "--spacing-mm", "1", "--quiet")
osteo(
    "prepare",
    "ct.nrrd",
    "-o",
    "case",
    "--lower",
    "400",
    "--spacing-mm",
    "1",
    "--structures",
    "labels.nrrd",
    "--names",
    "6=facial nerve",
    "--quiet",
)
bone_before = pathlib.Path("case/bone.vdb").read_bytes()
files_before = {p.name for p in work.iterdir()}

with Screen("1024x700") as screen:
    w = Window()
    s = w.state()
    assert s["size"] == [1024, 700] and s["steps"] == 0 and not s["unsaved"], s
    assert abs(s["lower_hu"] - 400) < 3, s  # the threshold of the case

    # Looking around.
    s = w.key("Up", "next slice", lambda t: t["views"][0]["slice"] == s["views"][0]["slice"] + 1)
    w.x("click", 4)
    s = w.until("wheel", lambda t: t["views"][0]["slice"] == s["views"][0]["slice"] + 1)
    x, y = w.place(1, 0.4, 0.6)
    w.x("keydown", "shift", "mousemove", x, y)
    want = world(s, 1, x, y)
    s = w.until(
        "the crosshair follows", lambda t: abs(t["cross_mm"][0] - want[0]) < 1 and abs(t["cross_mm"][2] - want[2]) < 1
    )
    w.x("keyup", "shift")
    w.key("F4", "preset", lambda t: t["window_hu"] == 4000 and t["level_hu"] == 700)
    w.drag(w.place(0, 0.5, 0.5), w.place(0, 0.6, 0.5))
    s = w.until("window by drag", lambda t: t["window_hu"] > 4050)
    w.x("mousemove", *w.place(2, 0.5, 0.5))
    w.double_click("enlarged", lambda t: t["enlarged"] == 2 and t["views"][2]["width"] > 650)
    w.double_click("four again", lambda t: t["enlarged"] == -1)
    w.key("F1", "help", lambda t: t["help"])
    w.key("F1", "help away", lambda t: not t["help"])

    # A threshold by the slider, live, then applied.
    s = w.key("3", "threshold", lambda t: t["tool"] == "Threshold" and t["threshold_slider"][2] > 50)
    left, top, width, height = s["threshold_slider"]
    middle = round(top + height / 2)
    w.drag((round(left + 0.30 * width), middle), (round(left + 0.35 * width), middle))
    s = w.until("another threshold", lambda t: 450 < t["lower_hu"] < 700 and t["steps"] == 0)
    lower = s["lower_hu"]
    s = w.key("Return", "applied", lambda t: t["steps"] == 1 and not t["busy"])
    assert "removed" in s["message"] and s["unsaved"], s

    # Two strokes beside bone; the second is taken back.
    w.x("mousemove", *w.place(0, 0.5, 0.5))
    s = w.key("9", "brush", lambda t: t["tool"] == "Brush")
    kept = [world(s, 0, *w.place(0, a, 0.5)) for a in (0.34, 0.39)]
    w.drag(w.place(0, 0.34, 0.5), w.place(0, 0.39, 0.5))
    w.until("a stroke", lambda t: t["steps"] == 2)
    undone = world(s, 0, *w.place(0, 0.5, 0.25))
    w.drag(w.place(0, 0.5, 0.25), w.place(0, 0.5, 0.27))
    w.until("another stroke", lambda t: t["steps"] == 3)
    w.key("ctrl+z", "undo", lambda t: t["steps"] == 2 and t["can_redo"])

    # It asks before it closes, and goes on.
    w.key("q", "asks", lambda t: t["asking"])
    w.key("Escape", "goes on", lambda t: not t["asking"])
    w.key("ctrl+s", "saved", lambda t: not t["unsaved"] and not t["saving"] and t["message"].startswith("saved"))
    w.x("key", "q")
    w.end()

    # By effect: the corrections on the mask that prepare makes give these voxels.
    osteo("threshold", "ct.nrrd", "mask.nrrd", "--lower", 400, "--quiet")
    osteo("apply-edits", "ct.nrrd", "mask.nrrd", "case/edits.json", "corrected.nrrd", "--quiet")
    ct, hu = nrrd("ct.nrrd")
    mask, bone = nrrd("corrected.nrrd")
    ball = sum(1 for h, b in zip(ct, mask) if b and h < lower)
    assert all(b for h, b in zip(ct, mask) if h >= lower), "a voxel above the threshold is missing"
    assert 20 < ball < 400, ball  # the stroke alone
    assert all(bone(p) for p in kept) and all(hu(p) < lower for p in kept), (kept, [hu(p) for p in kept])
    assert hu(undone) >= lower or not bone(undone), undone
    assert pathlib.Path("case/bone.vdb").read_bytes() != bone_before
    osteo("estimate-cost", "case")

    # prepare keeps them; a threshold that would have no say is refused; they can be taken to a copy, and dropped.
    saved = {
        p.name: p.read_bytes()
        for p in pathlib.Path("case").iterdir()
        if p.suffix in (".vdb", ".ply", ".nrrd", ".json") and "prov" not in p.name and p.name != "manifest.json"
    }
    assert "--edits" in osteo("prepare", "-o", "case")
    assert "has no say" in osteo("prepare", "-o", "case", "--lower", 300, code=2)
    assert all((pathlib.Path("case") / n).read_bytes() == b for n, b in saved.items())
    osteo(
        "prepare",
        "ct.nrrd",
        "-o",
        "copy",
        "--lower",
        "400",
        "--spacing-mm",
        "1",
        "--structures",
        "labels.nrrd",
        "--names",
        "6=facial nerve",
        "--quiet",
    )
    assert pathlib.Path("copy/bone.vdb").read_bytes() == bone_before
    osteo("edit", "copy", "--apply", "case/edits.json", "--quiet")
    assert all((pathlib.Path("copy") / n).read_bytes() == b for n, b in saved.items()), "the copy differs"
    none = json.loads(saved["edits.json"])
    none["operations"].append({"do": "delete_structure", "structure": 6})
    none["start_hash"] = "another"  # so that the result is told to be another one
    pathlib.Path("none.json").write_text(json.dumps(none))
    assert "look at it" in osteo("edit", "copy", "--apply", "none.json")
    osteo("estimate-cost", "copy")  # critical structures: none
    osteo("edit", "copy", "--apply", "case/edits.json", "--quiet")
    # To 3D Slicer and back: what was corrected here goes along, and is not done again on top of what comes back.
    osteo("export-slicer", "copy", "handed", "--quiet")
    segment = pathlib.Path("handed/bone.seg.nrrd")
    head, body = segment.read_bytes().split(b"\n\n", 1)
    voxels = bytearray(gzip.decompress(body))
    assert sum(voxels) == sum(1 for b in mask if b), "the corrections were not handed over"
    shutil.copytree("copy", "returned")
    first = voxels.index(1)
    voxels[first] = 0
    segment.write_bytes(head + b"\n\n" + gzip.compress(bytes(voxels)))
    osteo("import-slicer", "returned", "handed", "--quiet")
    assert not pathlib.Path("returned/edits.json").exists() and pathlib.Path("returned/edits-dropped.json").exists()
    osteo("export-slicer", "returned", "again", "--quiet")
    assert gzip.decompress(pathlib.Path("again/bone.seg.nrrd").read_bytes().split(b"\n\n", 1)[1]) == bytes(voxels)
    osteo("prepare", "-o", "copy", "--no-edits", "--quiet")
    assert pathlib.Path("copy/bone.vdb").read_bytes() == bone_before and not pathlib.Path("copy/edits.json").exists()
    assert pathlib.Path("copy/edits-dropped.json").read_bytes() == saved["edits.json"]
    osteo("phantom", "other.nrrd", "--region", "temporal", "--spacing-mm", "1", "--individual", 3, "--quiet")
    osteo("prepare", "other.nrrd", "-o", "other", "--lower", "400", "--spacing-mm", "1", "--quiet")
    assert "another CT" in osteo("edit", "other", "--apply", "case/edits.json", code=2)

    # Opened again it is as it was left, and can be undone from there. Closed without saving the case stays.
    w = Window()
    s = w.state()
    assert s["steps"] == 2 and not s["unsaved"] and s["structures"][0]["name"] == "facial nerve", s
    w.x("mousemove", *w.place(0, 0.5, 0.5))
    w.key("ctrl+z", "undo", lambda t: t["steps"] == 1 and t["unsaved"])
    w.key("q", "asks", lambda t: t["asking"])
    w.x("key", "d")
    w.end()
    assert all((pathlib.Path("case") / n).read_bytes() == b for n, b in saved.items())

    # No disk for it: told, and the case is as it was.
    w = Window("--width", 1000, "--height", 680)
    w.key("ctrl+z", "undo", lambda t: t["unsaved"])
    pathlib.Path("ct.nrrd").rename("moved.nrrd")
    w.key("ctrl+s", "not saved", lambda t: t["message"].startswith("NOT SAVED") and not t["saving"] and t["unsaved"])
    pathlib.Path("moved.nrrd").rename("ct.nrrd")
    w.key("ctrl+s", "saved", lambda t: t["message"].startswith("saved") and not t["unsaved"])
    w.x("key", "q")
    w.end()

    # Of a network that does not know where its boundaries lie: the editor lists where to look, and goes there.
    network = pathlib.Path(__file__).resolve().parents[2] / "testdata/neural/plain"
    shutil.copytree(network, "network")
    rows = [{"value": v, "least_mm3": 0, "most_mm3": 1e9, "least_dice": 0, "boundary_mm": [[0.1, 20]]} for v in (1, 2)]
    pathlib.Path("network/calibration.json").write_text(
        json.dumps({"osteotome_calibration": 1, "temperature": 1, "structures": rows})
    )
    osteo(
        *("prepare", network / "image.nrrd", "-o", "netcase", "--structures", "network", "--lower", 500),
        *("--spacing-mm", 0.9, "--quiet"),
    )
    w = Window(case="netcase")
    x, y, width, height = w.state()["first_place"]
    assert width > 20, w.state()
    before = w.state()["cross_mm"]
    w.x("mousemove", round(x + width / 2), round(y + height / 2), "click", 1)
    s = w.until("at the place", lambda t: t["cross_mm"] != before)
    classes, at = nrrd("netcase/uncertainty.seg.nrrd")
    assert at(s["cross_mm"]) == 4 and set(classes) == {0, 4}, (s["cross_mm"], set(classes))
    # The network again, on the open scan: one step, taken back by one undo; another folder is rejected by its name.
    names = [e["name"] for e in s["structures"]]
    x, y, width, height = s["find_button"]
    assert width > 50, s
    press = lambda: w.x("mousemove", round(x + width / 2), round(y + height / 2), "click", 1)
    press()
    s = w.until("structures found", lambda t: t["steps"] == 1 and not t["busy"])
    assert s["undo"] == "structures by network" and s["unsaved"], s
    assert sorted(e["name"] for e in s["structures"]) == sorted(names) and s["places"], s
    w.x("mousemove", *w.place(0, 0.5, 0.5))
    w.key("ctrl+z", "taken back", lambda t: t["steps"] == 0 and t["can_redo"])
    shutil.move("network", "elsewhere")
    press()
    w.until("no network", lambda t: "holds no trained network" in t["message"] and not t["busy"])
    shutil.move("elsewhere", "network")
    w.key("q", "asks", lambda t: t["asking"])
    w.x("key", "d")
    w.end()

# Nothing of the scan lies about but in the reports, which say that they hold pictures of it.
made = (
    {p.name for p in work.iterdir()}
    - files_before
    - {"mask.nrrd", "corrected.nrrd", "copy", "other", "other.nrrd", "none.json", "handed", "returned", "again", "network", "netcase"}
)
assert all(n.startswith("state") or n.endswith(".prov.json") or ".report." in n for n in made), made
print("window edit: all as it should be")

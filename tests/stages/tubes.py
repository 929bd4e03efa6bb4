# A half ring and a rod, as a jaw and a fibula of which the plan is plain: jaw.obj, fibula.obj. And two CTs of the jaw:
# before.nrrd, and after.nrrd, when a third of it was sawn off, half a millimetre beyond the plane of cut.json.
import array, json, math


def tube(name, place, n):
    o = open(name, "w")
    for k in range(n + 1):
        c, u, v = place(k / n)
        for a in range(24):
            x, y = 6 * math.cos(math.pi * a / 12), 6 * math.sin(math.pi * a / 12)
            print("v", *(c[i] + x * u[i] + y * v[i] for i in range(3)), file=o)
    for k in range(n):
        for a in range(24):
            b, p, q = (a + 1) % 24, 24 * k + 1, 24 * k + 25
            print("f", p + a, q + b, p + b, file=o)
            print("f", p + a, q + a, q + b, file=o)
    for a in range(1, 23):
        e = 24 * n + 1
        print("f", 1, a + 1, a + 2, file=o)
        print("f", e, e + a + 1, e + a, file=o)


tube(
    "jaw.obj",
    lambda t: (
        (45 * math.cos(math.pi * t), 45 * math.sin(math.pi * t), 0),
        (math.cos(math.pi * t), math.sin(math.pi * t), 0),
        (0, 0, 1),
    ),
    90,
)
tube("fibula.obj", lambda t: ((0, 0, -300 * t), (1, 0, 0), (0, 1, 0)), 100)

c, s = math.cos(math.radians(100)), math.sin(math.radians(100))
plane = {
    "name": "a",
    "bone": "jaw",
    "at_mm": [45 * c, 45 * s, 0],
    "normal": [-s, c, 0],
    "kerf_mm": 1,
    "waste_ahead": True,
}
stays = {"name": "rest", "bone": "jaw", "planes": ["a"], "rotation_rows": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}
with open("cut.json", "w") as f:
    json.dump(
        {"osteotome_surgical_plan": 1, "unit": "mm", "planes": [plane], "fragments": [stays | {"shift_mm": [0, 0, 0]}]},
        f,
    )

step, dims, origin = 0.8, (112, 90, 30), (-30, -14, -11.6)
before, after = array.array("h"), array.array("h")
for k in range(dims[2]):
    for j in range(dims[1]):
        for i in range(dims[0]):
            x, y, z = origin[0] + step * i, origin[1] + step * j, origin[2] + step * k
            bone = max(math.hypot(math.hypot(x, y) - 45, z) - 5.97, -y)
            for voxels, mm in ((before, bone), (after, max(bone, c * y - s * x - 0.5))):
                voxels.append(40 + round(1000 / (1 + math.exp(4 * max(min(mm, 5), -5)))))
            if bone > 8:
                before[-1] = -1000  # air about the skin
head = "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\n" % dims
head += "space directions: (%g,0,0) (0,%g,0) (0,0,%g)\nspace origin: (%g,%g,%g)\n" % (step, step, step, *origin)
head += "endian: little\nencoding: raw\n\n"
for name, voxels in (("before", before), ("after", after)):
    with open(f"{name}.nrrd", "wb") as f:
        f.write(head.encode() + voxels.tobytes())
# Its plane sawn in a rehearsal, as it is planned in the case.
strokes = {"osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [0, 0, 1]}
strokes["waypoints"] = [{"t_s": t, "at_mm": [0, 0, 60], "drill": False} for t in (0, 0.6)]
strokes["actions"] = [{"t_s": 0.1, "saw": {"planned": "a"}}, {"t_s": 0.3, "split": {"least_mm3": 50}}]
with open("strokes.json", "w") as f:
    json.dump(strokes, f)

# Two screws planned in the jaw of tubes.py: screws.json. One of them is in a CT, half a millimetre above its place, the
# other is not: screwed.nrrd.
import array, json, math

plan = json.load(open("cut.json"))
plan["screws"] = []
for name, degrees in (("1", 30), ("2", 60)):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    one = {"name": name, "fragment": "rest", "entry_mm": [51 * c, 51 * s, 0], "tip_mm": [43 * c, 43 * s, 0]}
    plan["screws"].append(one | {"diameter_mm": 2, "empty": False})
json.dump(plan, open("screws.json", "w"))

head, raw = open("after.nrrd", "rb").read().split(b"\n\n", 1)
voxels = array.array("h", raw)
step, dims, origin = 0.8, (112, 90, 30), (-30, -14, -11.6)
c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
below = lambda x: 0.5 * math.erfc(-x / math.sqrt(2))
for k in range(dims[2]):
    for j in range(dims[1]):
        for i in range(dims[0]):
            x, y, z = origin[0] + step * i, origin[1] + step * j, origin[2] + step * k - 0.5
            along, across = 51 - (x * c + y * s), y * c - x * s
            if not (-4 < along < 11 and abs(across) < 4 and abs(z) < 4):
                continue
            part = 0.0  # blurred by 0.45 mm: exact along and across, in strips over the height
            for n in range(40):
                h = -1 + (n + 0.5) / 20
                w = math.sqrt(1 - h * h)
                density = math.exp(-(((z - h) / 0.45) ** 2) / 2) / (0.45 * math.sqrt(2 * math.pi)) / 20
                part += density * (below((w - across) / 0.45) - below((-w - across) / 0.45))
            part *= below((8 - along) / 0.45) * below((along + 1) / 0.45)
            at = (k * dims[1] + j) * dims[0] + i
            voxels[at] = min(3071, round(voxels[at] + (6000 - voxels[at]) * part))
open("screwed.nrrd", "wb").write(head + b"\n\n" + voxels.tobytes())

"""How far the pieces of a sawn bone reach beyond the planned plane of cut.json: what stays up to it, the other not up to the kerf's end.
usage: sawn_face.py PIECE.stl..."""

import json, struct, sys

plane = json.load(open("cut.json"))["planes"][0]
reach = {}
for name in sys.argv[1:]:
    data = open(name, "rb").read()
    (count,) = struct.unpack_from("<I", data, 80)
    corners = [struct.unpack_from("<3f", data, 84 + 50 * t + 12 * c) for t in range(count) for c in (1, 2, 3)]
    along = [sum(n * (x - a) for n, x, a in zip(plane["normal"], p, plane["at_mm"])) for p in corners]
    reach[name] = (min(along), max(along))
print(reach)
stays, other = sorted(reach.values())
assert stays[0] < -10 and other[1] > 10, "one on each side"
assert abs(stays[1]) < 0.2 and abs(other[0] - plane["kerf_mm"]) < 0.2, "faces of the planned kerf, to a quarter of a voxel"

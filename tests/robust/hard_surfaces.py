"""Hard surfaces that nobody chose: surface i of a seed is always the same (of kind csg only where manifold3d is, from PyPI).

Points are rounded to single precision, as files and Osteotome keep them, so that what is judged is what was read.
"""

import math, random
from dataclasses import dataclass

import numpy as np

from unseen_meshes import ball, box, joined, turned

try:
    import manifold3d
except ImportError:
    manifold3d = None


@dataclass
class Surface:
    name: str
    points: np.ndarray  # n x 3, double, every one a single
    triangles: np.ndarray  # m x 3
    truth: np.ndarray  # the triangles that say what is inside: as above, without what the stated rule turns round
    closed: bool

    @property
    def extent(self):
        return float(np.ptp(self.points, axis=0).max())


def turn_at_random(rng):
    w, x, y, z = (v for v in np.array([rng.gauss(0, 1) for _ in range(4)]))
    n = math.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / n, x / n, y / n, z / n
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def moved(part, rng, reach=1.0, grow=(0.3, 1.0)):
    """Turned at random, made larger or smaller, and put somewhere."""
    turn, size, at = turn_at_random(rng), rng.uniform(*grow), [rng.uniform(-reach, reach) for _ in range(3)]
    return [tuple(p) for p in np.array(part[0]) @ turn.T * size + at], part[1]


def solid(rng):
    a, b, c = (rng.uniform(0.3, 1) for _ in range(3))
    return box((-a, -b, -c), (a, b, c)) if rng.random() < 0.5 else ball((0, 0, 0), a, rng.randint(4, 10))


def finer(points, triangles, wanted):
    """Every triangle in four, until there are as many as wanted: flat fans of coplanar triangles, as scanners and CAD write."""
    points, triangles = np.asarray(points, float), np.asarray(triangles, np.int64)
    while 4 * len(triangles) <= wanted:
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, of = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (of.reshape(-1, 3) + len(points)).T
        points = np.vstack((points, points[edges].mean(axis=1)))
        a, b, c = triangles.T
        triangles = np.vstack([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return points, triangles


def crossing(rng, _):
    return joined(*[moved(solid(rng), rng) for _ in range(rng.randint(2, 5))])


def csg(rng, _):
    """Solids added, taken away and cut, in turn."""
    if manifold3d is None:
        return crossing(rng, _)
    whole = None
    for _ in range(rng.randint(3, 7)):
        kind, n = rng.randrange(3), rng.randint(3, 40)
        one = (
            manifold3d.Manifold.cube([rng.uniform(0.3, 1) for _ in range(3)], True)
            if kind == 0
            else (
                manifold3d.Manifold.sphere(rng.uniform(0.2, 0.7), n)
                if kind == 1
                else manifold3d.Manifold.cylinder(
                    rng.uniform(0.3, 1.5), rng.uniform(0.05, 0.6), rng.uniform(0.05, 0.6), n, True
                )
            )
        )
        # Of round angles as often as of any: flat on flat is what cutting finds hard.
        angles = [rng.choice((0, 45, 90, rng.uniform(0, 360))) for _ in range(3)]
        one = one.rotate(angles).translate([round(rng.uniform(-0.6, 0.6), rng.choice((1, 6))) for _ in range(3)])
        after = one if whole is None else whole + one if rng.random() < 0.6 else whole - one
        whole = after if whole is None or after.volume() > 0.02 else whole
    mesh = whole.to_mesh()
    return mesh.vert_properties[:, :3].astype(float), mesh.tri_verts


def shell(rng, _):
    """The wall of a ball or box of 10 to 100 mm, 0.1 mm thick; scaled by nothing."""
    n, size = rng.randint(5, 16), 10 ** rng.uniform(1, 2)
    if rng.random() < 0.7:
        # Thinner between the points of a coarse ball, and never through itself: it is made smaller, not moved.
        return joined(ball((0, 0, 0), size, n), turned(ball((0, 0, 0), size - 0.1, n)))
    return joined(box((0, 0, 0), (size,) * 3), turned(box((0.1,) * 3, (size - 0.1,) * 3)))


def needles(rng, _):
    return joined(
        *[
            moved(box((-1, -w, -w), (1, w, w)), rng, 0.5)
            for w in (10 ** rng.uniform(-4, -1) for _ in range(rng.randint(1, 6)))
        ]
    )


def nested(rng, _):
    parts, radius = [], 1.0
    for _ in range(rng.randint(2, 5)):
        part = ball((0, 0, 0), radius, rng.randint(5, 9))
        parts.append(turned(part) if rng.random() < 0.5 else part)
        radius *= rng.uniform(0.4, 0.8)
    return joined(*parts)


def touching(rng, _):
    """Boxes of a lattice: they share faces, edges and points."""
    places = [(i, j, k) for i in range(3) for j in range(3) for k in range(3)]
    return joined(*[box(p, tuple(x + 1 for x in p)) for p in rng.sample(places, rng.randint(3, 9))])


def touching_thinly(rng, _):
    """Tetrahedra that meet in a point or an edge and nothing else, and ends of one in the middle of a face of another."""
    a = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    parts = [a]
    for kind in rng.sample(range(4), rng.randint(1, 4)):
        mirror = ((-1, -1, -1), (1, -1, -1), (1, 1, -1), (1, 1, 1))[kind]  # in a point, an edge, a face, in the middle
        p = [tuple(x * m for x, m in zip(q, mirror)) for q in a[0]]
        if kind == 3:
            p = [(x + 1 / 3, y + 1 / 3, z + 1 / 3) for x, y, z in p]
        parts.append((p, a[1]) if mirror[0] * mirror[1] * mirror[2] > 0 else turned((p, a[1])))
    return joined(*parts)


def flipped(rng, _):
    return moved(ball((0, 0, 0), 1, rng.randint(5, 10)), rng)


def cracked(rng, _):
    """Every triangle has points of its own, moved a little, and some are not there."""
    points, triangles = ball((0, 0, 0), 1, rng.randint(5, 10))
    by, p, t = 10 ** rng.uniform(-6, -3), [], []
    for face in triangles:
        if rng.random() < 0.03:
            continue
        t.append((len(p), len(p) + 1, len(p) + 2))
        p += [tuple(x + rng.uniform(-by, by) for x in points[v]) for v in face]
    return p, t


def soup(rng, _):
    """Triangles that have nothing to do with each other."""
    n = rng.randint(10, 100)
    return [tuple(rng.uniform(0, 1) for _ in range(3)) for _ in range(3 * n)], [
        (3 * i, 3 * i + 1, 3 * i + 2) for i in range(n)
    ]


def large(rng, wanted):
    """A ball with waves and roughness, of as many triangles as wanted."""
    n = max(3, round((1 + math.sqrt(1 + wanted)) / 2))  # of 4 n (n - 1) triangles
    along = np.arange(1, n)[:, None] * math.pi / n
    around = np.arange(2 * n)[None, :] * math.pi / n
    unit = np.stack((np.sin(along) * np.cos(around), np.sin(along) * np.sin(around), -np.cos(along) + 0 * around), -1)
    unit = np.vstack(((0, 0, -1.0), unit.reshape(-1, 3), (0, 0, 1.0)))
    radius = np.ones(len(unit))
    for _ in range(6):
        radius += rng.uniform(0.02, 0.1) * np.sin(
            rng.uniform(2, 20) * (unit @ np.array([rng.gauss(0, 1) for _ in range(3)])) + rng.uniform(0, 6)
        )
    radius *= 1 + 1e-4 * np.random.default_rng(rng.randrange(2**32)).uniform(-1, 1, len(unit))
    at = lambda i, j: 1 + (i - 1) * 2 * n + j % (2 * n)
    j = np.arange(2 * n)
    i, k = (x.ravel() for x in np.meshgrid(np.arange(1, n - 1), j, indexing="ij"))
    triangles = [
        np.stack((0 * j, at(1, j + 1), at(1, j)), 1),
        np.stack((at(i, k), at(i, k + 1), at(i + 1, k)), 1),
        np.stack((at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)), 1),
        np.stack((0 * j + len(unit) - 1, at(n - 1, j), at(n - 1, j + 1)), 1),
    ]
    return unit * radius[:, None], np.vstack(triangles)


KINDS = [crossing, csg, shell, needles, nested, touching, touching_thinly, flipped, cracked, soup, large]


def surface(seed, number, largest=2_000_000):
    rng = random.Random(f"{seed} {number}")
    kind, turn = KINDS[number % len(KINDS)], number // len(KINDS)
    wanted = int(largest * (1 if turn == 0 else 10 ** -rng.uniform(0.5, 2.3)))
    points, triangles = kind(rng, wanted)
    points, triangles = np.asarray(points, float), np.asarray(triangles, np.int64)
    if kind not in (large, cracked, soup) and rng.random() < 0.4:
        points, triangles = finer(points, triangles, min(20_000, wanted))
    scale = 1.0 if kind is shell else 10 ** rng.uniform(-6, 6) if rng.random() < 0.5 else 10.0
    points = (points * scale).astype(np.float32).astype(float)
    truth = triangles
    if kind is flipped:
        chosen = np.random.default_rng(rng.randrange(2**32)).random(len(triangles)) < rng.uniform(0.05, 0.3)
        triangles = np.where(chosen[:, None], triangles[:, [0, 2, 1]], triangles)
    return Surface(f"{number} {kind.__name__}", points, triangles, truth, kind not in (cracked, soup))


def write_ply(path, points, triangles):
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("v", "<u4", 3)])
    faces["n"], faces["v"] = 3, triangles
    with open(path, "wb") as f:
        f.write(
            b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
            b"property float z\nelement face %d\nproperty list uchar uint vertex_indices\nend_header\n"
            % (len(points), len(triangles))
        )
        f.write(np.asarray(points, "<f4").tobytes() + faces.tobytes())


def read_ply(path):
    head, body = open(path, "rb").read().split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    columns = head.split(b"element face")[0].count(b"property float")
    points = np.frombuffer(body, "<f4", counts[0] * columns).reshape(-1, columns)[:, :3].astype(float)
    faces = np.frombuffer(body, [("n", "u1"), ("v", "<u4", 3)], counts[1], counts[0] * columns * 4)
    return points, faces["v"].astype(np.int64)


def read_tets(base):
    """TetGen's .node and .ele."""
    rows = lambda path: np.fromstring(
        "\n".join(line for line in open(path) if line.strip() and line[0] != "#").split("\n", 1)[1], sep=" "
    )
    first = lambda path: [x for x in next(l for l in open(path) if l[0] != "#").split()]
    points = rows(base + ".node").reshape(int(first(base + ".node")[0]), -1)
    tets = rows(base + ".ele").reshape(int(first(base + ".ele")[0]), -1)
    return points[:, 1:4], tets[:, 1:5].astype(np.int64) - int(points[0, 0])


def write_tets(base, points, tets):
    with open(base + ".node", "w") as f:
        f.write(f"{len(points)} 3 0 0\n" + "".join("%d %.9g %.9g %.9g\n" % (i, *p) for i, p in enumerate(points)))
    with open(base + ".ele", "w") as f:
        f.write(f"{len(tets)} 4 0\n" + "".join("%d %d %d %d %d\n" % (i, *t) for i, t in enumerate(tets)))

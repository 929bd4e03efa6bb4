"""Solids of tetrahedra for load_cases.py: lattices of cells, five tetrahedra each, bent into shapes; written as .vtu, .obj and .inp."""

import math, struct

# Of a cell whose corners are numbered by bits x, y, z; neighbours are mirrored, so that their faces fit.
SPLITS = (
    ((0, 3, 5, 6), (1, 0, 3, 5), (2, 3, 0, 6), (4, 5, 6, 0), (7, 6, 5, 3)),
    ((1, 2, 4, 7), (0, 1, 2, 4), (3, 2, 1, 7), (5, 4, 7, 1), (6, 7, 4, 2)),
)
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))  # of C3D10
FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))  # P1 to P4


def minus(a, b):
    return tuple(x - y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def middle(points):
    return tuple(sum(p[a] for p in points) / len(points) for a in range(3))


def single(x):
    """As coordinates of a mesh are kept."""
    return struct.unpack("f", struct.pack("f", x))[0]


class Solid:
    """Points in mm and tetrahedra; `unit`: where each point lies in the unit cube that the shape was bent from."""

    def __init__(self, cells, bend, keep=lambda u: True):
        self.points, self.unit, self.tets, index = [], [], [], {}

        def point(*ijk):
            if ijk not in index:
                index[ijk] = len(self.points)
                u = tuple(i / n for i, n in zip(ijk, cells))
                self.unit.append(u)
                self.points.append(tuple(single(x) for x in bend(u)))
            return index[ijk]

        for k in range(cells[2]):
            for j in range(cells[1]):
                for i in range(cells[0]):
                    if not keep(tuple((x + 0.5) / n for x, n in zip((i, j, k), cells))):
                        continue
                    for split in SPLITS[(i + j + k) & 1]:
                        t = [point(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) for c in split]
                        if self.six_volumes(t) < 0:
                            t[2], t[3] = t[3], t[2]
                        self.tets.append(tuple(t))

    def six_volumes(self, t):
        a, b, c, d = (self.points[p] for p in t)
        return dot(cross(minus(b, a), minus(c, a)), minus(d, a))

    def box(self):
        return tuple(min(p[a] for p in self.points) for a in range(3)), tuple(
            max(p[a] for p in self.points) for a in range(3)
        )

    def boundary(self):
        """(tetrahedron, face, corners, seen from outside in one order of turning) of faces that one tetrahedron has."""
        seen = {}
        for e, t in enumerate(self.tets):
            for f, own in enumerate(FACES):
                corners = tuple(t[i] for i in own)
                seen.setdefault(tuple(sorted(corners)), []).append((e, f, corners))
        # Points inwards where corners go 0, 1, 2: the fourth lies on that side.
        return [(e, f, (c[0], c[2], c[1])) for e, f, c in (v[0] for v in seen.values() if len(v) == 1)]

    def write_obj(self, path):
        number, faces = {}, []
        for _, _, corners in self.boundary():
            faces.append([number.setdefault(p, len(number) + 1) for p in corners])
        with open(path, "w") as f:
            for p in number:
                f.write("v %.9g %.9g %.9g\n" % self.points[p])
            for t in faces:
                f.write("f %d %d %d\n" % tuple(t))

    def write_vtu(self, path):
        with open(path, "w") as f:
            f.write('<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>\n')
            f.write(f'<Piece NumberOfPoints="{len(self.points)}" NumberOfCells="{len(self.tets)}"><Points>\n')
            f.write('<DataArray type="Float32" NumberOfComponents="3" format="ascii">\n')
            f.writelines("%.9g %.9g %.9g\n" % p for p in self.points)
            f.write('</DataArray></Points><Cells><DataArray type="Int64" Name="connectivity" format="ascii">\n')
            f.writelines("%d %d %d %d\n" % t for t in self.tets)
            f.write('</DataArray><DataArray type="Int64" Name="offsets" format="ascii">\n')
            f.writelines(f"{4 * e + 4}\n" for e in range(len(self.tets)))
            f.write('</DataArray><DataArray type="UInt8" Name="types" format="ascii">\n')
            f.write("10\n" * len(self.tets))
            f.write("</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>\n")


class Deck:
    """A mesh as an input file of CalculiX: labels in any order, with gaps; of C3D10 with nodes in the middle of edges."""

    def __init__(self, solid, quadratic, rng=None):
        self.solid, self.places, self.elements = solid, list(solid.points), []
        self.middle = {}
        for t in solid.tets:
            nodes = list(t)
            for a, b in EDGES if quadratic else ():
                key = (min(t[a], t[b]), max(t[a], t[b]))
                if key not in self.middle:
                    self.middle[key] = len(self.places)
                    self.places.append(middle([solid.points[t[a]], solid.points[t[b]]]))
                nodes.append(self.middle[key])
            self.elements.append(nodes)
        labels = list(range(1, len(self.places) + 1))
        if rng is not None:
            labels = rng.sample(range(1, 3 * len(self.places)), len(self.places))
        self.label = labels
        kind = "C3D10" if quadratic else "C3D4"
        order = sorted(range(len(labels)), key=lambda n: labels[n] if rng is None else rng.random())
        self.text = "*HEADING\nmade from a seed\n*NODE, NSET=NALL\n"
        for n in order:
            self.text += "%d, %.12g, %.12g, %.12g\n" % (labels[n], *self.places[n])
        self.text += f"*ELEMENT, TYPE={kind}, ELSET=EALL\n"
        for e, nodes in enumerate(self.elements):
            self.text += ", ".join(str(x) for x in [e + 1] + [labels[n] for n in nodes]) + "\n"

    def rows(self, numbers):
        numbers = list(numbers)
        return "".join(", ".join(map(str, numbers[i : i + 10])) + "\n" for i in range(0, len(numbers), 10))

    def nodes_of_faces(self, faces):
        """As a program marks a surface: corners, and the middles of edges of its triangles, of no others."""
        nodes = set()
        for _, _, c in faces:
            nodes.update(c)
            for i in range(3):
                key = (min(c[i], c[(i + 1) % 3]), max(c[i], c[(i + 1) % 3]))
                if key in self.middle:
                    nodes.add(self.middle[key])
        return sorted(nodes)


# -- Shapes: of extent about 1, lengthwise in x, their first end at x = 0. `n`: cells along.


def brick(rng, n):
    a, b, c = (rng.uniform(0.4, 1) for _ in range(3))
    shake = lambda u: (a * u[0], b * u[1], c * u[2])
    return Solid((n, max(2, n - 1), max(2, n - 2)), shake)


def bar(rng, n):
    """Bent and twisted, of a cross-section that changes."""
    w, h, turn, arc, taper = (
        rng.uniform(0.12, 0.25),
        rng.uniform(0.12, 0.25),
        rng.uniform(-0.8, 0.8),
        rng.uniform(-0.6, 0.6),
        rng.uniform(0.7, 1),
    )

    def bend(u):
        size = 1 + (taper - 1) * u[0]
        y, z = w * size * (u[1] - 0.5), h * size * (u[2] - 0.5)
        c, s = math.cos(turn * u[0]), math.sin(turn * u[0])
        return (u[0], c * y - s * z + arc * u[0] ** 2, s * y + c * z)

    return Solid((2 * n, 2, 2), bend)


def tube(rng, n):
    """Half of one along x, or a quarter."""
    inner, wide = rng.uniform(0.15, 0.3), math.pi * rng.choice((0.5, 1))

    def bend(u):
        r, a = inner + (0.45 - inner) * u[2], wide * u[1]
        return (u[0], r * math.cos(a), r * math.sin(a))

    return Solid((n, n + 1, 2), bend)


def ball(rng, n):
    """A cube whose shells are made round."""
    half = rng.uniform(0.4, 0.5)
    n += n % 2

    def bend(u):
        v = [2 * x - 1 for x in u]
        far, size = max(abs(x) for x in v), math.sqrt(dot(v, v))
        round_ = far / size if size > 0 else 0
        return tuple(half * (1 + x * (0.35 + 0.65 * round_) / 1.0) for x in v)

    return Solid((n, n, n), bend)


def ell(rng, n):
    a, b = rng.uniform(0.3, 0.6), rng.uniform(0.3, 0.6)
    n = max(n, 4)
    return Solid((n, n, 2), lambda u: (u[0], u[1], 0.3 * u[2]), lambda u: u[0] < a or u[1] < b)


def notched(rng, n):
    """A plate with a slit from one side, or a hole."""
    n = max(n, 4)
    deep, hole = rng.uniform(0.3, 0.6), rng.random() < 0.5

    def keep(u):
        if hole:
            return not (abs(u[0] - 0.5) < 0.2 and abs(u[1] - 0.5) < 0.2)
        return not (abs(u[0] - 0.5) < 0.7 / n and u[1] > 1 - deep)

    return Solid((n + n % 2, n, 1 + n // 5), lambda u: (u[0], 0.7 * u[1], 0.15 * u[2]), keep)


SHAPES = (brick, bar, tube, ball, ell, notched)


def shaped(kind, rng, n, scale, shift):
    """A shape in mm; points inside are moved a little, so that no two tetrahedra are alike."""
    solid = kind(rng, n)
    outer = {p for _, _, c in solid.boundary() for p in c}
    solid.points = [
        tuple(
            single(scale * (x + (0 if p in outer else rng.uniform(-0.06, 0.06) / n)) + shift[a])
            for a, x in enumerate(q)
        )
        for p, q in enumerate(solid.points)
    ]
    return solid

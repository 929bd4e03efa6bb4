#!/usr/bin/env python3
"""Load cases that nobody tuned, made from a seed, through osteo fem and CalculiX (ccx); besides, closed forms, and what
must be refused.

usage: load_cases.py OSTEO [--count 50] [--seed 1] [--first 0] [--table] [--forms all,short,none] [--mutate]

Case i of a seed is always the same: a solid (brick, bent bar, tube, ball, L, notched plate) of 0.001 to 1000 mm and
1 kPa to 20 GPa, Poisson's ratio up to 0.499, meshed by a lattice or by a method of tetrahedralize, one or two
materials, a kind of holding, a kind of load, a law that both programs have (linear, stvk: NLGEOM, neo_hooke_split: NEO
HOOKE) and linear or quadratic elements. Problems are JSON, or an input file as other programs write them (labels with
gaps, sets, pressures on faces, GRAV), which both programs read. Asked is that
 - the displacements of all nodes are those of CalculiX, to LIMITS of the largest; so is what holds the body, of the sum
   of what holds its nodes;
 - fem reads what --inp-out wrote and finds the same, to 1e-7; of contact pairs it says that it does not read them;
 - contact against a plane, which CalculiX spreads over faces and fem of t4 over points, agrees to CONTACT_LIMITS, what it
   pushes with to PUSH_LIMIT;
 - closed forms are met and nonsense is refused, as load_case_forms.py lists.
A load that a solution cannot be found for by either program is halved, at most five times; --table says how often. With
--mutate CalculiX gets loads that are 1 % larger, and the run passes when each case is found to differ: that the
comparison sees a hundredth. Exit code 0 when all is right, 1 when something is not, 77 (skipped) where no case was
compared: without ccx closed forms are tried still, and 1 goes before 77.
"""

import argparse, json, math, os, random, re, shutil, subprocess, sys, tempfile

import load_case_forms
from load_case_solids import SHAPES, Deck, dot, middle, minus, shaped

LAWS = ("linear", "stvk", "neo_hooke_split")
ORDERS = ("t4", "t10")
LIMITS = {"linear": 2e-6, "stvk": 2e-6, "neo_hooke_split": 2e-6}
# By points and by faces: of displacements (worst at single corners), and of what the plane pushes with.
CONTACT_LIMITS = {"t4": 0.02, "t10": 0.01}
PUSH_LIMIT = 0.005
REACTION_LIMIT = 1e-6
LOOP_LIMIT = 1e-7
KINDS = ("pressure", "moved", "gravity", "contact", "force", "traction", "volume", "slid", "mixed")
MESHES = ("vtu", "deck", "grid-conforming", "inp", "deck", "grid", "tetgen", "cgal", "graded", "deck")
# CalculiX stops at half a percent of the residual by itself; whatever is asked, it stops where forces are below 1e-8,
# and it takes a D1 below 1e-10 for none. It gets each body as one of about SIZE_MM and 1 MPa.
SIZE_MM = 1000
CONTROLS = "*CONTROLS, PARAMETERS=FIELD\n1e-6, 1e-6, , , 1e-6\n"


class Refused(Exception):
    def __init__(self, code, said):
        super().__init__(f"exit code {code}: {said.strip()}")
        self.code, self.said = code, said

    def too_much(self):
        """That there is no solution, or one that is inside out."""
        return self.code == 7 and ("rest" in self.said or "inside out" in self.said)


class Program:
    def __init__(self, osteo, work):
        self.osteo, self.work = osteo, work

    def run(self, *words):
        r = subprocess.run(
            [self.osteo, *map(str, words), "--json", "--force"], capture_output=True, text=True, cwd=self.work
        )
        if r.returncode != 0:
            raise Refused(r.returncode, r.stderr)
        return json.loads(r.stdout)["stages"][0]["report"]

    def fem(self, mesh, problem, *words):
        """Report and displacements of all nodes."""
        self.run("fem", mesh, problem, "out.vtu", "--report-out", "report.json", "--nodes-out", "nodes.vtu", *words)
        with open(f"{self.work}/report.json") as f:
            report = json.load(f)
        return report, displacements(f"{self.work}/nodes.vtu")

    def linear_mm(self, mesh, problem):
        """The largest displacement by the linear law; a mesh so deformed may be inside out, and is not written."""
        report, _ = self.fem(mesh, problem, "--law", "linear")
        return report["displacement"]["largest_mm"]

    def calculix(self, text, long, stiff):
        """Displacements and forces (N) by label of the last increment; None where it did not get to the end."""
        with open(f"{self.work}/job.inp", "w") as f:
            f.write(in_units(text, long, stiff))
        for name in ("job.dat", "job.frd"):
            if os.path.exists(f"{self.work}/{name}"):
                os.remove(f"{self.work}/{name}")
        env = dict(os.environ, OMP_NUM_THREADS="1")
        try:
            r = subprocess.run(["ccx", "job"], cwd=self.work, env=env, capture_output=True, text=True, timeout=300)
        except subprocess.TimeoutExpired:
            return None
        if r.returncode != 0 or not os.path.exists(f"{self.work}/job.dat"):
            return None
        found, now, at = {}, None, 0.0
        for line in open(f"{self.work}/job.dat"):
            if "for set" in line:
                words = line.split()
                now, at = found.setdefault((words[0], words[words.index("set") + 1]), {}), float(words[-1])
                now.clear()
            else:
                fields = line.split()
                if now is not None and len(fields) == 4:
                    now[int(fields[0])] = tuple(float(x) for x in fields[1:])
        for (what, _), rows in found.items():
            by = 1 / long if what == "displacements" else 1 / (stiff * long**2)
            for label in rows:
                rows[label] = tuple(x * by for x in rows[label])
        return found if at == 1.0 else None


def displacements(path):
    text = open(path).read()
    at = text.index("<DataArray", text.index("<PointData"))
    values = text[text.index(">", at) + 1 : text.index("</DataArray>", at)].split()
    return [tuple(float(x) for x in values[i : i + 3]) for i in range(0, len(values), 3)]


def size(v):
    return math.sqrt(dot(v, v))


def log_uniform(rng, lo, hi):
    return 10 ** rng.uniform(math.log10(lo), math.log10(hi))


def direction(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    return tuple(x / size(v) for x in v)


def cards(text):
    """(name, options, rows) of an input file."""
    found = []
    for line in text.splitlines():
        if line.startswith("*") and not line.startswith("**"):
            name, *options = [w.strip().upper() for w in line[1:].split(",")]
            found.append((name, options, []))
        elif found and not line.startswith("**"):
            found[-1][2].append([w.strip() for w in line.split(",")])
    return found


def held_and_pushed(text):
    """Held (label, axis) and the force at each, of a file that fem wrote."""
    held, pushed = set(), {}
    for name, _, rows in cards(text):
        for row in rows if name == "BOUNDARY" and rows else ():
            if row[0].isdigit():
                first = int(row[1])
                held.update((int(row[0]), a) for a in range(first, int(row[2] if len(row) > 2 else first) + 1))
        for row in rows if name == "CLOAD" else ():
            key = (int(row[0]), int(row[1]))
            pushed[key] = pushed.get(key, 0) + float(row[2])
    return held, pushed


def mutated(text):
    """All loads of the step 1 % larger."""
    out, card = [], ""
    in_step = False
    for line in text.splitlines():
        if line.startswith("*"):
            card = line[1:].split(",")[0].strip()
            in_step = in_step or card == "STEP"
        elif in_step and card in ("CLOAD", "DLOAD", "BOUNDARY"):
            fields = line.split(",")
            at = 2 if card != "BOUNDARY" else 3
            if len(fields) > at:
                fields[at] = " %.12g" % (1.01 * float(fields[at]))
            line = ",".join(fields)
        out.append(line)
    return "\n".join(out) + "\n"


def in_units(text, long, stiff):
    """The same body `long` times as large and `stiff` times as stiff, under loads that strain it as much."""
    # By card: field and factor.
    factor = {
        "NODE": [(1, long), (2, long), (3, long)],
        "BOUNDARY": [(3, long)],
        "ELASTIC": [(0, stiff)],
        "HYPERELASTIC": [(0, stiff), (1, 1 / stiff)],
        "DENSITY": [(0, stiff / long)],
        "CLOAD": [(2, stiff * long**2)],
        "DLOAD": [(2, stiff)],
        "SURFACE BEHAVIOR": [(0, stiff / long)],
    }
    out, card = [], ""
    for line in text.splitlines():
        if line.startswith("*"):
            card = line[1:].split(",")[0].strip()
        elif card in factor:
            f = line.split(",")
            for at, by in factor[card]:
                if at < len(f) and "GRAV" not in line:
                    f[at] = " %.12g" % (float(f[at]) * by)
            line = ",".join(f)
        out.append(line)
    return "\n".join(out) + "\n"


class Case:
    def __init__(self, seed, number):
        self.rng = rng = random.Random(f"{seed} {number}")
        # Each law and order meets each kind of load in 54 cases.
        self.law, self.order = LAWS[number % 3], ORDERS[(number + number // 9) // 3 % 2]
        self.kind = KINDS[(number + number // 9) % len(KINDS)]
        self.mesh = MESHES[number % len(MESHES)]
        if self.kind == "contact" and self.mesh not in ("vtu", "inp"):
            self.mesh = "vtu"
        flat = self.kind == "contact"
        shape = rng.choice([s for s in SHAPES if not flat or s.__name__ in ("brick", "ell", "notched")])
        self.scale = log_uniform(rng, 1e-3, 1e3)
        self.young_kpa = log_uniform(rng, 1, 2e7)
        self.units = SIZE_MM / self.scale, 1000 / self.young_kpa
        self.poisson = rng.choice((0.0, 0.3, 0.45, 0.49, 0.499, rng.uniform(-0.3, 0.45)))
        self.second = (
            (self.young_kpa * log_uniform(rng, 0.01, 100), rng.uniform(0, 0.49)) if rng.random() < 0.5 else None
        )
        self.density = rng.uniform(500, 5000)
        shift = [self.scale * rng.uniform(-2, 2) for _ in range(3)]
        cells = rng.randint(3, 5) if self.order == "t4" else rng.randint(2, 4)
        self.solid = shaped(shape, rng, cells, self.scale, shift)
        self.curved = shape.__name__ == "ball"
        self.name = f"{number} {shape.__name__} {self.mesh}, {self.kind}, {self.law} {self.order}"
        # How far it is to move at most, of its length.
        self.aim = log_uniform(rng, 1e-4, 0.1) if self.law == "linear" else rng.uniform(0.03, 0.25)
        self.halved = 0
        self.small_increments = False

    # -- As JSON.

    def slab(self, axis, share, far=False):
        lo, hi = (list(x) for x in self.solid.box())
        long = [h - l for l, h in zip(lo, hi)]
        out_lo, out_hi = [l - s for l, s in zip(lo, long)], [h + s for h, s in zip(hi, long)]
        if far:
            out_lo[axis] = hi[axis] - share * long[axis]
        else:
            out_hi[axis] = lo[axis] + share * long[axis]
        return {"box_mm": [out_lo, out_hi]}

    def problem(self):
        rng = self.rng
        lattice = self.mesh in ("vtu", "inp")
        thick = rng.uniform(0.15, 0.3)
        end = 1e-3 if lattice and not self.curved and rng.random() < 0.7 else thick
        material = {"young_kpa": self.young_kpa, "poisson": self.poisson, "density_kg_m3": self.density}
        p = {"osteotome_tissue": 1, "law": self.law, "order": self.order, "material": material}
        if self.second:
            p["regions"] = [dict(self.slab(1, 0.5), young_kpa=self.second[0], poisson=self.second[1])]
        if self.kind == "slid" or rng.random() < 0.25:
            p["fixed"] = [
                dict(self.slab(a, thick if self.curved or not lattice else 1e-3), axes="xyz"[a]) for a in range(3)
            ]
        else:
            p["fixed"] = [self.slab(0, end)]
        self.load = load = {"name": "made"}
        place = rng.choice((self.slab(0, thick, True), self.slab(2, 0.5, True), self.slab(0, 0.5, True)))
        along = direction(rng)
        kinds = [self.kind] if self.kind != "mixed" else ["pressure", "volume", "gravity"]
        for kind in kinds:
            if kind == "pressure":
                load["surfaces"] = [dict(place, kpa=rng.choice((-1, 1)) * self.young_kpa * 1e-5)]
            if kind == "traction":
                load["surfaces"] = [dict(place, kpa=[self.young_kpa * 1e-5 * x for x in along])]
            newton = self.young_kpa / 1000 * self.scale**2 * 1e-6
            if kind == "force":
                load["forces"] = [dict(place, total_n=[newton * x for x in along])]
            if kind == "volume":
                load["volumes"] = [dict(place, total_n=[newton * x for x in along])]
            if kind == "gravity":
                pull = min(1e3, self.young_kpa * 1e3 / (self.density * self.scale * 1e-3) * 1e-5)
                load["gravity_m_s2"] = [pull * x for x in along]
            if kind in ("moved", "slid"):
                axes = "xyz" if kind == "moved" else "x"
                by = [self.aim * self.scale * x if "xyz"[a] in axes else 0 for a, x in enumerate(along)]
                load["moved"] = [dict(self.slab(0, end, True), by_mm=by, axes=axes)]
            if kind == "contact":
                lo, hi = self.solid.box()
                deep = min(self.aim, 0.05) * self.scale
                edge = self.scale / 5
                stiff = self.young_kpa / 1000 * edge * 1e4
                normal = [-1, rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05)]
                at = [hi[0] - deep] + [(l + h) / 2 for l, h in zip(lo[1:], hi[1:])]
                load["contacts"] = [{"at_mm": at, "normal": normal, "stiffness_n_per_mm": stiff}]
        p["loads"] = [load]
        return p

    def scaled(self, by):
        """The load, as large; movements are so from the first."""
        load = self.load
        for s in load.get("surfaces", []):
            s["kpa"] = [x * by for x in s["kpa"]] if isinstance(s["kpa"], list) else s["kpa"] * by
        for kind in ("forces", "volumes"):
            for f in load.get(kind, []):
                f["total_n"] = [x * by for x in f["total_n"]]
        if "gravity_m_s2" in load:
            load["gravity_m_s2"] = [x * by for x in load["gravity_m_s2"]]

    def most(self):
        """How much larger the load may become within the format's limits."""
        load, room = self.load, [1e300]
        for s in load.get("surfaces", []):
            room.append(1e6 / max(abs(x) for x in (s["kpa"] if isinstance(s["kpa"], list) else [s["kpa"]])))
        for kind in ("forces", "volumes"):
            room += [1e6 / max(abs(x) for x in f["total_n"]) for f in load.get(kind, [])]
        if "gravity_m_s2" in load:
            room.append(1e4 / max(abs(x) for x in load["gravity_m_s2"]))
        return min(room) * 0.99

    def compared(self, program, text, report, ours):
        """What CalculiX found, or None, and how far it is off."""
        for increments in ("1, 1", "0.05, 1, 1e-6, 0.05"):
            found = program.calculix(text.replace("*STATIC\n1, 1\n", f"*STATIC\n{increments}\n"), *self.units)
            if found is None:
                continue
            # What fem wrote it numbered as its own nodes.
            own = found.get(("displacements", "ALL"))
            labels = range(1, len(ours) + 1) if own else labels_as_read(text)
            apart = off(ours, [(own or found["displacements", "NALL"])[n] for n in labels])
            # Beyond a bifurcation one large increment stays on the path that is unstable; fem, which had to shift its
            # Hessian, goes on to where the energy is less.
            self.small_increments = increments != "1, 1"
            if apart < 0.01 or report["factorisations_shifted"] == 0:
                return found, apart
        return None, None

    def halve(self):
        self.halved += 1
        if self.halved > 5:
            raise Refused(0, "no load is small enough")
        if self.mesh == "deck":
            return
        self.scaled(0.5)
        for m in self.load.get("moved", []):
            m["by_mm"] = [x / 2 for x in m["by_mm"]]

    def write_mesh(self, program):
        work, rng = program.work, self.rng
        if self.mesh == "vtu":
            self.solid.write_vtu(f"{work}/mesh.vtu")
            return "mesh.vtu"
        if self.mesh == "inp":
            with open(f"{work}/mesh.inp", "w") as f:
                f.write(Deck(self.solid, rng.random() < 0.5).text)
            return "mesh.inp"
        self.solid.write_obj(f"{work}/solid.obj")
        for resolution in (8, 6, 5, 4, 3):
            words = ["--method", self.mesh, "--resolution", resolution]
            if self.mesh == "graded":
                words += ["--levels", 1]
            if self.mesh == "grid-conforming":
                words += ["--no-keep-thin"]
            if program.run("tetrahedralize", "solid.obj", "mesh.vtu", *words)["tets"] < (
                400 if self.order == "t10" else 1500
            ):
                break
        return "mesh.vtu"

    # -- As an input file of others.

    def deck(self):
        rng = self.rng
        solid = self.solid
        d = Deck(solid, self.order == "t10", random.Random(rng.random()))
        skin = solid.boundary()

        def side(axis, value):
            return [f for f in skin if all(solid.unit[p][axis] == value for p in f[2])]

        held = d.nodes_of_faces(side(0, 0) + (side(1, 0) if rng.random() < 0.5 else []))
        label = d.label
        t = "*NSET, NSET=HELD\n" + d.rows(label[n] for n in held)
        low = [e for e, c in enumerate(solid.tets) if middle([solid.unit[p] for p in c])[1] < 0.5]
        high = sorted(set(range(len(solid.tets))) - set(low))
        materials = [(self.young_kpa / 1000, self.poisson)]
        materials.append((self.second[0] / 1000, self.second[1]) if self.second else materials[0])
        for number, (elements, (young, nu)) in enumerate(zip((low, high), materials), 1):
            t += f"*ELSET, ELSET=PART{number}\n" + d.rows(e + 1 for e in elements)
            t += f"*MATERIAL, NAME=STUFF{number}\n"
            if self.law == "neo_hooke_split":
                mu, bulk = young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu))
                t += "*HYPERELASTIC, NEO HOOKE\n%.12g, %.12g\n" % (mu / 2, 2 / bulk)
            else:
                t += "*ELASTIC\n%.12g, %.12g\n" % (young, nu)
            t += "*DENSITY\n%.12g\n*SOLID SECTION, ELSET=PART%d, MATERIAL=STUFF%d\n" % (
                self.density * 1e-12,
                number,
                number,
            )
        t += "*BOUNDARY\nHELD, 1, 3\n"
        if rng.random() < 0.5:
            slide = sorted(set(d.nodes_of_faces(side(2, 0))) - set(held))
            t += "*NSET, NSET=SLIDE\n" + d.rows(label[n] for n in slide)
            t += "*BOUNDARY\nSLIDE, 3\n"
        # Pressures follow the body where its law is not linear, and fem says that it reads none.
        kind = {
            "contact": "force",
            "traction": "pressure",
            "volume": "gravity",
            "mixed": "gravity",
            "slid": "moved",
        }.get(self.kind, self.kind)
        if kind == "pressure" and self.law != "linear":
            kind = "force"
        along = direction(rng)
        end = side(0, 1)
        far = d.nodes_of_faces(end)
        self.deck_step = lambda by: "*STEP%s, INC=1000\n*STATIC\n1, 1\n%s%s*NODE PRINT, NSET=NALL\nU\n*END STEP\n" % (
            "" if self.law == "linear" else ", NLGEOM",
            "" if self.law == "linear" else CONTROLS,
            step(by),
        )

        def step(by):
            if kind == "pressure":
                rows = "".join("%d, P%d, %.12g\n" % (e + 1, f + 1, by * self.young_kpa * 1e-8) for e, f, _ in end)
                return "*DLOAD\n" + rows
            if kind == "gravity":
                pull = by * self.young_kpa * 1e3 / (self.density * self.scale * 1e-3) * 1e-5 * 1000
                return "*DLOAD\nEALL, GRAV, %.12g, %.12g, %.12g, %.12g\n" % (pull, *along)
            if kind == "moved":
                reach = self.aim * self.scale * 0.5**self.halved
                rows = "".join("FAR, %d, %d, %.12g\n" % (a + 1, a + 1, reach * along[a]) for a in range(3))
                return "*BOUNDARY\n" + rows
            each = by * self.young_kpa / 1000 * self.scale**2 * 1e-6 / len(far)
            return "*CLOAD\n" + "".join("FAR, %d, %.12g\n" % (a + 1, each * along[a]) for a in range(3))

        free = set(far) - set(held)
        if kind == "moved" and "SLIDE" in t:
            free -= set(slide)
        t += "*NSET, NSET=FAR\n" + d.rows(label[n] for n in sorted(free))
        self.kind = kind
        self.moves = kind == "moved"
        return d, d.text + t


def labels_as_read(text):
    """Labels in the order of fem's nodes: corners as they stand in the file, then middles as elements name them."""
    nodes, corners, middles = [], set(), {}
    for name, options, rows in cards(text):
        if name == "NODE":
            nodes += [int(r[0]) for r in rows]
        if name == "ELEMENT":
            for r in rows:
                corners.update(int(x) for x in r[1:5])
                middles.update((int(x), None) for x in r[5:])
    return [n for n in nodes if n in corners] + list(middles)


def off(ours, theirs):
    largest = max(size(v) for v in theirs)
    if not largest > 0:
        return math.inf
    return max(size(minus(a, b)) for a, b in zip(ours, theirs)) / largest


def one_case(case, program, args):
    """(nodes, difference of displacements, of reactions, of the loop), or raises."""
    work = program.work
    if case.mesh == "deck":
        d, text = case.deck()
        by = 1.0
        if not case.moves:
            with open(f"{work}/case.inp", "w") as f:
                f.write(text + case.deck_step(1.0))
            by = case.aim * case.scale / program.linear_mm("case.inp", "case.inp")
        while True:
            whole = text + case.deck_step(by * 0.5**case.halved)
            with open(f"{work}/case.inp", "w") as f:
                f.write(whole)
            try:
                report, ours = program.fem("case.inp", "case.inp")
                found, apart = case.compared(program, mutated(whole) if args.mutate else whole, report, ours)
                if found is not None:
                    break
            except Refused as e:
                if not e.too_much():
                    raise
            case.halve()
        assert report["law"] == case.law and report["order"] == case.order, report
        return len(ours), apart, None, None
    mesh = case.write_mesh(program)
    p = case.problem()

    def written():
        with open(f"{work}/problem.json", "w") as f:
            json.dump(p, f, indent=1)

    if not {"moved", "contacts"} & set(case.load):
        written()
        case.scaled(min(case.most(), case.aim * case.scale / program.linear_mm(mesh, "problem.json")))
    while True:
        written()
        try:
            report, ours = program.fem(mesh, "problem.json", "--inp-out", "case.inp")
            whole = open(f"{work}/case.inp").read()
            given = mutated(whole) if args.mutate else whole
            rigid = "*NODE PRINT, NSET=RIGID1\nRF\n" if "contacts" in case.load else ""
            given = given.replace("*NODE PRINT, NSET=ALL\nU\n", "*NODE PRINT, NSET=ALL\nU, RF\n" + rigid)
            if case.law != "linear" or rigid:
                given = re.sub(r"(\n\*STATIC\n1, 1\n)", r"\1" + CONTROLS, given)
            found, apart = case.compared(program, given, report, ours)
            if found is not None:
                break
        except Refused as e:
            if not e.too_much():
                raise
        case.halve()
    held, pushed = held_and_pushed(whole)
    forces = found["forces", "ALL"]
    sum_of, gross = [0.0] * 3, 0.0
    for label, axis in held:
        sum_of[axis - 1] += forces[label][axis - 1] - pushed.get((label, axis), 0)
        gross += abs(forces[label][axis - 1])
    reaction = size(minus(sum_of, report["reaction_n"])) / gross
    loop = None
    if "contacts" in case.load:
        rigid = found["forces", "RIGID1"]
        push = [sum(f[a] for f in rigid.values()) for a in range(3)]
        if size(push) > 0:
            reaction = max(reaction, size(minus(push, report["contact_n"])) / size(push))
        try:
            program.fem("case.inp", "case.inp")
            raise AssertionError("a file with contact pairs was read")
        except Refused as e:
            if "not read" not in e.said:
                raise
    else:
        _, again = program.fem("case.inp", "case.inp")
        loop = off(again, ours)
    return len(ours), apart, reaction, loop


def main():
    args = argparse.ArgumentParser()
    args.add_argument("osteo")
    for name, value in (("--count", 50), ("--seed", 1), ("--first", 0)):
        args.add_argument(name, type=int, default=value)
    args.add_argument("--table", action="store_true")
    args.add_argument("--mutate", action="store_true")
    args.add_argument("--forms", choices=("all", "short", "none"), default="all")
    args = args.parse_args()
    osteo, bad, differences = os.path.abspath(args.osteo), [], {}
    if shutil.which("ccx") is None:
        print("CalculiX (ccx) is not installed: agreement with it not tested", file=sys.stderr)
        args.count = 0
    for number in range(args.first, args.first + args.count):
        case = Case(args.seed, number)
        with tempfile.TemporaryDirectory() as work:
            program = Program(osteo, os.environ.get("LOAD_CASE_WORK", work))
            try:
                nodes, apart, reaction, loop = one_case(case, program, args)
            except (Refused, AssertionError, KeyError) as e:
                bad.append(f"{case.name}: {type(e).__name__} {e}")
                print(bad[-1], flush=True)
                continue
        contact = case.kind == "contact" and case.mesh != "deck"
        limit = CONTACT_LIMITS[case.order] if contact else LIMITS[case.law]
        found = [
            f"{case.name}: {what} {value:.2e} off, {most:g} allowed"
            for what, value, most in (
                ("displacements", apart, limit),
                ("reactions", reaction, PUSH_LIMIT if contact else REACTION_LIMIT),
                ("loop", loop, LOOP_LIMIT),
            )
            if value is not None and not value <= most
        ]
        if args.mutate:
            bad += [] if found else [f"{case.name}: a hundredth more load was not seen"]
        else:
            bad += found
        key = f"contact {case.order}" if contact else f"{case.law} {case.order}"
        differences.setdefault(key, []).append(apart)
        if args.table:
            shown = lambda v: "" if v is None else f"{v:.1e}"
            body = f"{case.scale:.2g} mm, {case.young_kpa:.2g} kPa, nu {case.poisson:.3g}"
            notes = "small increments" if case.small_increments else ""
            print(
                f"| {case.name} | {body} | {nodes} | {shown(apart)} | {shown(reaction)} | {shown(loop)} "
                f"| {case.halved or ''} | {notes} |",
                flush=True,
            )
    if args.table:
        for key, values in sorted(differences.items()):
            values.sort()
            print(f"| {key} | {len(values)} | {values[len(values) // 2]:.1e} | {values[-1]:.1e} |")
    if args.forms != "none":
        with tempfile.TemporaryDirectory() as work:
            bad += load_case_forms.check(Program(osteo, work), args.forms == "all", args.table, Refused)
    if bad:
        print("\n".join(bad), file=sys.stderr)
        return 1
    if not args.count:
        print("no load case was compared" + ("" if args.forms == "none" else "; closed forms are met"), file=sys.stderr)
        return 77
    print("all right", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())

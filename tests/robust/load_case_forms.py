"""Closed forms that osteo fem must meet, and problems that it must refuse with a reason; for load_cases.py.

- Patch test: a brick of irregular tetrahedra whose surface is moved by an affine map of 10 %, all laws and orders: every node follows the map.
- A bar in three planes of symmetry, pulled to 1.5 times its length by a traction: the law's own equations.
- Cook's membrane (23.96): t10 within 0.15 on 12 x 12 cells; linear tetrahedra lock, as known, and are below 23.5.
- Lame's tube, nu 0.4999: RMS displacement within 0.3 % (t10), 0.8 % (t4_mean) on 8 cells through the wall, of second order.
- H. Hertz: a rigid ball pressed into a block 40 times as large as what touches: force and radius of contact.
"""

import json, math, random

from load_case_solids import Deck, Solid, dot, minus, shaped, brick

LAWS = ("linear", "stvk", "neo_hooke", "neo_hooke_split", "corotated")


def solve(program, solid, problem, *words):
    solid.write_vtu(f"{program.work}/form.vtu")
    with open(f"{program.work}/form.json", "w") as f:
        json.dump(dict(problem, osteotome_tissue=1), f)
    return program.fem("form.vtu", "form.json", *words)


def slab(axis, lo, hi):
    box = [[-1e5] * 3, [1e5] * 3]
    box[0][axis], box[1][axis] = lo, hi
    return {"box_mm": box}


def symmetry(*axes):
    return [dict(slab(a, -1e-4, 1e-4), axes="xyz"[a]) for a in axes]


def patch_tests(program, whole):
    """(name, error, bound)"""
    solid = shaped(brick, random.Random(5), 3, 10, (0, 0, 0))
    push = [[0.1, 0.03, -0.02], [0.05, -0.08, 0.04], [0.01, 0.06, 0.07]]
    affine = lambda p: tuple(sum(push[a][b] * p[b] for b in range(3)) for a in range(3))
    for order in ("t4", "t10", "t4_mean"):
        deck = Deck(solid, order == "t10")
        text = (
            deck.text
            + "*MATERIAL, NAME=M\n*ELASTIC\n0.1, 0.4\n*SOLID SECTION, ELSET=EALL, MATERIAL=M\n*STEP\n*STATIC\n*BOUNDARY\n"
        )
        for n in deck.nodes_of_faces(solid.boundary()):
            u = affine(deck.places[n])
            text += "".join("%d, %d, %d, %.17g\n" % (n + 1, a + 1, a + 1, u[a]) for a in range(3))
        with open(f"{program.work}/patch.inp", "w") as f:
            f.write(text + "*END STEP\n")
        for law in LAWS if whole else LAWS[2:4]:
            _, u = program.fem("patch.inp", "patch.inp", "--law", law, "--order", order)
            apart = max(max(abs(x) for x in minus(v, affine(p))) for v, p in zip(u, deck.places))
            yield f"patch test, {law} {order}", apart, 1e-9


def stretched_bars(program, whole):
    solid = Solid((2, 2, 3), lambda u: (2 * u[0], 2 * u[1], 3 * u[2]))
    young, nu, stretch = 100.0, 0.3, 1.5
    strain = (stretch**2 - 1) / 2
    bars = {"linear": (young * 0.5, 1 - nu * 0.5), "stvk": (young * stretch * strain, math.sqrt(1 - 2 * nu * strain))}
    mu, lam = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    lo, hi = 0.5, 1.0  # neo_hooke: mu (s^2 - 1) + lambda ln J = 0 across
    for _ in range(200):
        s = (lo + hi) / 2
        lo, hi = (s, hi) if mu * (s * s - 1) + lam * math.log(s * s * stretch) < 0 else (lo, s)
    bars["neo_hooke"] = ((mu * (stretch**2 - 1) + lam * math.log(s * s * stretch)) / stretch, s)
    for law, (kpa, across) in bars.items():
        for order in ("t4", "t10") if whole else ("t10",):
            load = {"surfaces": [dict(slab(2, 2.99, 3.01), kpa=[0, 0, kpa])]}
            problem = {"material": {"young_kpa": young, "poisson": nu}, "fixed": symmetry(0, 1, 2), "loads": [load]}
            _, u = solve(program, solid, problem, "--law", law, "--order", order, "--load-steps", 4)
            apart = max(
                max(abs(v[0] - (across - 1) * p[0]), abs(v[1] - (across - 1) * p[1]), abs(v[2] - (stretch - 1) * p[2]))
                for v, p in zip(u, solid.points)
            )
            yield f"bar pulled to 1.5, {law} {order}", apart, 1e-7


def membranes(program, whole):
    rise = {}
    for order in ("t4", "t10"):
        solid = Solid((12, 12, 1), lambda u: (48 * u[0], 44 * u[0] + (44 - 28 * u[0]) * u[1], 0.5 * u[2]))
        problem = {
            "material": {"young_kpa": 1000, "poisson": 1 / 3},
            "fixed": [dict(slab(0, -1e-4, 1e-4), axes="xy"), dict(slab(2, -1e-4, 1e-4), axes="z")],
            "loads": [{"surfaces": [dict(slab(0, 47.99, 48.01), kpa=[0, 62.5, 0])]}],
        }
        _, u = solve(program, solid, problem, "--law", "linear", "--order", order)
        rise[order] = u[solid.unit.index((1, 0.5, 0))][1]
    yield f"Cook's membrane, t10: rise {rise['t10']:.3f} for 23.96", abs(rise["t10"] - 23.96), 0.15
    yield f"Cook's membrane, t4 locks: rise {rise['t4']:.3f}", rise["t4"], 23.5


def tubes(program, whole):
    nu, kpa = 0.4999, 10.0
    for order, bound in (("t10", 0.003), ("t4_mean", 0.008)):
        error = []
        for n in (4, 8):

            def bend(u):
                r, a = 1 + u[0], u[1] * math.pi / 2
                return (0 if u[1] == 1 else r * math.cos(a), r * math.sin(a), u[2] / n)

            solid = Solid((n, 2 * n, 1), bend)
            problem = {
                "material": {"young_kpa": 1000, "poisson": nu},
                "fixed": symmetry(0, 1) + [dict(slab(2, -1, 1), axes="z")],
                "loads": [{"surfaces": [{"at_mm": [0, 0, 0], "radius_mm": 1 + 0.8 / (3 * n), "kpa": kpa}]}],
            }
            _, u = solve(program, solid, problem, "--law", "linear", "--order", order)
            wrong = whole_of = 0.0
            for p, v in zip(solid.points, u):
                r = math.hypot(p[0], p[1])
                out = (1 + nu) * kpa / 1000 / 3 * ((1 - 2 * nu) * r + 4 / r)
                wrong += sum((v[a] - p[a] / r * out) ** 2 for a in range(2)) + v[2] ** 2
                whole_of += out**2
            error.append(math.sqrt(wrong / whole_of))
        yield f"Lame's tube, nu 0.4999, {order}: {100 * error[0]:.2f} %, halved", error[1], bound
        yield f"Lame's tube, {order}, error halved over error", error[1] / error[0], 0.3


def hertz(program, whole):
    """A rigid ball of 10 mm, pressed 0.1 mm into a block: a = sqrt(R d), F = 4/3 E / (1 - nu^2) sqrt(R d^3)."""
    radius, deep, young, nu = 10.0, 0.1, 1000.0, 0.3
    touch, force = math.sqrt(radius * deep), 4 / 3 * young / 1000 / (1 - nu * nu) * math.sqrt(radius * deep**3)
    for n, first, bounds in ((12, 0.2, (0.05, 0.15)),) if whole else ((8, 0.35, (0.1, 0)),):
        lo, hi = 1.0, 4.0  # cells grow by so much, to 40 mm
        for _ in range(100):
            q = (lo + hi) / 2
            lo, hi = (q, hi) if first * (q**n - 1) / (q - 1) < 40 else (lo, q)
        at = lambda x: first * (q ** (n * x) - 1) / (q - 1)
        solid = Solid((n, n, n), lambda u: (at(u[0]), at(u[1]), -at(u[2])))
        stiff = 1000 * young / 1000 * first
        problem = {
            "material": {"young_kpa": young, "poisson": nu},
            "fixed": symmetry(0, 1) + [slab(2, -41, -39.9)],
            "loads": [
                {"contacts": [{"at_mm": [0, 0, radius - deep], "radius_mm": radius, "stiffness_n_per_mm": stiff}]}
            ],
        }
        report, u = solve(program, solid, problem, "--law", "linear", "--order", "t10")
        # A quarter of it, whose planes of symmetry halve what points in them push.
        mine = [(p, [p[a] + v[a] for a in range(3)]) for p, v in zip(solid.points, u) if p[2] == 0]
        # Faces are pushed in places of their own, between which a corner may lie outside by what they give way.
        reach = (radius + 1e-3) ** 2
        from_middle = lambda x: minus(x, (0, 0, radius - deep))
        far = max(math.hypot(p[0], p[1]) for p, x in mine if dot(from_middle(x), from_middle(x)) < reach)
        yield f"Hertz, force {-4 * report['contact_n'][2]:.4f} N for {force:.4f} N", abs(
            -4 * report["contact_n"][2] / force - 1
        ), bounds[0]
        # Cells as coarse as the short one's tell no radius.
        if whole:
            yield f"Hertz, radius {far:.3f} mm for {touch:.3f} mm", abs(far / touch - 1), bounds[1]


# What must not be solved: (what, change of the problem, exit code, what is said).
def refusals():
    bad = lambda **changes: lambda p: p.update(changes)
    load = lambda **kinds: lambda p: p.update(loads=[kinds])
    material = lambda **m: lambda p: p["material"].update(m)
    end, nowhere = slab(0, 9.9, 10.1), slab(0, 99, 100)
    yield "nothing holds it", bad(fixed=[]), 2, "can move freely"
    yield "one point holds it", bad(fixed=[{"box_mm": [[-1, -1, -1], [0.1, 0.1, 0.1]]}]), 2, "can move freely"
    yield "one edge holds it", bad(fixed=[{"box_mm": [[-1, -1, -1], [0.1, 0.1, 99]]}]), 2, "can move freely"
    yield "one plane holds it", bad(fixed=[dict(slab(0, -1, 0.1), axes="x")]), 2, "can move freely"
    yield "held where it is not", bad(fixed=[nowhere]), 2, "no point lies in it"
    yield "contact alone", lambda p: p.update(
        fixed=[], loads=[{"contacts": [{"at_mm": [0, 0, 0], "normal": [0, 0, 1], "stiffness_n_per_mm": 1}]}]
    ), 2, "can move freely"
    for nu in (-1, -5, 0.5, 0.4999999, 0.7):
        yield f"nu {nu}", material(poisson=nu), 2, "Poisson's ratio"
    for young in (0, -3, 1e10):
        yield f"modulus {young}", material(young_kpa=young), 2, "young_kpa"
    yield "a region of no modulus", bad(regions=[dict(end, young_kpa=0, poisson=0.3)]), 2, "young_kpa"
    yield "a region that is not there", bad(
        regions=[dict(nowhere, young_kpa=1, poisson=0.3)]
    ), 2, "no tetrahedron lies in it"
    yield "a force on nothing", load(forces=[dict(nowhere, total_n=[1, 0, 0])]), 2, "no point that can move"
    yield "a force on what is fixed", load(
        forces=[dict(slab(0, -1, 0.1), total_n=[1, 0, 0])]
    ), 2, "no point that can move"
    yield "a pressure on nothing", load(surfaces=[dict(nowhere, kpa=1)]), 2, "no part of the body's surface"
    yield "a pressure inside", load(
        surfaces=[{"at_mm": [5, 5, 5], "radius_mm": 1, "kpa": 1}]
    ), 2, "no part of the body's surface"
    yield "a body force on nothing", load(volumes=[dict(nowhere, total_n=[1, 0, 0])]), 2, "no tetrahedron lies in it"
    yield "a movement of nothing", load(moved=[dict(nowhere, by_mm=[1, 0, 0])]), 2, "no point lies in it"
    yield "what is fixed moved", load(moved=[dict(slab(0, -1, 0.1), by_mm=[1, 0, 0])]), 2, "is to move and is fixed"
    yield "gravity without density", load(gravity_m_s2=[0, 0, -9.81]), 2, "density_kg_m3"
    yield "contact without stiffness", load(
        contacts=[{"at_mm": [0, 0, 0], "normal": [0, 0, 1], "stiffness_n_per_mm": 0}]
    ), 2, "stiffness_n_per_mm"
    yield "a load of nothing", load(name="x"), 2, "it has none of"
    yield "no load", bad(loads=[]), 2, "there is none"
    yield "a force of a giant", load(forces=[dict(end, total_n=[1e7, 0, 0])]), 2, "total_n"
    yield "pushed through itself", lambda p: p.update(
        law="neo_hooke", loads=[{"moved": [dict(end, by_mm=[-30, 0, 0])]}]
    ), 7, "inside out"


INP = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4, ELSET=E
1, 1, 2, 3, 4
*MATERIAL, NAME=M
*ELASTIC
1, 0.3
*SOLID SECTION, ELSET=E, MATERIAL=M
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
*STEP
*STATIC
*CLOAD
4, 1, 0.01
*END STEP
"""


def refusals_of_inp():
    """(what, from, to, exit code, what is said)"""
    yield "nothing holds it", "*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 1, 3\n", "", 2, "can move freely"
    yield "nu 0.5", "1, 0.3", "1, 0.5", 2, "Poisson's ratio"
    yield "nu -1", "1, 0.3", "1, -1", 2, "Poisson's ratio"
    yield "no modulus", "1, 0.3", "0, 0.3", 2, "there is no elastic *MATERIAL"
    yield "a law that is not known", "*ELASTIC\n1, 0.3", "*HYPERELASTIC, OGDEN\n1, 2, 3", 2, "NEO HOOKE"
    yield "no change of volume", "*ELASTIC\n1, 0.3", "*HYPERELASTIC, NEO HOOKE\n1, 0", 2, "D1"
    yield "a force on no node", "4, 1, 0.01", "9, 1, 0.01", 2, "no element has node 9"
    yield "a force along no axis", "4, 1, 0.01", "4, 4, 0.01", 2, "axes go from 1 to 3"
    yield "a pressure on no face", "*CLOAD\n4, 1, 0.01", "*DLOAD\n1, P5, 0.01", 2, "P1 to P4"
    yield "a force that turns", "*CLOAD\n", "*CLOAD, FOLLOWER\n", 2, "might change the answer"
    yield "a pressure that follows", "*STEP\n*STATIC\n*CLOAD\n4, 1, 0.01", "*STEP, NLGEOM\n*STATIC\n*DLOAD\n1, P2, 0.01", 2, "follow the body"
    yield "gravity of no density", "*CLOAD\n4, 1, 0.01", "*DLOAD\nE, GRAV, 9810, 0, 0, -1", 2, "*DENSITY"
    yield "gravity of no direction", "*CLOAD\n4, 1, 0.01", "*DLOAD\nE, GRAV, 9810, 0, 0, 0", 2, "no direction"
    yield "steps of two laws", "*END STEP\n", "*END STEP\n*STEP, NLGEOM\n*STATIC\n*END STEP\n", 2, "different laws"
    yield "a tetrahedron without volume", "4, 0, 0, 1", "4, 1, 1, 0", 4, "no volume"


def check(program, whole, table, refused):
    bad = []
    for form in (patch_tests, stretched_bars, membranes, tubes, hertz):
        try:
            for name, value, bound in form(program, whole):
                if table:
                    print(f"| {name} | {value:.2e} | {bound:g} |", flush=True)
                if not value <= bound:
                    bad.append(f"{name}: {value:g}, {bound:g} allowed")
        except refused as e:
            bad.append(f"{form.__name__}: {e}")
    solid = Solid((2, 2, 2), lambda u: tuple(10 * x for x in u))
    count = 0

    def refuse(name, code, said, solving):
        nonlocal count
        count += 1
        try:
            solving()
            bad.append(f"{name}: was solved")
        except refused as e:
            if e.code != code or said not in e.said:
                bad.append(f"{name}: {e}; {code} and '{said}' expected")

    for name, change, code, said in refusals():
        p = {
            "material": {"young_kpa": 100, "poisson": 0.3},
            "fixed": [slab(0, -1, 0.1)],
            "loads": [{"forces": [dict(slab(0, 9.9, 10.1), total_n=[0, 0, 0.01])]}],
        }
        change(p)
        refuse(name, code, said, lambda: solve(program, solid, p))

    def solve_inp(text):
        with open(f"{program.work}/no.inp", "w") as f:
            f.write(text)
        program.fem("no.inp", "no.inp")

    for name, old, new, code, said in refusals_of_inp():
        assert old in INP, name
        refuse(f".inp: {name}", code, said, lambda: solve_inp(INP.replace(old, new, 1)))
    if table:
        print(f"{count} problems that must be refused")
    return bad

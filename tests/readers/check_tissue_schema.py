#!/usr/bin/env python3
"""docs/formats/tissue-problem.schema.json and the program say the same of a problem: what is right, and what is wrong with one change.
The program is asked by its module for Python, where all of it is one process. usage: PYTHONPATH=MODULE check_tissue_schema.py SOURCE_DIR
"""

import copy, json, pathlib, re, sys

try:
    import jsonschema
    import numpy as np
    import osteo  # made for Debian's Python
except ImportError as e:
    print(f"{e.name} is not here")
    sys.exit(77)

root = pathlib.Path(sys.argv[1])
schema = json.loads((root / "docs/formats/tissue-problem.schema.json").read_text())
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)

ALL = {"box_mm": [[-1, -1, -1], [11, 11, 11]]}
TOP = {"box_mm": [[-1, -1, 9.9], [11, 11, 11]]}
GOOD = {
    "osteotome_tissue": 1,
    "$schema": "x",
    "about": "all keys",
    "law": "linear",
    "order": "t4",
    "material": {"young_kpa": 100, "poisson": 0.3, "density_kg_m3": 1000, "about": "soft"},
    "regions": [{**ALL, "young_kpa": 200, "poisson": 0.25, "density_kg_m3": 1100, "name": "r"}],
    "fixed": [
        {"box_mm": [[-1, -1, -1], [11, 11, 0.1]], "about": "held"},
        {"at_mm": [0, 0, 10], "radius_mm": 1, "axes": "xy"},
    ],
    "loads": [
        {
            "name": "all",
            "forces": [{**TOP, "total_n": [0, 0, 0.01]}],
            "surfaces": [{**TOP, "kpa": 1}, {**TOP, "kpa": [0, 0, 1]}],
            "volumes": [{**ALL, "total_n": [0, 0.01, 0]}],
            "gravity_m_s2": [0, 0, -9.81],
            "contacts": [
                {"at_mm": [5, 5, 12], "radius_mm": 1, "stiffness_n_per_mm": 1},
                {"at_mm": [5, 5, 30], "normal": [0, 0, -1], "stiffness_n_per_mm": 1, "about": "a plate"},
            ],
        },
        {"name": "moved", "moved": [{"at_mm": [10, 10, 10], "radius_mm": 1, "by_mm": [0, 0, 0.1], "axes": "z"}]},
    ],
}


def changed(path, value):
    """GOOD with one place changed; ... takes it away."""
    problem = copy.deepcopy(GOOD)
    at = problem
    for key in path[:-1]:
        at = at[key]
    if value is ...:
        del at[path[-1]]
    else:
        at[path[-1]] = value
    return problem


def places(value, path=()):
    yield path, value
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from places(inner, (*path, key))


wrong = []  # one change each
for path, value in places(GOOD):
    if isinstance(value, dict):
        wrong.append((*path, "gravty"))  # a key that is none
    if not path or path == ("$schema",):
        continue
    if isinstance(value, (dict, list)):
        wrong.append((path, 7) if path[-1] != "kpa" else (path, "7"))
    elif isinstance(value, str):
        wrong.append((path, 7))
    else:
        wrong += [(path, "7"), (path, None), (path, True), (path, 1e30)]
    if isinstance(value, list) and value and not isinstance(value[0], dict):
        wrong.append((path, value + value[-1:]))
wrong = [w if len(w) == 2 and isinstance(w[0], tuple) else (w, 1) for w in wrong]
L = ("loads", 0)
wrong += [
    (("material", "young_kpa"), 0),
    (("material", "poisson"), 0.5),
    (("material", "poisson"), -1),
    (("material", "density_kg_m3"), 0.5),
    (("law",), "hooke"),
    (("order",), "t20"),
    (("osteotome_tissue",), 2),
    (("fixed", 1, "axes"), ""),
    (("fixed", 1, "axes"), "w"),
    (("fixed", 1, "radius_mm"), 0),
    (("fixed", 1, "radius_mm"), ...),
    (("fixed", 1, "at_mm"), ...),
    (("fixed", 0, "box_mm"), ...),
    (("fixed", 0, "radius_mm"), 3),
    (("fixed",), ...),
    (("material",), ...),
    (("material", "poisson"), ...),
    (("osteotome_tissue",), ...),
    (("regions", 0, "young_kpa"), ...),
    ((*L, "forces", 0, "total_n"), ...),
    ((*L, "surfaces", 0, "kpa"), ...),
    ((*L, "contacts", 0, "radius_mm"), ...),
    ((*L, "contacts", 0, "normal"), [0, 0, 1]),
    ((*L, "contacts", 1, "stiffness_n_per_mm"), ...),
    (("loads", 1, "moved"), ...),
    (("loads", 1, "moved", 0, "by_mm"), [0, 0, 2e4]),
    (("regions", 0, "total_n"), [0, 0, 1]),
]
# What both take: the ends of ranges, what may be left out, integers for numbers.
right = [
    ((), None),
    (("material", "young_kpa"), 1e-6),
    (("material", "young_kpa"), 1e9),
    (("material", "poisson"), 0.49999),
    (("material", "poisson"), -0.999),
    (("about",), ...),
    (("law",), ...),
    (("order",), ...),
    (("regions",), ...),
    (("regions",), []),
    (("$schema",), ...),
    (("fixed", 1, "axes"), "x"),
    (("fixed", 1, "axes"), ...),
    (("material", "density_kg_m3"), 30000),
    ((*L, "name"), ...),
    ((*L, "forces"), ...),
    ((*L, "surfaces", 0, "kpa"), -1e6),
    (("loads", 1, "moved", 0, "axes"), "yz"),
]

failures = []
corners = np.array([(x, y, z) for z in (0, 10) for y in (0, 10) for x in (0, 10)], np.float32)
triangles = np.array(
    [
        (0, 2, 3),
        (0, 3, 1),
        (4, 5, 7),
        (4, 7, 6),
        (0, 1, 5),
        (0, 5, 4),
        (2, 6, 7),
        (2, 7, 3),
        (0, 4, 6),
        (0, 6, 2),
        (1, 3, 7),
        (1, 7, 5),
    ],
    np.uint32,
)
mesh = osteo.tetrahedralize(osteo.Surface(corners, triangles), method="grid", spacing_mm=5)
for expected, changes in ((True, right), (False, wrong)):
    for path, value in changes:
        problem = copy.deepcopy(GOOD) if path == () else changed(path, value)
        try:  # read, and not solved: there is no such load
            osteo.fem(mesh, problem, load="none of these", threads=1)
            said = "solved"
        except osteo.Error as e:
            said = str(e)
        program, by_schema = "there is no load 'none of these'" in said, validator.is_valid(problem)
        if (program, by_schema) != (expected, expected):
            failures.append(
                f"{path} = {value!r}: the program {'takes' if program else 'refuses'} it, the schema {'takes' if by_schema else 'refuses'} it: {said[:200]}"
            )
examples = sorted((root / "pipelines/tissue").glob("*.json"))
for file in examples:
    text = re.sub(r"^\s*//.*$", "", file.read_text(), flags=re.M)
    for e in validator.iter_errors(json.loads(text)):
        failures.append(f"{file.name}: {e.message}")
page = (root / "docs/formats/tissue-problem.md").read_text()
first = json.loads(re.search(r"```json\n(.*?)```", page, re.S)[1])
failures += [f"docs/formats/tissue-problem.md: {e.message}" for e in validator.iter_errors(first)]
lines = [json.loads(l) for l in re.findall(r"^(\{ \"name\".*\})$", page, re.M)]
for load in lines:
    failures += [
        f"docs/formats/tissue-problem.md, {load['name']}: {e.message}"
        for e in validator.iter_errors({**first, "loads": [load]})
    ]
if len(lines) < 6 or len(examples) < 3:
    failures.append(
        f"only {len(lines)} loads in the page and {len(examples)} examples found: is this still read right?"
    )
print(
    f"{len(right)} right and {len(wrong)} wrong problems, {len(examples)} files, {len(lines) + 1} examples of the page: {len(failures)} differences"
)
print("\n".join(failures))
sys.exit(bool(failures))

#!/usr/bin/env python3
"""Who includes whom is what libs/layers.txt says of areas and libraries, no more and no less; architecture.md shows the same; no public header has a
heavy one, at most 200 are public, no two types have one name."""

import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
heavy = re.compile(r'#include [<"](openvdb/|CGAL/|ceres/|CLI/|opencv2/|tetgen|nlohmann/json\.hpp|Eigen/|vtk)')
for_sources_only = {
    "libs/imaging/pipeline/include/osteo/imaging/pipeline/report_json.h",
    "libs/geometry/grid/include/osteo/geometry/grid/vdb.h",
}  # both say so themselves
shows_vtk = {"vtk", "view", "io"}  # VTK is what these are about
# JSON is read by JsonFile and written by Json; the library behind them is slow to compile. These are still to follow.
json_inside = {"libs/core/base/src/json.cpp", "libs/core/base/src/json_document.cpp"}
json_still = {
    "libs/session/scene/src/session_folder.cpp",
    "libs/session/recording/src/export.cpp",
    "libs/session/recording/src/script_file.cpp",
    "libs/session/recording/src/session_header.cpp",
    "libs/session/recording/src/session_header.h",
    "libs/session/recording/src/session_reader.cpp",
    "libs/session/recording/src/session_writer.cpp",
    "libs/app/window/src/window_state.cpp",
}
bad = []

# The table: area -> areas it may use; library -> (may be included by its headers, by its sources only).
table, areas, area_of, area, kinds = {}, {}, {}, None, {}
for line in (root / "libs/layers.txt").read_text().splitlines():
    if not line or line.startswith("#"):
        continue
    if m := re.fullmatch(r"== (\w+) \|([\w ]*)", line):
        area = m[1]
        areas[area] = m[2].split()
        bad += [
            f"libs/layers.txt: {area} may use {a}, which does not stand above it" for a in areas[area] if a not in areas
        ]
        continue
    if m := re.fullmatch(r"(programs|research): ([\w ]+)", line):
        kinds[m[1]] = m[2].split()
        bad += [f"libs/layers.txt: {m[1]} lists {lib}, which has no row" for lib in kinds[m[1]] if lib not in table]
        continue
    m = re.fullmatch(r"(\w+) +([\w ]*)\|([\w ]*)", line)
    if not m or not area:
        sys.exit(f"libs/layers.txt: cannot read '{line}'")
    public, private = m[2].split(), m[3].split()
    for other in public + private:
        if other not in table:
            bad.append(f"libs/layers.txt: {m[1]} lists {other}, which does not stand above it")
        elif area_of[other] not in [area, *areas[area]]:
            bad.append(f"libs/layers.txt: {m[1]} lists {other}, but {area} may not use {area_of[other]}")
        if (public + private).count(other) > 1:
            bad.append(f"libs/layers.txt: {m[1]} lists {other} twice")
    table[m[1]], area_of[m[1]] = (set(public), set(private)), area
for area, others in areas.items():
    used = {
        area_of[o]
        for lib, (public, private) in table.items()
        if area_of[lib] == area
        for o in public | private
        if o in area_of
    }
    bad += [f"libs/layers.txt: nothing of {area} uses {other}" for other in others if other not in used]

# What other projects get takes nothing that belongs to the programs alone.
programs = set(kinds["programs"])
for lib, (public, private) in table.items():
    bad += [
        f"libs/layers.txt: {lib} is for other projects and lists {o}, which is the programs' own"
        for o in (public | private) & programs
        if lib not in programs
    ]
bad += [f"libs/layers.txt: research lists {lib}, programs does not" for lib in kinds["research"] if lib not in programs]
for lib, (public, private) in table.items():
    bad += [
        f"libs/layers.txt: {lib} lists {o}, which a build may leave out"
        for o in (public | private) & set(kinds["research"])
        if lib not in kinds["research"]
    ]

# Public headers: what other projects may include. Those in detail/ come along with one of them and are for their own library and for tests.
kMaxPublicHeaders = 200
public_headers = [p for p in sorted((root / "libs").glob("*/*/include/osteo/*/*/*.h")) if p.parent.name not in programs]
if len(public_headers) > kMaxPublicHeaders:
    bad.append(
        f"{len(public_headers)} public headers, where {kMaxPublicHeaders} are allowed: is the new one private (src/), detail/, or part of one that is there?"
    )
for p in public_headers:
    if not re.match(r"// \w|/// @class", p.read_text()):
        bad.append(f"{p.relative_to(root)} does not say in its first line what it is for")
for p in sorted([*(root / "libs").rglob("*"), *(root / "apps").rglob("*")]):
    if p.suffix in (".h", ".cpp"):
        own = p.relative_to(root).parts[2:3]
        bad += [
            f"{p.relative_to(root)}: {m[0]}: detail/ is for {m[1]} alone"
            for m in re.finditer(r'#include "osteo/\w+/(\w+)/detail/\w+\.h"', p.read_text())
            if [m[1]] != list(own)
        ]

# The includes, and the namespace of each file: `osteo::inline AREA`, of core `osteo`.
for folder in sorted(p for p in (root / "libs").glob("*/*") if p.is_dir() and p.parent.name != "cmake"):
    area, lib = folder.parent.name, folder.name
    if area_of.get(lib) != area:
        bad.append(f"libs/{area}/{lib} has no row below '== {area}' in libs/layers.txt")
        continue
    in_headers, in_sources = {}, {}
    for path in folder.rglob("*"):
        if path.suffix not in (".h", ".cpp"):
            continue
        name = path.relative_to(root).as_posix()
        public = "/include/" in name
        text = path.read_text()
        for m in re.finditer(r"^namespace osteo\b([^{;=]*)\{(?:\s*(?:class|struct) \w+;)*\s*\}?", text, re.M):
            wanted = "" if area == "core" else f"::inline {area}"
            forward = m[0].endswith("}")  # a type of another area, declared
            if not forward and name not in for_sources_only and not (m[1].strip() + "::").startswith(wanted + "::"):
                bad.append(f"{name}: 'namespace osteo{m[1].strip()}'; in {area} it is 'osteo{wanted}'")
        for line in text.splitlines():
            m = re.match(r'#include "osteo/(\w+)/(\w+)/', line)
            if m and area_of.get(m[2]) != m[1]:
                bad.append(f"{name}: {line}: there is no libs/{m[1]}/{m[2]}")
            elif m and m[2] != lib:
                (in_headers if public else in_sources).setdefault(m[2], name)
            h = heavy.match(line)
            if public and h and name not in for_sources_only and not (h[1] == "vtk" and lib in shows_vtk):
                bad.append(f"{name}: {line}")
            if "nlohmann" in line and name not in json_inside | json_still:
                bad.append(f"{name}: {line}: JsonFile reads JSON, Json writes it (libs/core/base)")
            if re.match(r'#include ".*\.\./', line) or re.match(r'#include "osteo/[^"]*/src/', line):
                bad.append(f"{name}: {line}: only public headers of other libraries")
    public, private = table[lib]
    for other, name in in_headers.items():
        if other not in public:
            bad.append(f"{name}: a public header of {lib} may not include {other} (libs/layers.txt)")
    for other, name in in_sources.items():
        if other not in public | private:
            bad.append(f"{name}: {lib} may not include {other} (libs/layers.txt)")
    for other in sorted(public - in_headers.keys()):
        bad.append(f"libs/layers.txt: no public header of {lib} includes {other}")
    for other in sorted(private - in_sources.keys()):
        bad.append(f"libs/layers.txt: no source of {lib} includes {other}")
for name in sorted(json_still):
    if not (root / name).exists() or "nlohmann" not in (root / name).read_text():
        bad.append(f"tests/layering.py: {name} needs no exception any more")
for lib in table:
    if not (root / "libs" / area_of[lib] / lib).is_dir():
        bad.append(f"libs/layers.txt: there is no libs/{area_of[lib]}/{lib}")

# CMake: one declaration a library, in the table's order, its links from the table alone. Each area has a page.
for area in areas:
    cmake = (root / "libs" / area / "CMakeLists.txt").read_text()
    declared = re.findall(r"^ *osteo_library\((\w+)", cmake, re.M)
    rows = [lib for lib in table if area_of[lib] == area]
    if declared != rows:
        bad.append(f"libs/{area}/CMakeLists.txt declares {' '.join(declared)}; libs/layers.txt has {' '.join(rows)}")
    for line in cmake.splitlines():
        if re.search(r"osteo::", line):
            bad.append(
                f"libs/{area}/CMakeLists.txt: '{line.strip()}': links between libraries come from libs/layers.txt"
            )
    readme = root / "libs" / area / "README.md"
    if not readme.exists():
        bad.append(
            f"libs/{area}/README.md is missing: what the area is for, its libraries, where to begin, what may not be done in it"
        )
    else:
        bad += [f"libs/{area}/README.md does not name {lib}" for lib in rows if f"`{lib}`" not in readme.read_text()]

# The page that shows it: | library | includes | holds |
page = (root / "docs/developer/architecture.md").read_text()
shown = {
    m[1]: m[2].split()
    for m in re.finditer(r"^\| (\w+) \| ([\w ]*) ?\| [^|]+ \|$", page, re.M)
    if m[1] in table or m[1] != "library"
}
for lib, (public, private) in table.items():
    if lib not in shown:
        bad.append(f"docs/developer/architecture.md: no row for {lib}")
    elif set(shown[lib]) != public | private:
        bad.append(
            f"docs/developer/architecture.md: {lib} includes {' '.join(shown[lib])}; libs/layers.txt says {' '.join(sorted(public | private))}"
        )
if [lib for lib in shown if lib in table] != list(table):
    bad.append("docs/developer/architecture.md: the rooms stand in another order than in libs/layers.txt")
for lib in shown.keys() - table.keys() - {"library", "area"}:
    bad.append(f"docs/developer/architecture.md: there is no library {lib}")

# One name, one type: two of the same name in different files of a namespace are one to the linker, which takes either's functions.
token = re.compile(
    r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/|[{};]|'
    r'\b(?:namespace|struct|class|enum(?: class)?|union)\b[^;{}()=]*(?=[;{])',
    re.S,
)
named = re.compile(
    r"(?:struct|class|enum(?: class)?|union)\s+(?:\[\[\w+\]\]\s*)?(\w+)\s*(?:final\s*)?(?::(?!:).*)?$", re.S
)
defined = {}
for path in sorted([*(root / "libs").rglob("*"), *(root / "apps").rglob("*")]):
    if path.suffix not in (".h", ".cpp"):
        continue
    text, scopes, opens = path.read_text(), [], None  # scopes: names of namespaces; None for any other brace
    for m in token.finditer(text):
        if m[0] == "{":
            scopes.append(opens)
        elif m[0] == "}" and scopes:
            scopes.pop()
        opens = None
        if m[0].startswith("namespace"):
            opens = (
                " ".join(w for w in m[0].replace("::inline ", "::").split()[1:]) or None
            )  # what stands in one without a name is the file's own
        elif (n := named.match(m[0].strip())) and text[m.end()] == "{" and all(scopes):
            defined.setdefault("::".join([*scopes, n[1]]), set()).add(path.relative_to(root).as_posix())
for name, where in sorted(defined.items()):
    if len(where) > 1:
        bad.append(f"{name} is defined in {' and in '.join(sorted(where))}: one of them needs another name")

print(
    "\n".join(bad)
    or f"{len(areas)} areas, {len(table)} libraries, {len(public_headers)} public headers, each includes and links what libs/layers.txt says"
)
sys.exit(bool(bad))

#!/usr/bin/env python3
"""Who includes whom is what libs/layers.txt says, no more and no less; architecture.md shows the same; no public header has a heavy one, no two types have one name."""
import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
heavy = re.compile(r'#include [<"](openvdb/|CGAL/|ceres/|CLI/|opencv2/|tetgen|nlohmann/json\.hpp|Eigen/|vtk)')
for_sources_only = {"libs/imaging/pipeline/include/osteo/imaging/pipeline/report_json.h", "libs/geometry/grid/include/osteo/geometry/grid/vdb.h"}  # both say so themselves
shows_vtk = {"vtk", "view", "io"}  # VTK is what these are about
# JSON is read by JsonFile and written by Json; the library behind them is slow to compile. These are still to follow.
json_inside = {"libs/core/base/src/json.cpp", "libs/core/base/src/json_document.cpp"}
json_still = {"libs/session/scene/src/session_folder.cpp", "libs/session/recording/src/export.cpp", "libs/session/recording/src/script_file.cpp",
              "libs/session/recording/src/session_header.cpp", "libs/session/recording/src/session_header.h", "libs/session/recording/src/session_reader.cpp", "libs/session/recording/src/session_writer.cpp",
              "libs/app/window/src/window_state.cpp"}
bad = []

# The table: library -> (may be included by its headers, by its sources only).
table = {}
for line in (root / "libs/layers.txt").read_text().splitlines():
    if not line or line.startswith("#"):
        continue
    m = re.fullmatch(r"(\w+) +([\w ]*)\|([\w ]*)", line)
    if not m:
        sys.exit(f"libs/layers.txt: cannot read '{line}'")
    public, private = m[2].split(), m[3].split()
    for other in public + private:
        if other not in table:
            bad.append(f"libs/layers.txt: {m[1]} lists {other}, which does not stand above it")
        if (public + private).count(other) > 1:
            bad.append(f"libs/layers.txt: {m[1]} lists {other} twice")
    table[m[1]] = (set(public), set(private))

# The includes.
for lib in sorted(p.name for p in (root / "libs").iterdir() if p.is_dir() and p.name != "cmake"):
    if lib not in table:
        bad.append(f"libs/{lib} has no row in libs/layers.txt")
        continue
    in_headers, in_sources = {}, {}
    for path in (root / "libs" / lib).rglob("*"):
        if path.suffix not in (".h", ".cpp"):
            continue
        name = path.relative_to(root).as_posix()
        public = "/include/" in name
        for line in path.read_text().splitlines():
            m = re.match(r'#include "osteo/(\w+)/', line)
            if m and m[1] != lib:
                (in_headers if public else in_sources).setdefault(m[1], name)
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
            bad.append(f"{name}: a public header of libs/{lib} may not include libs/{other} (libs/layers.txt)")
    for other, name in in_sources.items():
        if other not in public | private:
            bad.append(f"{name}: libs/{lib} may not include libs/{other} (libs/layers.txt)")
    for other in sorted(public - in_headers.keys()):
        bad.append(f"libs/layers.txt: no public header of {lib} includes {other}")
    for other in sorted(private - in_sources.keys()):
        bad.append(f"libs/layers.txt: no source of {lib} includes {other}")
for name in sorted(json_still):
    if not (root / name).exists() or "nlohmann" not in (root / name).read_text():
        bad.append(f"tests/layering.py: {name} needs no exception any more")
for lib in table:
    if not (root / "libs" / lib).is_dir():
        bad.append(f"libs/layers.txt: there is no libs/{lib}")

# CMake: one declaration a library, in the table's order, its links from the table alone.
cmake = (root / "libs/CMakeLists.txt").read_text()
declared = re.findall(r"^ *osteo_library\((\w+)", cmake, re.M)
if declared != list(table):
    bad.append(f"libs/CMakeLists.txt declares {' '.join(declared)}; libs/layers.txt has {' '.join(table)}")
for line in cmake.splitlines():
    if re.search(r"osteo::", line):
        bad.append(f"libs/CMakeLists.txt: '{line.strip()}': links between libraries come from libs/layers.txt")

# The page that shows it: | library | includes | holds |
page = (root / "docs/architecture.md").read_text()
shown = {m[1]: m[2].split() for m in re.finditer(r"^\| (\w+) \| ([\w ]*) ?\| [^|]+ \|$", page, re.M) if m[1] in table or m[1] != "library"}
for lib, (public, private) in table.items():
    if lib not in shown:
        bad.append(f"docs/architecture.md: no row for {lib}")
    elif set(shown[lib]) != public | private:
        bad.append(f"docs/architecture.md: {lib} includes {' '.join(shown[lib])}; libs/layers.txt says {' '.join(sorted(public | private))}")
if [lib for lib in shown if lib in table] != list(table):
    bad.append("docs/architecture.md: the rooms stand in another order than in libs/layers.txt")
for lib in shown.keys() - table.keys() - {"library"}:
    bad.append(f"docs/architecture.md: there is no library {lib}")

# One name, one type: two of the same name in different files of a namespace are one to the linker, which takes either's functions.
token = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/|[{};]|'
                   r'\b(?:namespace|struct|class|enum(?: class)?|union)\b[^;{}()=]*(?=[;{])', re.S)
named = re.compile(r"(?:struct|class|enum(?: class)?|union)\s+(?:\[\[\w+\]\]\s*)?(\w+)\s*(?:final\s*)?(?::(?!:).*)?$", re.S)
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
            opens = " ".join(m[0].split()[1:]) or None  # what stands in one without a name is the file's own
        elif (n := named.match(m[0].strip())) and text[m.end()] == "{" and all(scopes):
            defined.setdefault("::".join([*scopes, n[1]]), set()).add(path.relative_to(root).as_posix())
for name, where in sorted(defined.items()):
    if len(where) > 1:
        bad.append(f"{name} is defined in {' and in '.join(sorted(where))}: one of them needs another name")

print("\n".join(bad) or f"{len(table)} libraries, each includes and links what libs/layers.txt says")
sys.exit(bool(bad))

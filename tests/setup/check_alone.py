#!/usr/bin/env python3
"""Every source of a library and every public header compiles by itself. usage: check_alone.py SOURCE_DIR BUILD_DIR

The build compiles several sources of a library as one, which hides an include that one of them lacks. Here each is compiled alone, syntax only,
with the options of its library. A header that a source includes before anything else is proved by that source; the others are compiled here too.
Libraries that the build leaves out (copyleft, window) are named and not judged. Then a build without research (OSTEO_RESEARCH=OFF) is configured, and
those sources of its programs that could want research are compiled as there. 0 if all compile, 1 if not."""

import concurrent.futures, json, os, pathlib, re, shutil, subprocess, sys, tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from compile_options import options

source, build = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
# What was compiled alone before, with the same bytes of all that it includes, is known to ccache.
cache = [c] if (c := shutil.which("ccache")) else []
INCLUDE = re.compile(r'\s*#\s*include\s+[<"]([^>"]+)')


def first_include(path):
    for line in path.read_text(errors="replace").splitlines():
        found = INCLUDE.match(line)
        if found:
            return found[1]
    return None


def compiles(command, cwd, file):
    """What the compiler says, or None."""
    what = ["-include", str(file), "/dev/null"] if file.suffix == ".h" else [str(file)]
    tried = subprocess.run(
        [*cache, *command, "-fsyntax-only", "-x", "c++", *what], cwd=cwd, capture_output=True, text=True
    )
    return tried.stderr if tried.returncode else None


library_of, together, first = {}, [], set()  # together: sources that the build compiled with others
for entry in json.loads((build / "compile_commands.json").read_text()):
    path = pathlib.Path(entry["directory"], entry["file"]).resolve()
    if found := (
        re.match(r"libs/[a-z]+/([a-z_]+)/src/", str(path.relative_to(source))) if path.is_relative_to(source) else None
    ):
        first.add(first_include(path))
    elif found := (
        re.match(r"libs/[a-z]+/CMakeFiles/osteo_([a-z_]+)\.dir/Unity/", str(path.relative_to(build)))
        if path.is_relative_to(build)
        else None
    ):
        own = [pathlib.Path(m) for m in re.findall(r'#include "([^"]+)"', path.read_text())]
        together += [(found[1], p) for p in own]
        first.update(first_include(p) for p in own)
    if found:
        library_of.setdefault(found[1], ([*options(entry["command"]), "-w"], entry["directory"]))
if not library_of:
    sys.exit(f"{build}/compile_commands.json names no source of {source}/libs")

# The check itself: a header or source that lacks an include is told.
with tempfile.TemporaryDirectory() as scratch:
    for name in ("lame.h", "lame.cpp"):
        lame = pathlib.Path(scratch, name)
        lame.write_text("inline std::string f() { return {}; }\n")
        if compiles(*library_of["base"], lame) is None:
            sys.exit(f"{name} passes without its includes: this check sees nothing")

left_out, work, proved = set(), list(together), 0
for header in sorted(source.glob("libs/*/*/include/**/*.h")):
    library = header.relative_to(source).parts[2]
    if library not in library_of:
        left_out.add(library)
    elif str(header).split("/include/", 1)[1] in first:
        proved += 1
    else:
        work.append((library, header))
failed = 0
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    for (library, file), said in zip(work, pool.map(lambda w: compiles(*library_of[w[0]], w[1]), work)):
        if said:
            failed += 1
            print("\n".join([line for line in said.splitlines() if "error" in line][:3] or [said]), file=sys.stderr)
            print(
                f"{file.relative_to(source)} does not compile by itself: let it include what it names", file=sys.stderr
            )

# Without research: it can be configured, makes nothing of research, no source of a program includes what only the whole build has, and those that tell
# the two apart compile. That no library lists one of research is held by layering.py.
without = build / "tests/without-research"
configured = subprocess.run(
    ["cmake", "-S", source, "-B", without, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"]
    + ["-DOSTEO_RESEARCH=OFF", "-DOSTEO_TESTS=OFF", "-DOSTEO_PYTHON=OFF"],
    capture_output=True,
    text=True,
)
if configured.returncode:
    sys.exit(f"OSTEO_RESEARCH=OFF cannot be configured:\n{configured.stderr[-2000:]}")
research = re.search(r"^research: (.+)$", (source / "libs/layers.txt").read_text(), re.M)[1].split()
left_in = {}  # sources of that build
for entry in json.loads((without / "compile_commands.json").read_text()):
    left_in[pathlib.Path(entry["directory"], entry["file"]).resolve()] = entry
    for own in re.findall(r"osteo_(\w+)\.dir", entry["command"]):
        if own in research:
            failed += 1
            print(f"OSTEO_RESEARCH=OFF builds {own} all the same", file=sys.stderr)
absent = "|".join(sorted(p.stem for p in source.glob("apps/osteo/src/*.cpp") if p not in left_in))
wants = re.compile(rf'^#include "(?:osteo/\w+/(?:{"|".join(research)})/.*|(?:commands/)?(?:{absent})\.h)"', re.M)
guarded = re.compile(r"^#ifdef OSTEO_WITH_RESEARCH\n.*?^#(?:else|endif)", re.M | re.S)
judged = []
for path, entry in left_in.items():
    if not path.is_relative_to(source / "apps"):
        continue
    text = path.read_text()
    if found := wants.search(guarded.sub("", text)):
        failed += 1
        print(f"{path.relative_to(source)}: {found[0]}: OSTEO_RESEARCH=OFF leaves that out", file=sys.stderr)
    if "OSTEO_WITH_RESEARCH" in text:
        judged.append((path, [*options(entry["command"]), "-w"], entry["directory"]))
if not judged:
    sys.exit("no source of a program tells builds with research from those without: this check sees nothing")
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    for (path, _, _), said in zip(judged, pool.map(lambda j: compiles(j[1], j[2], j[0]), judged)):
        if said:
            failed += 1
            print("\n".join([line for line in said.splitlines() if "error" in line][:3] or [said]), file=sys.stderr)
            print(f"{path.relative_to(source)} does not compile with OSTEO_RESEARCH=OFF", file=sys.stderr)
print(
    f"{len(together)} sources and {len(work) - len(together)} headers compiled alone, {proved} headers are the first that such a source includes"
    + (f"; not built: {' '.join(sorted(left_out))}" if left_out else "")
    + f"; without research: {' '.join(sorted(p.name for p, _, _ in judged))}"
)
sys.exit(1 if failed else 0)

#!/usr/bin/env python3
"""Every public header compiles by itself. usage: check_headers.py SOURCE_DIR BUILD_DIR

A header that a source of the build includes before anything else has been compiled alone by that source. The others are compiled here, syntax only,
with the options of their library. Libraries that the build leaves out (copyleft, window) are named and not judged. 0 if all compile, 1 if not."""
import json, pathlib, re, shlex, subprocess, sys, tempfile

source, build = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
INCLUDE = re.compile(r'\s*#\s*include\s+[<"]([^>"]+)')


def first_include(path):
    for line in path.read_text(errors="replace").splitlines():
        found = INCLUDE.match(line)
        if found:
            return found[1]
    return None


def options(command):
    """Of a compile command: the compiler and what decides how a header reads, without input, output and dependency files."""
    words, kept, skip = shlex.split(command), [], False
    while words and pathlib.Path(words[0]).name in ("ccache", "sccache", "distcc"):
        words.pop(0)
    for word in words:
        if skip:
            skip = False
        elif word in ("-o", "-MF", "-MT", "-MQ", "-c"):
            skip = True
        elif word not in ("-MD", "-MMD") and not word.startswith("-O"):
            kept.append(word)
    return kept


def compiles(command, cwd, header):
    """What the compiler says, or None."""
    tried = subprocess.run([*command, "-fsyntax-only", "-x", "c++", "-include", str(header), "/dev/null"], cwd=cwd, capture_output=True, text=True)
    return tried.stderr if tried.returncode else None


library_of, first = {}, set()
for entry in json.loads((build / "compile_commands.json").read_text()):
    path = pathlib.Path(entry["directory"], entry["file"]).resolve()
    # Sources of a library that are compiled as one are listed in a file that the build makes; those that stand alone prove their first include.
    if found := re.match(r"libs/[a-z]+/([a-z_]+)/src/", str(path.relative_to(source))) if path.is_relative_to(source) else None:
        first.add(first_include(path))
    elif path.is_relative_to(build):
        found = re.match(r"libs/[a-z]+/CMakeFiles/osteo_([a-z_]+)\.dir/Unity/", str(path.relative_to(build)))
        if found:
            first.add(first_include(pathlib.Path(first_include(path))))
    if found:
        library_of.setdefault(found[1], (options(entry["command"]), entry["directory"]))
if not library_of:
    sys.exit(f"{build}/compile_commands.json names no source of {source}/libs")

# The check itself: a header that lacks an include is told.
with tempfile.TemporaryDirectory() as scratch:
    lame = pathlib.Path(scratch, "lame.h")
    lame.write_text("inline std::string f() { return {}; }\n")
    if compiles(*library_of["base"], lame) is None:
        sys.exit("a header without its includes passes: this check sees nothing")

alone = here = 0
left_out, failed = set(), []
for header in sorted(source.glob("libs/*/*/include/**/*.h")):
    library, name = header.relative_to(source).parts[2], str(header).split("/include/", 1)[1]
    if library not in library_of:
        left_out.add(library)
    elif name in first:
        alone += 1
    else:
        here += 1
        said = compiles(*library_of[library], header)
        if said:
            failed.append(name)
            print("\n".join(l for l in said.splitlines() if "error" in l).splitlines()[0] if "error" in said else said, file=sys.stderr)
            print(f"{name} does not compile by itself: let it include what it names", file=sys.stderr)
print(f"{alone} headers are the first that a source includes, {here} compiled here" + (f"; not built: {' '.join(sorted(left_out))}" if left_out else ""))
sys.exit(1 if failed else 0)

#!/usr/bin/env python3
"""All public headers in one file: no name means two things. usage: check_headers_together.py SOURCE_DIR BUILD_DIR

Headers of libraries that the build leaves out (copyleft, window) are left out too. OpenVDB's own (vdb.h) is for sources alone.
"""

import json, pathlib, re, shlex, subprocess, sys, tempfile

source, build = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
sources_only = {"vdb.h", "report_json.h"}
includes, built, compiler = {}, set(), None
for entry in json.loads((build / "compile_commands.json").read_text()):
    words = shlex.split(entry["command"])
    if found := re.search(r"libs/[a-z]+/CMakeFiles/osteo_([a-z_]+)\.dir/", entry["command"]):
        built.add(found[1])
        compiler = compiler or next(w for w in words if pathlib.Path(w).name not in ("ccache", "sccache", "distcc"))
        for i, word in enumerate(words):
            if word == "-isystem":
                includes["-isystem " + words[i + 1]] = True
            elif word.startswith("-I") and "/include" in word:
                includes[word] = True
headers = [
    str(h).split("/include/", 1)[1]
    for h in sorted(source.glob("libs/*/*/include/**/*.h"))
    if h.relative_to(source).parts[2] in built and h.name not in sources_only
]
options = [w for i in includes for w in i.split(" ")]


def compiles(text):
    with tempfile.TemporaryDirectory() as scratch:
        file = pathlib.Path(scratch, "all.cpp")
        file.write_text(text)
        said = subprocess.run([compiler, "-std=c++20", "-fsyntax-only", *options, file], capture_output=True, text=True)
        return None if said.returncode == 0 else said.stderr


everything = "".join(f'#include "{h}"\n' for h in headers)
# What uses a name that two areas have is refused; that is what the check must see.
twice = everything + "namespace osteo { inline namespace core_again { struct Frame {}; } using planted = Frame*; }\n"
if "ambiguous" not in (compiles(twice) or ""):
    sys.exit("a name with two meanings passes: this check sees nothing")
# Each type of a public header, named without its area.
names = set()
for header in source.glob("libs/*/*/include/**/*.h"):
    if header.relative_to(source).parts[2] in built and header.name not in sources_only:
        text, depth = header.read_text(), 0
        if m := re.search(r"^namespace osteo(?:::inline \w+)? \{\n(.*)^\}", text, re.M | re.S):
            names |= set(re.findall(r"^(?:struct|class|enum class) (\w+)(?: final)?(?: :[^;{]*)? \{", m[1], re.M))
# Those in a namespace of their own library, and templates, are not found or not named so; what counts is whether a name is ambiguous.
said = compiles(
    everything + "namespace osteo {\n" + "".join(f"using check_{n} = {n}*;\n" for n in sorted(names)) + "}\n"
)
if said:
    errors = [
        line
        for line in said.splitlines()
        if "error" in line and not re.search(r"does not name a type|not allowed in alias|no type named", line)
    ]
    if errors:
        print("\n".join(errors[:20]), file=sys.stderr)
        sys.exit(f"{len(errors)} errors with all headers in one file")
print(f"{len(headers)} public headers in one file, {len(names)} types, each with one meaning")

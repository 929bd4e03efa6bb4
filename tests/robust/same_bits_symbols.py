#!/usr/bin/env python3
"""What a replay is computed with calls nothing of the mathematics library whose last bits vary, and one place chooses the instruction set.

usage: same_bits_symbols.py SOURCE_DIR LIBRARY_DIR      the folder with the static libraries
"""

import pathlib, re, subprocess, sys

source, libraries = (pathlib.Path(a) for a in sys.argv[1:3])
# Everything the servo, a replay, a script or a scene is computed with. Roots, rounding and scaling by powers of two are exact or rounded in one way.
checked = ["base", "rt", "data", "mesh", "distance", "bone", "haptics", "recording", "nerve", "scene"]
varies = re.compile(
    r"^(a?(sin|cos|tan)h?|atan2|sincos|hypot|exp(2|10|m1)?|pow|log(2|10|1p|b)?|cbrt|erfc?|[lt]gamma)(f|l)?$"
)
allowed = {("mesh", "mesh_info.cpp.o", "atan2")}  # an angle that is reported
bad, objects = [], 0
for lib in checked:
    out = subprocess.run(
        ["nm", "--undefined-only", libraries / f"libosteo_{lib}.a"], check=True, capture_output=True, text=True
    ).stdout
    for line in out.splitlines():
        if line.endswith(".o:"):
            name, objects = line[:-1], objects + 1
        elif (m := re.match(r"\s*U (\w+)", line)) and varies.match(m[1]) and (lib, name, m[1]) not in allowed:
            bad.append(
                f"{lib}, {name}: calls {m[1]}; base/portable_math.h has, or should have, one that gives the same bits everywhere"
            )
assert objects > 20, f"only {objects} objects looked at"

# The feature test of the processor, and what loops for it are compiled with, are written once.
choice = re.compile(r"__builtin_cpu_supports|target_clones|getenv\(\"OSTEO_SIMD\"\)|__attribute__\(\(target")
for path in [*(source / "libs").rglob("*"), *(source / "apps").rglob("*")]:
    if path.suffix in (".h", ".cpp") and path.name != "simd.cpp" and (m := choice.search(path.read_text())):
        bad.append(f"{path.relative_to(source)}: {m[0]}; base/simd.h chooses the instruction set")
if re.search(r"-mavx|-mfma", "".join(p.read_text() for p in (source / "libs").glob("*/CMakeLists.txt"))):
    bad.append(
        "an area's CMakeLists.txt names an instruction set: osteo_simd (libs/cmake/osteo.cmake) compiles for those that base/simd.h asks for"
    )
print("\n".join(bad) or f"{objects} objects call none of it; one place chooses the instruction set")
sys.exit(bool(bad))

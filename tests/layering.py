#!/usr/bin/env python3
"""A library includes only libraries above it in libs/CMakeLists.txt, and no public header includes a heavy one."""
import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
order = re.findall(r"osteo_library\((\w+)", (root / "libs/CMakeLists.txt").read_text())
heavy = re.compile(r'#include [<"](openvdb/|CGAL/|ceres/|CLI/|opencv2/|tetgen|nlohmann/json\.hpp|Eigen/)')
allowed_heavy = {"libs/pipeline/include/osteo/pipeline/report_json.h"}  # says so itself: for source files only
bad = []
for lib in sorted(p.name for p in (root / "libs").iterdir() if p.is_dir() and p.name != "cmake"):
    if lib not in order:
        bad.append(f"libs/{lib} is not declared in libs/CMakeLists.txt")
        continue
    for path in (root / "libs" / lib).rglob("*"):
        if path.suffix not in (".h", ".cpp"):
            continue
        name = path.relative_to(root).as_posix()
        for line in path.read_text().splitlines():
            m = re.match(r'#include "osteo/(\w+)/', line)
            if m and order.index(m[1]) > order.index(lib):
                bad.append(f"{name}: libs/{lib} may not include libs/{m[1]}")
            if "/include/" in name and heavy.match(line) and name not in allowed_heavy:
                bad.append(f"{name}: {line}")
print("\n".join(bad) or f"{len(order)} libraries, each includes only those above it")
sys.exit(bool(bad))

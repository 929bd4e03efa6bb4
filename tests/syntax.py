#!/usr/bin/env python3
"""Compiles single files, syntax only, with the options of their library or test: seconds instead of a build.
usage: tests/syntax.py FILE... (sources or headers). Wants build/dev, made by `cmake --preset dev`. 0 if all compile, 1 if not.
"""

import json, os, pathlib, subprocess, sys

from compile_options import options

root = pathlib.Path(__file__).resolve().parents[1]
database = root / "build/dev/compile_commands.json"
if len(sys.argv) < 2 or not database.exists():
    sys.exit(__doc__ if len(sys.argv) < 2 else "first: cmake --preset dev")
entries = [(pathlib.Path(e["directory"], e["file"]).resolve(), e) for e in json.loads(database.read_text())]
failed = 0
for name in sys.argv[1:]:
    path = pathlib.Path(name).resolve()
    # A new source, or a header, is compiled as its nearest neighbour is.
    near = max(entries, key=lambda e: (e[0] == path, len(os.path.commonpath([e[0], path]))))[1]
    what = ["-include", str(path), "/dev/null"] if path.suffix == ".h" else [str(path)]
    failed += (
        subprocess.run(
            [*options(near["command"], drop=()), "-fsyntax-only", "-x", "c++", *what], cwd=near["directory"]
        ).returncode
        != 0
    )
sys.exit(1 if failed else 0)

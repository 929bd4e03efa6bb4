#!/usr/bin/env python3
"""The recipes of CONTRIBUTING.md ("How to add ...") still work. usage: check_recipes.py SOURCE_DIR BUILD_DIR

Each NAME.patch beside this file follows one recipe. It is applied to a copy of the tree; what it touches is compiled, syntax only, with the options
of its library or test, layering.py is run, and it is taken back. A recipe whose library the build leaves out (window) is applied, not compiled.
A patch that no longer applies or compiles: something that the recipe names has changed. Mend the recipe's text, then the patch (edit the files as
the recipe says, `git diff > tests/recipes/NAME.patch`, `git checkout` what was edited). 0 if all work, 1 if not."""

import concurrent.futures, json, os, pathlib, re, shutil, subprocess, sys, tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from compile_options import options

source, build = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
recipes = sorted((source / "tests/recipes").glob("*.patch"))
contributing = (source / "CONTRIBUTING.md").read_text()


def options_in(copy, command):
    """The options, with the folders of the copy in place of the tree's."""

    def moved(word):
        if str(source) not in word or str(build) in word:
            return word
        there = word.replace(str(source), str(copy))
        return there if not word.startswith("-I") or pathlib.Path(there[2:]).exists() else word

    return [*map(moved, options(command)), "-Werror=switch"]


# Source file, relative to the tree -> its command. Sources that the build compiles together share the command of their unity file.
command_of = {}
for entry in json.loads((build / "compile_commands.json").read_text()):
    path = pathlib.Path(entry["directory"], entry["file"]).resolve()
    files = [path]
    if path.is_relative_to(build):
        files = (
            [pathlib.Path(f) for f in re.findall(r'#include "(/[^"]+)"', path.read_text())] if path.is_file() else []
        )
    command_of.update({f.relative_to(source): entry for f in files if f.is_relative_to(source)})


def entry_for(file):
    """The command of the file, or of one beside it: of its library or folder; None where the build has none."""
    if file in command_of:
        return command_of[file]
    own = file.parts[:3]
    near = next((f for f in sorted(command_of) if f.parts[:3] == own), None)
    return command_of[near] if near else None


def compiles(file, copy):
    """What the compiler says, or None."""
    entry, where = entry_for(file), copy / file
    if entry is None:
        return None
    what = ["-include", str(where), "/dev/null"] if file.suffix == ".h" else [str(where)]
    said = subprocess.run(
        [*options_in(copy, entry["command"]), "-fsyntax-only", "-x", "c++", *what],
        cwd=entry["directory"],
        capture_output=True,
        text=True,
    )
    return said.stderr if said.returncode else None


def apply(patch, copy, *back):
    """What git says, or None. The copy is no repository, and none around it counts."""
    said = subprocess.run(
        ["git", "apply", *back, str(patch)],
        cwd=copy,
        capture_output=True,
        text=True,
        env={**os.environ, "GIT_CEILING_DIRECTORIES": str(copy.parent)},
    )
    return said.stderr if said.returncode else None


def short(said):
    return "\n  ".join(["", *([line for line in said.splitlines() if "error" in line][:3] or said.splitlines()[:5])])


def follow(patch, copy):
    """What is wrong with a recipe, and how many files were compiled; the copy is afterwards as before."""
    text = patch.read_text()
    if said := apply(patch, copy):
        return f"does not apply any more:{short(said)}", 0
    touched = [pathlib.Path(f) for f in re.findall(r"^\+\+\+ b/(\S+)", text, re.M) if f.endswith((".h", ".cpp"))]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        layering = pool.submit(
            subprocess.run, [sys.executable, str(copy / "tests/layering.py"), str(copy)], capture_output=True, text=True
        )
        said = [s for s in pool.map(lambda f: compiles(f, copy), touched) if s]
        layers = layering.result()
    wrong = (
        f"does not compile:{short(said[0])}"
        if said
        else f"breaks the layers:{short(layers.stdout + layers.stderr)}" if layers.returncode else None
    )
    if said := apply(patch, copy, "--reverse"):
        sys.exit(f"{patch.stem}: cannot be taken back:{short(said)}")
    return wrong, sum(entry_for(f) is not None for f in touched)


failed = []
section = re.search(r"^## How to add$(.*?)^## ", contributing, re.M | re.S)
if not section or not recipes:
    sys.exit("CONTRIBUTING.md has no section 'How to add', or tests/recipes no patch")
for name in {*re.findall(r"`tests/recipes/([a-z_]+)\.patch`", section[1]), *(p.stem for p in recipes)}:
    if not (source / f"tests/recipes/{name}.patch").is_file() or f"recipes/{name}.patch" not in section[1]:
        failed.append(f"{name}: a recipe in CONTRIBUTING.md and tests/recipes/{name}.patch belong together")
for name in re.findall(r"`((?:libs|apps|tests|docs|pipelines)/[\w./-]+)`", section[1]):
    if not re.search(r"/(X_|NAME)", name) and not (source / name).exists():  # these stand for a new file
        failed.append(f"CONTRIBUTING.md names {name}, which is not there")

with tempfile.TemporaryDirectory() as scratch:
    copy = pathlib.Path(scratch).resolve() / "tree"
    for folder in ("libs", "apps", "tests", "docs", "pipelines"):
        shutil.copytree(
            source / folder, copy / folder, ignore=shutil.ignore_patterns("*.png", "*.jpg", "__pycache__", "build")
        )

    # The check itself: what does not fit, does not compile or breaks the layers is told.
    lame = pathlib.Path(scratch, "lame.patch")
    added = "libs/core/rt/include/osteo/core/rt/lame.h"
    whole = (
        "diff --git a/{0} b/{0}\nnew file mode 100644\n--- /dev/null\n+++ b/{0}\n@@ -0,0 +1,2 @@\n+#pragma once\n+{1}\n"
    )
    for text, wanted in (
        ("--- a/CONTRIBUTING.md\n+++ b/CONTRIBUTING.md\n@@ -1,1 +1,1 @@\n-not its first line\n+no\n", "apply"),
        (whole.format(added, "inline NoSuchType lame;"), "compile"),
        (whole.format(added, '#include "osteo/simulation/haptics/servo.h"'), ""),
    ):
        lame.write_text(text)
        told, _ = follow(lame, copy)
        if told is None or wanted not in told:
            sys.exit(f"a patch that cannot work passes: this check sees nothing ({wanted})")

    compiled = 0
    for patch in recipes:
        wrong, count = follow(patch, copy)
        compiled += count
        if wrong:
            failed.append(f"{patch.stem}: tests/recipes/{patch.name} {wrong}")
for told in failed:
    print(told, file=sys.stderr)
print(f"{len(recipes)} recipes, {compiled} files compiled")
sys.exit(1 if failed else 0)

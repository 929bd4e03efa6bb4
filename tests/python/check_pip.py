#!/usr/bin/env python3
"""`pip install` from a clean clone into a new environment, with the libraries that were built already; then types, as mypy sees them.
usage: check_pip.py SOURCE BUILD OUT. Skipped (77) without git or a network."""

import os
import pathlib
import shutil
import subprocess
import sys

source, build, out = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(out, ignore_errors=True)
out.mkdir(parents=True)
clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}


def run(*args, cwd=out, ok=True):
    done = subprocess.run([*map(str, args)], cwd=cwd, env=clean, capture_output=True, text=True)
    if ok and done.returncode != 0:
        sys.exit(f"{' '.join(map(str, args))}\n{done.stdout[-6000:]}\n{done.stderr[-3000:]}")
    return done


def skip(why):
    print(why)
    sys.exit(77)


# What is committed, and what was changed since; nothing that lies about.
if run("git", "-C", source, "rev-parse", "HEAD", ok=False).returncode != 0:
    skip("the source is no clone")
clone = out / "clone"
run("git", "clone", "-q", "--no-hardlinks", source, clone)
changes = subprocess.run(["git", "-C", source, "diff", "--binary", "HEAD"], capture_output=True, check=True).stdout
if changes:
    subprocess.run(["git", "-C", clone, "apply", "--whitespace=nowarn"], input=changes, check=True)

run(sys.executable, "-m", "venv", out / "env")
python = out / "env/bin/python"
pip = [python, "-m", "pip", "--disable-pip-version-check", "--retries", "1", "--timeout", "20"]
got = run(*pip, "install", "-q", "scikit-build-core>=0.10", "pybind11>=2.12", "numpy", "mypy", "ninja", ok=False)
if got.returncode != 0:
    skip("the packages that build it cannot be had: " + got.stderr.strip().splitlines()[-1])
# They are there now: an environment for building by itself would fetch them once more.
run(
    *pip,
    "install",
    "-q",
    "--no-build-isolation",
    "--no-deps",
    f"--config-settings=cmake.define.OSTEO_BUILT={build}",
    clone,
)

said = run(
    python,
    "-c",
    """
import importlib.metadata, numpy, osteo
assert osteo.__version__ == importlib.metadata.version("osteotome"), osteo.__version__
block = osteo.Grid(numpy.ones((20, 20, 20), numpy.float32))
with osteo.Rehearsal(block, hand="exact") as r:
    ticks = r.run(osteo.goals([[10, 10, 20.5 - 0.01 * i] for i in range(100)]))
assert ticks["force_n"][-1, 2] > 0.1 and r.removed_mm3 > 0
print(osteo.__file__)
""",
).stdout.strip()
assert said.startswith(str(out / "env")), said

right = '''
import numpy as np
import osteo

ct, labels = osteo.phantom(region="temporal", spacing_mm=2.0)
mask = osteo.threshold(ct, lower=500)
highest: int = int(ct.voxels.max())
with osteo.Rehearsal(osteo.Grid(np.zeros((8, 8, 8), np.float32)), hand="exact") as r:
    ticks = r.run(osteo.goals([[0, 0, 0]]))
print(osteo.Session("session").ticks["force_n"].shape, r.bone().dense().voxels, highest, mask.voxels)
'''
wrong = {
    'osteo.phantom(region="knee")': "arg-type",
    "osteo.threshold(3, lower=500)": "arg-type",
    'osteo.threshold("ct.nrrd", lowest=500)': "call-arg",
    'osteo.Rehearsal("case", hand="left")': "arg-type",
    'osteo.Session("session").tick': "attr-defined",
}
(out / "right.py").write_text(right)
run(python, "-m", "mypy", "--strict", "right.py")
(out / "wrong.py").write_text("import osteo\n" + "\n".join(wrong) + "\n")
found = run(python, "-m", "mypy", "--strict", "wrong.py", ok=False).stdout
for number, (line, kind) in enumerate(wrong.items(), 2):
    assert any(
        f"wrong.py:{number}: error" in f and f"[{kind}]" in f for f in found.splitlines()
    ), f"mypy takes {line}\n{found}"
# Names, parameters and their order in the types are those of the module.
# Classes of pybind11 have a metaclass of its own, and those that cannot be made a constructor that says so.
(out / "allowed").write_text(
    "osteo\\._.*\nosteo\\.Error.*\nosteo\\.(Field|Grid|Image|Labels|Surface|Tets)\nosteo\\.Tets\\.__init__\n"
)
told = run(
    python,
    "-m",
    "mypy.stubtest",
    "osteo",
    "--allowlist",
    out / "allowed",
    "--ignore-unused-allowlist",
    "--concise",
    ok=False,
)
assert told.returncode == 0, told.stdout + told.stderr
print(f"pip install from a clone, {said}; types agree with the module")

#!/usr/bin/env python3
"""The same bits for each instruction set and for the mathematics library of a processor without FMA and AVX2; also for a whole session.

usage: check_same_bits.py BIN_DIR FIXTURES WORK_DIR
"""

import json, os, pathlib, shutil, subprocess, sys

bin_dir, fixtures, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
PLAIN = "glibc.cpu.hwcaps=" + ",".join(
    "-" + f for f in ("AVX2", "FMA", "FMA4", "AVX", "AVX512F", "AVX512VL", "AVX512DQ", "AVX512BW")
)
machines = (
    [{}]
    + [{"OSTEO_SIMD": s} for s in ("avx512", "avx2", "scalar")]
    + [{"GLIBC_TUNABLES": PLAIN}, {"GLIBC_TUNABLES": PLAIN, "OSTEO_SIMD": "scalar"}]
)
told = lambda m: " ".join(f"{k}={v}" for k, v in m.items()) or "as it is"


def run(machine, *args):
    env = {k: v for k, v in os.environ.items() if k not in ("OSTEO_SIMD", "GLIBC_TUNABLES")} | machine
    return subprocess.run([str(a) for a in args], env=env, cwd=work, check=True, capture_output=True, text=True).stdout


bad, first, libraries, used = [], None, set(), set()
for m in machines:
    lines = dict(line.split(" ", 1) for line in run(m, bin_dir / "same_bits").splitlines())
    used.add(lines.pop("instructions"))
    libraries.add(lines.pop("library"))
    first = first or lines
    assert len(lines) == 12 and all("-0-changes" not in k for k in lines), lines
    for name in first.keys() | lines.keys():
        if first.get(name) != lines.get(name):
            bad.append(f"{told(m)}: {name} differs")
print(f"instruction sets met: {', '.join(sorted(used))}")
print(
    "the mathematics library itself gives other bits without FMA"
    if len(libraries) > 1
    else "the mathematics library gives the same bits here either way"
)

# Whole sessions, made again from the script and replayed.
sessions = []
for n, m in enumerate(machines):
    run(
        m,
        bin_dir / "osteo",
        "rehearse",
        fixtures / "case",
        "--headless",
        "--fast",
        "--seconds",
        2,
        "--dust",
        "-o",
        f"s{n}",
        "--quiet",
    )
    s = json.loads((work / f"s{n}/summary.json").read_text())
    sessions.append([s["bone_hash"], s["surface_hash"], s["removed_mm3"], s["dust_mm3"]])
    if sessions[n] != sessions[0]:
        bad.append(f"{told(m)}: the session differs")
    run(m, bin_dir / "osteo", "replay", "s0", "--quiet")  # exit code 7 when a tick differs
assert sessions[0][2] > 0.1, "the session should drill"
print("\n".join(bad) or f"{len(machines)} machines, {len(first)} sums and a session: the same bits")
sys.exit(bool(bad))

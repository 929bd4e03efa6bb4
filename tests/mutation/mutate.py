#!/usr/bin/env python3
"""Changes one place of the code at a time and asks whether a test notices.

usage: mutate.py [--count 60] [--seed 1] [--jobs 2] [--only LIB] [--table FILE.md] [--work FOLDER]

Draws places from the libraries below by a seed: a comparison, a sign, a condition, a constant, a counter, a call that is left out (but for reserve(), which only costs time). Each is
built in a copy of the sources and given to the unit tests named for its library, in that order. A place that the compiler refuses is drawn
anew. A mutant that computes the same as the original is listed in equivalent.txt with the reason, and counts for neither side.
Exit code 1 when fewer than 80 % are caught.
"""

import argparse, concurrent.futures, os, pathlib, random, re, resource, shutil, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Library: its sources, and the tests that answer for it. The headers of rt hold most of its code. Where programs and
# a pattern stand behind them, these tests of ctest answer for it too: a mutant that no unit test notices is built into
# the programs and given to them.
LIBRARIES = {
    "rt": (["libs/core/rt/src/*.cpp", "libs/core/rt/include/osteo/core/rt/*.h"], ["test_rt"]),
    "haptics": (["libs/simulation/haptics/src/*.cpp"], ["test_haptics", "test_scene"]),
    "bone": (["libs/simulation/bone/src/*.cpp"], ["test_bone", "test_haptics", "test_scene"]),
    "recording": (["libs/session/recording/src/*.cpp"], ["test_recording", "test_scene"]),
    "scene": (["libs/session/scene/src/*.cpp"], ["test_scene"]),
    "tutor": (["libs/network/tutor/src/*.cpp"], ["test_tutor"], ["osteo"], r"^stages\.works\.tutoring"),
    "evidence": (["libs/assessment/evidence/src/*.cpp"], ["test_evidence"]),
    "pacs": (["libs/hospital/pacs/src/*.cpp"], ["test_pacs"], ["osteo"], r"^(pacs\.[a-z]|doctor\.server)"),
    "dicom": (["libs/imaging/dicom/src/plac*.cpp"], ["test_dicom"]),
}
# Texts only for people, and loops for one kind of processor.
SKIPPED = re.compile(r"/(overlap_avx\w*|default_script)\.cpp$")
# What is written, what is written instead. Each acts on one match in a line.
OPERATORS = [
    (r"(?<= )<(?= )", ["<=", ">"]),
    (r"(?<= )<=(?= )", ["<", ">"]),
    (r"(?<= )>(?= )", [">=", "<"]),
    (r"(?<= )>=(?= )", [">", "<"]),
    (r"(?<= )==(?= )", ["!="]),
    (r"(?<= )!=(?= )", ["=="]),
    (r"(?<= )&&(?= )", ["||"]),
    (r"(?<= )\|\|(?= )", ["&&"]),
    (r"(?<=[\w)\]] )\+(?= [\w(])", ["-"]),
    (r"(?<=[\w)\]] )-(?= [\w(])", ["+"]),
    (r"(?<=[\w)\]] )\*(?= [\w(])", ["/"]),
    (r"\+=", ["-="]),
    (r"-=", ["+="]),
    (r"\btrue\b", ["false"]),
    (r"\bfalse\b", ["true"]),
    (r"(?<=if \()(?=!?\w)", ["false && "]),
    (r"\bstd::min\b", ["std::max"]),
    (r"\bstd::max\b", ["std::min"]),
    (r"(?<![\w.])\d+\.\d+(?![\w.])", [lambda m: repr(float(m) * 1.5 + (float(m) == 0) * 0.5)]),
]
STATEMENT = re.compile(r"^\s+(\+\+[\w.\->\[\]]+|[\w.\->]+\([^;{}]*\)|[\w.\->\[\]]+ (?:\+|-|\|)?= [^;{}]*);\s*(//.*)?$")


def sites(library):
    """Every (file, line number, original line, mutated line)."""
    found = []
    for pattern in LIBRARIES[library][0]:
        for path in sorted(ROOT.glob(pattern)):
            if SKIPPED.search(str(path)):
                continue
            for number, line in enumerate(path.read_text().splitlines()):
                code = line.split("//")[0]
                # Messages, assertions and declarations are not behaviour.
                if (
                    not line.startswith("  ")
                    or code.strip().startswith(("#", "*", "static_assert", "using", "template", "throw", '"'))
                    or '"' in code
                ):
                    continue
                for expression, replacements in OPERATORS:
                    for m in re.finditer(expression, code):
                        for r in replacements:
                            text = r(m.group()) if callable(r) else r
                            found.append((path, number, line, line[: m.start()] + text + line[m.end() :]))
                if (
                    STATEMENT.match(code)
                    and "return" not in code
                    and ".reserve(" not in code
                    and not re.match(r"\s+(const|auto|static)\b", code)
                ):
                    found.append((path, number, line, re.match(r"\s*", line).group() + ";"))
    return found


def shared_data():
    """Where this tree was told to look for it."""
    cache = ROOT / "build/release/CMakeCache.txt"
    told = re.search(r"^OSTEO_SHARED_DATA:\w+=(.+)$", cache.read_text(), re.M) if cache.exists() else None
    return told[1] if told else f"{ROOT}/../shared/data"


class Worker:
    """A copy of the sources with a build of its own."""

    def __init__(self, folder, libraries):
        self.folder, self.build = folder, folder / "build/release"
        folder.mkdir(parents=True, exist_ok=True)
        files = subprocess.run(
            ["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard"],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split("\n")
        for name in filter(None, files):
            source, target = ROOT / name, folder / name
            if source.is_file() and not (target.exists() and target.read_bytes() == source.read_bytes()):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target)
        # What is changed is compiled a source at a time, so that one change is one small compilation, and with an index
        # beyond its array ending the program as it does in CI's unit tests. All else is built as users have it: where
        # ccache is used it has that already, and the first build takes minutes instead of an hour.
        alone = "".join(
            f"cmake_language(DEFER CALL set_target_properties osteo_{name} PROPERTIES UNITY_BUILD OFF)\n"
            f"cmake_language(DEFER CALL target_compile_definitions osteo_{name} PRIVATE _GLIBCXX_ASSERTIONS)\n"
            for name in libraries
        )
        self.build.mkdir(parents=True, exist_ok=True)
        (self.build / "alone.cmake").write_text(alone)
        options = ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PROJECT_INCLUDE={self.build}/alone.cmake"]
        options.append(f"-DOSTEO_SHARED_DATA={shared_data()}")
        subprocess.run(
            ["cmake", "-S", folder, "-B", self.build, "-G", "Ninja", *options], check=True, stdout=subprocess.DEVNULL
        )

    def make(self, targets):
        return subprocess.run(["ninja", "-C", self.build, *targets], capture_output=True, text=True)

    def through_programs(self, programs, pattern):
        """None when all tests of that pattern pass, else the name of the first that fails."""
        if (built := self.make(programs)).returncode != 0:
            sys.exit(built.stdout[-3000:])
        # What they need of fixtures is made once.
        made = self.build / "tests/fixtures/.made"
        fixtures = ["-FA", ".*"] if made.exists() else []
        done = subprocess.run(
            ["ctest", "--test-dir", self.build, "-R", pattern, "--stop-on-failure", "--timeout", "600", *fixtures],
            capture_output=True,
            text=True,
            errors="replace",
        )
        if done.returncode == 0:
            made.parent.mkdir(parents=True, exist_ok=True)
            made.touch()
            return None
        failed = re.findall(r"\*\*\*(?:Failed|Timeout|Exception).*|- ([\w.]+) \((?:Failed|Timeout)", done.stdout)
        return next(filter(None, failed), "a test of " + pattern)

    def test(self, name):
        """None when all pass, else the name of the first that fails."""
        limit = lambda: (
            resource.setrlimit(resource.RLIMIT_CPU, (240, 240)),
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0)),
        )
        env = dict(os.environ, OSTEO_EDITS="3000", TMPDIR=str(self.folder / "tmp"))
        (self.folder / "tmp").mkdir(exist_ok=True)
        try:
            done = subprocess.run(
                [self.build / "bin" / name, "--gtest_fail_fast"],
                capture_output=True,
                text=True,
                errors="replace",
                timeout=900,
                env=env,
                preexec_fn=limit,
            )
        except subprocess.TimeoutExpired as e:
            return (
                last_started(e.stdout.decode(errors="replace") if isinstance(e.stdout, bytes) else e.stdout or "")
                + " (hangs)"
            )
        if done.returncode == 0:
            return None
        failed = re.findall(r"\[  FAILED  \] ([\w./]+)", done.stdout)
        return failed[0] if failed else last_started(done.stdout) + " (ends the program)"

    def judge(self, library, site):
        path, number, original, mutated = site
        file = self.folder / path.relative_to(ROOT)
        lines = path.read_text().splitlines()
        lines[number] = mutated
        file.write_text("\n".join(lines) + "\n")
        tests, *through = LIBRARIES[library][1:]
        try:
            if self.make(tests).returncode != 0:
                return "refused by the compiler"
            for name in tests:
                if failed := self.test(name):
                    return failed
            return self.through_programs(*through) if through else None
        finally:
            shutil.copyfile(path, file)


def last_started(text):
    started = re.findall(r"\[ RUN      \] ([\w./]+)", text)
    return started[-1] if started else "start"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", choices=LIBRARIES)
    parser.add_argument("--table", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build/mutation")
    options = parser.parse_args()
    equivalent = {}
    for line in (pathlib.Path(__file__).parent / "equivalent.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            file, mutated, reason = (part.strip() for part in line.split(" | "))
            equivalent[file, mutated] = reason
    libraries = [options.only] if options.only else list(LIBRARIES)
    draw = random.Random(options.seed)
    pools = {}
    for library in libraries:
        pools[library] = sites(library)
        draw.shuffle(pools[library])
    plan = [libraries[i % len(libraries)] for i in range(options.count)]

    everything = sorted({t for library in libraries for t in LIBRARIES[library][1]})
    workers = []
    for n in range(options.jobs):
        print(f"building copy {n + 1} of {options.jobs} ...", flush=True)
        workers.append(Worker(options.work.resolve() / f"copy-{n}", libraries))
        built = workers[-1].make(everything + sorted({p for l in libraries for p in (LIBRARIES[l][2:] or [[]])[0]}))
        if built.returncode != 0:
            sys.exit(built.stdout[-3000:])
    for name in everything:
        if failed := workers[0].test(name):
            sys.exit(f"{name} fails without a mutation: {failed}")
    for library in libraries:
        if (through := LIBRARIES[library][2:]) and (failed := workers[0].through_programs(*through)):
            sys.exit(f"{failed} fails without a mutation")

    rows, seen = [], set()

    def run(worker, library):
        while pools[library]:
            site = pools[library].pop()
            where = str(site[0].relative_to(ROOT))
            if (where, site[1]) in seen:
                continue
            seen.add((where, site[1]))
            if (where, site[3].strip()) in equivalent:
                continue
            caught = worker.judge(library, site)
            if caught != "refused by the compiler":
                return library, f"{where}:{site[1] + 1}", site[2].strip(), site[3].strip(), caught
        return None

    def loop(worker):
        while plan:
            library = plan.pop(0)
            if row := run(worker, library):
                rows.append(row)
                print(
                    f"{len(rows)}  {'caught by ' + row[4] if row[4] else 'SURVIVED'}  {row[1]}\n    {row[2]}\n    {row[3]}",
                    flush=True,
                )

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for done in [pool.submit(loop, w) for w in workers]:
            done.result()
    rows.sort()
    caught = sum(1 for r in rows if r[4])
    text = f"Seed {options.seed}: {caught} of {len(rows)} caught.\n\n| where | was | became | caught by |\n|---|---|---|---|\n"
    cell = lambda s: "`" + s.replace("|", "\\|") + "`"
    for _, where, was, became, by in rows:
        text += (
            f"| {where} | {cell(was)} | {cell(became) if became != ';' else 'left out'} | {by or '**survived**'} |\n"
        )
    print(text)
    if options.table:
        options.table.write_text(text)
    sys.exit(0 if caught >= 0.8 * len(rows) else 1)


if __name__ == "__main__":
    main()

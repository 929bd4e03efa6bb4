#!/usr/bin/env python3
"""Every console block of the pages is run, line by line and literally, as an ordinary user with an installed, read-only tree.

usage: check_docs_run.py SOURCE_DIR BUILD_DIR FIXTURES [--long] [--page NAME]... [--list]

Each page has a folder of its own, in which its blocks run in order. What a page takes as given (a scan, a case, a session) lies there under the name
that the page calls it by, made of the fixtures (GIVEN). A line that is not run stands in NOT_RUN with its reason; `--list` prints them. Lines that take
minutes are in LONG and run with --long. Lines that open a window are started without a screen: the program must be there, start, and say that it
has no screen. Exits 77 where nothing is installed."""

import json, os, pathlib, re, resource, shutil, subprocess, sys, tempfile, time

args = sys.argv[1:]
long_too, listing = "--long" in args, "--list" in args
only = [args[i + 1] for i, a in enumerate(args) if a == "--page"]
root, build, fixtures = (pathlib.Path(a).resolve() for a in args[:3])

# Page -> what it takes as given: name in the page, what it is. A name with a suffix is what its suffix says.
CASE, SESSION, SCAN, LABELS, MASK, TABLE = "case", "session", "dicom", "labels.nrrd", "mask.nrrd", "table"
GIVEN = {
    "README.md": {"DICOM_FOLDER": SCAN, "DICOM_DIR_OR_FILE": SCAN},
    "docs/how-to/batch.md": {"TABLE.csv": TABLE, "P.json": "pipeline"},
    "docs/guides/edit.md": {"CASE": "prepared"},  # where its scan is is known to whom prepared it
    "docs/validation/evidence.md": {"SESSION": SESSION, "EXPERTS": "sessions"},
    "docs/guides/imaging.md": {
        "DICOM_FOLDER": SCAN,
        "mask.nrrd": MASK,
        "tumour.stl": "body",
        "surface.stl": "body",
        "ct.nrrd": "ct",
        "structures.seg.nrrd": "structures",
        "jaw.nrrd": "ct",
        "problem.json": "pressed",
        "JAW": "folder",
    },
    "docs/guides/server.md": {"CT": SCAN, "INBOX": "folder", "CASES": "folder"},
    "docs/guides/planning.md": {"CASE": CASE},
    "docs/guides/surgeon.md": {"CASE": CASE},
    "docs/validation/monitor.md": {"ct.nrrd": "ct", "labels.nrrd": LABELS},
    "docs/how-to/movie.md": {"SESSION": SESSION},
    "docs/how-to/network.md": {"CASE": CASE, "SESSION": SESSION},
    "docs/how-to/pacs.md": {"CT": SCAN, "mask.nrrd": MASK},
    "docs/validation/registration.md": {
        "before.nrrd": "ct",
        "after.nrrd": "ct",
        "ct.nrrd": "ct",
        "mr.nrrd": "ct",
        "mr-labels.seg.nrrd": "structures",
    },
    "docs/how-to/review.md": {"SESSION": SESSION, "EXPERTS": "sessions", "MONDAY": SESSION, "TUESDAY": SESSION},
    "docs/how-to/segment-network.md": {"ct.nrrd": "network image", "MODEL_FOLDER": "network", "CASE": "folder"},
    "docs/guides/study.md": {"SESSION": SESSION},
    "docs/validation/tissue.md": {"FOLDER": "folder"},
    "docs/guides/tutoring.md": {"SESSION": SESSION, "CASE": CASE, "lesson.json": "script"},
    "docs/how-to/vtk.md": {"CT_FOLDER": SCAN, "CASE": "folder"},
}
# (page or "", what the line begins with or holds, why it is not run here)
NOT_RUN = [
    ("", r"^(cmake|ninja) |osteo bench", "builds osteo_bench, and takes minutes"),
    ("docs/validation/haptics.md", r"tables.md", "draws what osteo bench printed"),
    ("docs/how-to/python.md", r"^(apt-get|pip) ", "installs packages: the test python.pip"),
    ("docs/how-to/python.md", r"examples/", "the test python.examples"),
    ("docs/how-to/cluster.md", r"", "the tests readers.batch and readers.batch_slurm"),
    ("docs/how-to/packages.md", r"", "builds packages: the test setup.debs"),
    ("docs/platforms.md", r"", "builds all in a root of another distribution: by hand"),
    ("docs/validation/hard-cases.md", r"scoreboard", "gets other readers from PyPI"),
    ("docs/validation/planning.md", r"peers", "gets other programs from PyPI, for tables that take an hour"),
    ("docs/validation/robustness.md", r"", "hours, by hand"),
    ("docs/guides/surgeon.md", r"/etc/udev", "is root's"),
    ("docs/validation/ground-truth.md", r"mine.py|probe.traj", "another's program, another's recording"),
    (
        "docs/how-to/pacs.md",
        r"--peer|--dicomweb|--orthanc|osteo (receive|watch)",
        "needs a PACS, or waits for one: the tests pacs",
    ),
    ("docs/how-to/pacs.md", r"osteo score", "a rehearsal of that very case: the test readers.dicom_objects"),
    ("docs/guides/tutoring.md", r"osteo (tutor|join)", "two machines: the tests of tutor"),
    ("", r"osteo stream .*igtl", "waits for who listens: the test readers.network"),
    ("docs/guides/edit.md", r"--apply", "corrections that somebody made in the window: the test window.edit"),
    (
        "docs/guides/study.md",
        r"metrics.json|study (form|rate|analyse)",
        "sessions and ratings of people; LONG's demo does all of it",
    ),
    (
        "docs/guides/planning.md",
        r"osteo outcome",
        "a CT after surgery: stages.works runs it",
    ),
    ("docs/validation/structures.md", r"SCAN", "a scan of one's own"),
    ("docs/how-to/segment-network.md", r"neural/train/", "wants PyTorch, and most of an hour"),
    (
        "docs/validation/tissue.md",
        r"mesh.vtu|fem bone.inp|tissue.vtu",
        "a mesh, a problem and measurements of one's own",
    ),
    ("docs/validation/trainee.md", r"CASE|score", "a case with structures: stages.works runs simulate-trainee"),
]
LONG = [
    ("docs/how-to/segment-network.md", r"ear\.nrrd"),
    ("README.md", r"demo"),
    ("docs/guides/surgeon.md", r"jaw|session|phantom"),
    ("docs/guides/teacher.md", r""),
    ("docs/validation/phantom.md", r""),
    ("docs/validation/ground-truth.md", r""),
    ("docs/guides/experiments.md", r"demo|null"),
    ("docs/guides/study.md", r"demo"),
    ("docs/validation/trainee.md", r"demo"),
    ("docs/how-to/movie.md", r"--camera|raters"),
    ("docs/validation/structures.md", r""),
]
WINDOW = r"(^|/)osteo (edit|nerve-console|experiment force-skill|rehearse|playback) (?!.*(--headless|--apply|--simulated|--fast))"


def blocks(page):
    """(number, command, literal) of each line of the page's console blocks, continued lines joined."""
    lines, fenced, language, carried, first = page.read_text().splitlines(), False, "", "", 0
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("```"):
            fenced, language = not fenced, line.strip()[3:]
            continue
        inset = not fenced and re.match(
            r"    (?=(?:[A-Z_]+=\S+ )?(?:\./|osteo |cmake |pip |apt|/usr/bin/python3|snakemake |ninja ))", line
        )
        if (fenced and language in ("", "sh", "bash", "console")) or inset:
            first = number if not carried else first
            carried += line.strip().rstrip("\\") + (" " if line.endswith("\\") else "")
            if line.endswith("\\"):
                continue
            text, carried = carried.strip(), ""
            if re.match(
                r"(?:[A-Z_]+=\S+ )*(\./osteo|osteo|cmake|pip|apt|apt-get|python3|snakemake|ninja|cd|mkdir|apps/|tests/|/usr/bin/python3|echo|xvfb-run)\b",
                text,
            ):
                yield first, text


pages = [
    p for p in [root / "README.md", *(p for p in sorted((root / "docs").rglob("*.md")) if "reference" not in p.parts)]
]
todo = []
for page in pages:
    name = page.relative_to(root).as_posix()
    if only and name not in only:
        continue
    rows = []
    for number, command in blocks(page):
        why = next((w for p, pattern, w in NOT_RUN if p in ("", name) and re.search(pattern, command)), "")
        slow = any(p == name and re.search(pattern, command) for p, pattern in LONG)
        rows.append((number, command, why or ("takes minutes: --long" if slow and not long_too else "")))
    if rows:
        todo.append((name, rows))
if listing:
    for name, rows in todo:
        for number, command, why in rows:
            print(f"{name}:{number}: {why or 'run'}: {command}")
    sys.exit(0)

work = pathlib.Path(tempfile.mkdtemp(prefix="osteo-docs-"))
USER = 65534 if os.geteuid() == 0 else None  # nobody


def as_user():
    if USER is not None:
        os.setgroups([])
        os.setgid(USER)
        os.setuid(USER)


def run(command, cwd, timeout=600):
    env = {
        "PATH": f"{work}/prefix/bin:/usr/bin:/bin",
        "HOME": f"{work}/home",
        "LANG": "C.UTF-8",
        "TMPDIR": f"{work}/tmp",
    }
    return subprocess.run(
        ["bash", "-c", command],
        cwd=cwd,
        env=env,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
        preexec_fn=as_user,
        stdin=subprocess.DEVNULL,
    )


def own(path):
    if USER is None:
        return
    for p in [path, *path.rglob("*")]:
        os.chown(p, USER, USER, follow_symlinks=False)


def make(kind, at):
    """What a page takes as given, of this kind, under this name."""
    if kind == "folder":
        at.mkdir()
    elif kind in ("case", "dicom"):
        shutil.copytree(fixtures / kind, at)
    elif kind in ("session", "sessions"):  # a session names its case by the way there, so both lie together elsewhere
        beside = work / "given" / f"{at.parent.name}-{at.name}"
        shutil.copytree(fixtures / "case", beside / "case")
        for name in ["session"] if kind == "session" else ["session", "other"]:
            shutil.copytree(fixtures / "session", beside / name)
        if kind == "sessions":
            rows = [
                {"session": n, "subject": p, "group": g}
                for n, p, g in (("session", "P1", "expert"), ("other", "P2", "novice"))
            ]
            (beside / "reference.json").write_text(json.dumps({"osteotome_reference": 1, "sessions": rows}))
        own(beside)
        at.symlink_to(beside / "session" if kind == "session" else beside)
    elif kind == "prepared":
        own(at.parent)
        done = run(f"osteo prepare {fixtures}/ct.nrrd -o {at.name} --lower 500 --spacing-mm 1 --quiet", at.parent)
        assert done.returncode == 0, done.stderr
    elif kind == "network":
        shutil.copytree(root / "testdata/neural/plain", at)
    elif kind == "network image":
        shutil.copy(root / "testdata/neural/plain/image.nrrd", at)
    elif kind == "ct":
        shutil.copy(fixtures / "ct.nrrd", at)
    elif kind == "body":  # a box of 20 mm
        corner = lambda n: " ".join(str(20 * (n >> a & 1) - 10) for a in range(3))
        faces = [
            (0, 2, 3),
            (0, 3, 1),
            (4, 5, 7),
            (4, 7, 6),
            (0, 1, 5),
            (0, 5, 4),
            (2, 6, 7),
            (2, 7, 3),
            (0, 4, 6),
            (0, 6, 2),
            (1, 3, 7),
            (1, 7, 5),
        ]
        at.write_text(
            "solid box\n"
            + "".join(
                "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {corner(n)}\n" for n in f) + "endloop\nendfacet\n"
                for f in faces
            )
            + "endsolid box\n"
        )
    elif kind == "table":
        at.write_text(
            f"source,case,spacing_mm,lower\n{fixtures}/ct.nrrd,left-1,1,500\n{fixtures}/ct.nrrd,left-2,1,600\n"
        )
    elif kind == "pipeline":
        shutil.copy(root / "pipelines/temporal-bone.json", at)
    elif (fixtures / kind).is_file():
        shutil.copy(fixtures / kind, at)
    else:
        shutil.copy(made[kind], at)


wrong, ran, skipped, spent = [], 0, 0, []
try:
    os.chmod(work, 0o755)
    for component in ("server", "window", "camera"):
        done = subprocess.run(
            ["cmake", "--install", build, "--prefix", work / "prefix", "--component", component],
            capture_output=True,
            text=True,
        )
        if done.returncode:
            print(f"nothing can be installed of this build: {done.stderr[-400:]}")
            sys.exit(77)
    subprocess.run(["chmod", "-R", "a-w", work / "prefix"], check=True)
    for folder in ("home", "tmp", "pages", "made", "given"):
        (work / folder).mkdir()
        own(work / folder)
    os.chmod(work / "tmp", 0o1777)
    # What is made once for all pages.
    made = {}

    def prepare(kind, command):
        made[kind] = work / "made" / command.split()[-1]
        done = run(command, work / "made")
        assert done.returncode == 0, (command, done.stderr)

    wanted = {k for name, _ in todo for k in GIVEN.get(name, {}).values()}
    if "structures" in wanted:
        prepare(
            "structures",
            f"osteo structures {fixtures}/labels.nrrd --names '6=facial nerve, 7=sigmoid sinus' --quiet structures.seg.nrrd",
        )
    made["script"] = root / "pipelines/sessions/mastoid.json"
    made["pressed"] = root / "pipelines/tissue/pressed-bone.json"
    for name, rows in todo:
        here = work / "pages" / name.replace("/", "-")[:-3]
        here.mkdir()
        # What lies in a clone and a page calls by its place there; the program itself is the installed one.
        (here / "pipelines").symlink_to(work / "prefix/share/osteo/pipelines")
        (here / "testdata").symlink_to(root / "testdata")
        (here / "osteo").symlink_to(work / "prefix/bin/osteo")
        for given, kind in GIVEN.get(name, {}).items():
            make(kind, here / given)
        own(here)
        for number, command, why in rows:
            if why:
                skipped += 1
                # Of what lies on files of one's own nothing may be wrong but that they are not here.
                if "one's own" in why and (done := run(command, here)).returncode != 3:
                    wrong.append(
                        f"{name}:{number}: {command}\n    exit code {done.returncode}, not 3: {done.stderr[-600:]}"
                    )
                continue
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            window = re.search(WINDOW, command.split(" #")[0] + " ")
            try:
                done = run(command, here)
            except subprocess.TimeoutExpired:
                wrong.append(f"{name}:{number}: {command}\n    does not end")
                continue
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            ran += 1
            spent.append(
                (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, f"{name}:{number}: {command}")
            )
            print(f"{spent[-1][0]:6.1f} s  {done.returncode}  {spent[-1][1]}"[:200], flush=True)
            said = (done.stdout + done.stderr)[-600:]
            if window:
                if done.returncode == 0 or "display" not in said.lower():
                    wrong.append(
                        f"{name}:{number}: {command}\n    a window without a screen ends with {done.returncode} and says: {said}"
                    )
            elif done.returncode:
                wrong.append(f"{name}:{number}: {command}\n    exit code {done.returncode}: {said}")
finally:
    subprocess.run(["chmod", "-R", "u+w", work])
    shutil.rmtree(work, ignore_errors=True)
print(
    f"{ran} lines of {len(todo)} pages ran in {sum(s for s, _ in spent):.0f} s of processor time, {skipped} are not run (--list)"
)
print("\n".join(wrong) or "all of them did what the page says")
sys.exit(bool(wrong))

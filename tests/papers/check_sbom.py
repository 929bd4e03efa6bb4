#!/usr/bin/env python3
"""The list of what Osteotome is made of: a row for each package that is installed to build, no other; an SPDX document that hangs together; copyleft
only by its option; the same bytes twice. And the VEX file of the parts of a program: by CycloneDX's schema, with no
row that does not hold. usage: check_sbom.py SOURCE_DIR [PROGRAM]
"""

import gzip, json, os, pathlib, re, subprocess, sys, tempfile

root = pathlib.Path(sys.argv[1]).resolve()
os.environ["SOURCE_DATE_EPOCH"] = "1767225600"
rows = [
    [f.strip() for f in l.split("|")]
    for l in (root / "apps/packaging/licences.txt").read_text().splitlines()
    if l and l[0] != "#"
]
needed = [l for l in (root / "libs/cmake/packages.txt").read_text().split("\n") if l and l[0] != "#"]
named = [r[0] for r in rows]
bad = [f"apps/packaging/licences.txt has no row for {p}" for p in needed if p not in named]
bad += [f"apps/packaging/licences.txt: {p} is not in libs/cmake/packages.txt" for p in named if p not in needed]
bad += [f"apps/packaging/licences.txt: two rows for {p}" for p in set(named) if named.count(p) > 1]
# What every build links may not be under the GPL: that is what the options are for.
bad += [
    f"apps/packaging/licences.txt: {r[0]} is {r[1]} and in every build"
    for r in rows
    if r[2] in ("always", "OSTEO_WINDOW") and re.search(r"\bA?GPL", r[1])
]
# Each option of CMake that the licence depends on brings something.
options = re.findall(r"option\((OSTEO_(?:CGAL|TETGEN|CERES|MOVIE))", (root / "CMakeLists.txt").read_text())
bad += [f"no row of apps/packaging/licences.txt is brought by {o}" for o in options if o not in {r[2] for r in rows}]


def make(*flags, source=root):
    with tempfile.TemporaryDirectory() as work:
        out = pathlib.Path(work) / "s.json"
        said = subprocess.run(
            [sys.executable, source / "apps/packaging/sbom.py", out, "--version", "1.2.3", *flags],
            capture_output=True,
            text=True,
        )
        return (out.read_bytes(), "") if said.returncode == 0 else (None, said.stderr)


free, why = make()
full, _ = make("--with", *options)
if free is None:
    sys.exit(why)
if make()[0] != free:
    bad.append("the same inputs give other bytes")
free, full = json.loads(free), json.loads(full)
for document in (free, full):
    ids = [p["SPDXID"] for p in document["packages"]]
    if len(ids) != len(set(ids)) or not all(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", i) for i in ids):
        bad.append("identifiers of SPDX are doubled or malformed")
    for r in document["relationships"]:
        for end in ("spdxElementId", "relatedSpdxElement"):
            if r[end] not in ids and r[end] != "SPDXRef-DOCUMENT":
                bad.append(f"a relation to {r[end]}, which is not there")
    for key in ("spdxVersion", "dataLicense", "documentNamespace", "creationInfo"):
        if not document.get(key):
            bad.append(f"SPDX wants {key}")
top = {d["packages"][0]["licenseConcluded"] for d in (free,)}, full["packages"][0]["licenseConcluded"]
if top != ({"Apache-2.0"}, "AGPL-3.0-or-later"):
    bad.append(f"the licences as a whole are {top}")
# A row that cannot be read is told with its line.
with tempfile.TemporaryDirectory() as work:
    copy = pathlib.Path(work)
    (copy / "apps/packaging").mkdir(parents=True)
    (copy / "apps/packaging/sbom.py").write_text((root / "apps/packaging/sbom.py").read_text())
    (copy / "apps/packaging/licences.txt").write_text("# head\nlibx-dev | MIT | sometimes | nothing\n")
    out, why = make(source=copy)
    if out is not None or "licences.txt:2" not in why:
        bad.append(f"a wrong row is not told with its line: {why}")
# The libraries that a program loads, with Debian's versions.
if len(sys.argv) > 2:
    out, why = make("--program", sys.argv[2])
    if out is None:
        bad.append(why)
    else:
        linked = {
            r["relatedSpdxElement"] for r in json.loads(out)["relationships"] if r["relationshipType"] == "DYNAMIC_LINK"
        }
        seen = {p["name"]: p for p in json.loads(out)["packages"] if p["SPDXID"] in linked}
        if "libc6" not in seen or not any(n.startswith("libvtk9") for n in seen):
            bad.append(f"of {sys.argv[2]} these were found: {' '.join(seen)}")
        vtk = [p for n, p in seen.items() if n.startswith("libvtk9")]
        if vtk and (vtk[0]["licenseConcluded"] != "BSD-3-Clause" or vtk[0]["versionInfo"] == "NOASSERTION"):
            bad.append("VTK's library has no licence or version")


def vex(sbom, rows=None):
    """The VEX file of the program, or why there is none; `rows` in place of the checked-in assessments."""
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        (work / "s.json").write_bytes(sbom)
        flags = []
        if rows is not None:
            (work / "rows.txt").write_text(rows)
            flags = ["--assessments", work / "rows.txt"]
        tool = [sys.executable, root / "apps/packaging/vex.py", work / "v.json", "--sbom", work / "s.json"]
        said = subprocess.run([*tool, "--program", sys.argv[2], *flags], capture_output=True, text=True)
        return (work / "v.json").read_text() if said.returncode == 0 else None, said.stderr


schema = "no program"
if len(sys.argv) > 2 and out is not None:
    text, why = vex(out)
    if text is None:
        sys.exit(why)
    if vex(out)[0] != text:
        bad.append("the same VEX inputs give other bytes")
    found = json.loads(text)
    known = {c["bom-ref"]: c["name"] for c in found["components"]}
    if set(known.values()) != {p["name"] for p in json.loads(out)["packages"][1:] if p["versionInfo"] != "NOASSERTION"}:
        bad.append("the VEX file has other parts than the SBOM")
    state = {}
    for v in found["vulnerabilities"]:
        for a in v["affects"]:
            if a["ref"] not in known:
                bad.append(f"{v['id']} is of {a['ref']}, which is no part")
            state[v["id"], known.get(a["ref"])] = v["analysis"]["state"]
    # What Debian's changelog of an installed part says is there, and each row of ours whose part is.
    for part in (n for n in known.values() if n.startswith("libdcmtk")):
        changelog = pathlib.Path(f"/usr/share/doc/{part}/changelog.Debian.gz")
        named = (
            re.findall(r"CVE-\d+-\d+", gzip.decompress(changelog.read_bytes()).decode()) if changelog.exists() else []
        )
        if named and not any(state.get((c, part)) == "resolved" for c in named):
            bad.append(f"what the changelog of {part} names as mended is not in the VEX file")
    mine = [l.split("|") for l in (root / "apps/packaging/assessments.txt").read_text().splitlines() if l[:3] == "CVE"]
    for cve, part, said, *_ in ([f.strip() for f in r] for r in mine):
        if part in known.values() and state.get((cve, part)) != said.partition(":")[0]:
            bad.append(f"{cve} of {part} is {state.get((cve, part))} in the VEX file, {said} in assessments.txt")
    if not any(p in known.values() for _, p, *_ in ([f.strip() for f in r] for r in mine)):
        bad.append("no row of assessments.txt is of a part of the program")
    # A row that no longer holds is refused, and one that says nothing of what shows it.
    for evidence, wanted in (
        ("no library libvtkCommonCore", "does not hold"),
        ("no symbol gdcm::JPEG2000Codec", "does not hold"),
        ("no package libdcmtk", "does not hold"),
        ("test Objects.ThereIsNone", "does not hold"),
        ("-", "rows.txt:1"),
    ):
        row = f"CVE-2099-0001 | {next(n for n in known.values() if n.startswith('libdcmtk'))} | not_affected:code_not_reachable | {evidence} | invented"
        text_of_row, why = vex(out, row + "\n")
        if text_of_row is not None or wanted not in why:
            bad.append(f"a row with '{evidence}' is taken: {why}")
    try:
        from cyclonedx.schema import SchemaVersion
        from cyclonedx.validation.json import JsonStrictValidator

        schema = JsonStrictValidator(SchemaVersion.V1_5).validate_str(text)
        if schema is not None:
            bad.append(f"CycloneDX's schema: {schema}")
        schema = "by CycloneDX's schema"
    except ImportError:
        schema = "not held to CycloneDX's schema: there is no cyclonedx"
    schema = f"{len(found['vulnerabilities'])} vulnerabilities known of {len(known)} parts, {schema}"
print(
    "\n".join(bad)
    or f"{len(rows)} rows, {len(free['packages'])} components without options, {len(full['packages'])} with all; {schema}"
)
sys.exit(bool(bad))

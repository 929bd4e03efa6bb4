#!/usr/bin/env python3
"""Writes what is known of vulnerabilities of the parts as CycloneDX VEX. vex.py OUT --sbom FILE.spdx.json --program FILE ...

Two sources, and no network: the changelog that Debian installs with each part names what it mends ("resolved"), and apps/packaging/assessments.txt
says what was looked at here. Each row there names what shows it, which is looked for in the programs; one that does not hold ends in an error.
A vulnerability that neither names is not in the file, and a part of which neither says anything is marked so: nothing is claimed of it.
"""

import argparse, gzip, json, pathlib, re, sys, urllib.parse, uuid

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from sbom import created, root, run, table

STATES = ("in_triage", "exploitable")
JUSTIFICATIONS = ("code_not_present", "code_not_reachable", "protected_by_mitigating_control")
CVE = r"CVE-\d{4}-\d{4,}"


def assessments(path=root / "apps/packaging/assessments.txt"):
    out = []
    for number, fields in table(path):
        state, _, justification = fields[2].partition(":") if len(fields) == 5 else ("", "", "")
        evidence = (
            re.fullmatch(r"(no library|no symbol|no package|test) (.+)|-", fields[3]) if len(fields) == 5 else None
        )
        known = state in STATES and not justification or state == "not_affected" and justification in JUSTIFICATIONS
        # That something is not affected is not said without what shows it.
        if (
            not known
            or not evidence
            or not re.fullmatch(CVE, fields[0])
            or (state == "not_affected") == (fields[3] == "-")
        ):
            sys.exit(f"{path.name}:{number}: a row is: vulnerability | part | state | what shows it | why")
        names = [n.strip() for n in (evidence[2] or "").split(",")]
        out.append((fields[0], fields[1], state, justification, evidence[1], names, fields[4]))
    return out


def mended(package):
    """What the changelog of an installed package names, and whether there is one; what it takes back is left out."""
    folder = pathlib.Path("/usr/share/doc") / package
    for name in ("changelog.Debian.gz", "changelog.gz"):
        if (folder / name).is_file():
            lines = gzip.decompress((folder / name).read_bytes()).decode(errors="replace").splitlines()
            named = {c for l in lines for c in re.findall(CVE, l)}
            back = {c for l in lines if re.search(r"revert|not fixed|incomplete", l, re.I) for c in re.findall(CVE, l)}
            return named - back, True
    return set(), False


def main():
    p = argparse.ArgumentParser()
    p.add_argument("out")
    p.add_argument("--sbom", required=True)
    p.add_argument("--program", nargs="+", required=True)
    p.add_argument("--assessments", type=pathlib.Path, default=root / "apps/packaging/assessments.txt")
    a = p.parse_args()
    top, *parts = json.loads(pathlib.Path(a.sbom).read_text())["packages"]
    parts = [c for c in parts if c["versionInfo"] != "NOASSERTION" and c["supplier"] == "Organization: Debian"]
    names = {c["name"] for c in parts}
    loaded = {l.split()[0] for f in a.program for l in run("ldd", f).stdout.splitlines() if l.strip()}
    symbols = "".join(run("nm", "-DC", "--undefined-only", f).stdout for f in a.program)
    if not loaded or not symbols:
        sys.exit("the programs cannot be read by ldd and nm")

    def purl(c):
        return f"pkg:deb/debian/{c['name']}@{urllib.parse.quote(c['versionInfo'], safe='.-_~')}"

    tests = "".join(f.read_text() for f in (root / "tests/unit").rglob("*.cpp"))

    def holds(kind, name):
        if kind == "test":
            return f"TEST({name.replace('.', ', ')})" in tests
        if kind == "no symbol":
            return name not in symbols
        return not any(x.startswith(name) for x in (loaded if kind == "no library" else names))

    assessed = assessments(a.assessments)
    components, found = [], {}
    for c in parts:
        named, has = mended(c["name"])
        own = [r for r in assessed if r[1] == c["name"]]
        for vulnerability in named - {r[0] for r in own}:
            said = found.setdefault(
                (vulnerability, "resolved"),
                {
                    "id": vulnerability,
                    "analysis": {"state": "resolved", "detail": "Debian's changelog of the part names it as mended."},
                    "affects": [],
                },
            )
            said["affects"].append({"ref": purl(c)})
        for vulnerability, _, state, justification, kind, what, why in own:
            for name in what if kind else []:
                if not holds(kind, name):
                    sys.exit(f"{vulnerability} of {c['name']}: '{kind} {name}' does not hold")
            said = {"state": state, "detail": why[0].upper() + why[1:] + "."}
            if justification:
                said["justification"] = justification
            found[vulnerability, c["name"]] = {"id": vulnerability, "analysis": said, "affects": [{"ref": purl(c)}]}
        how = "Debian's changelog of this version" if has else "no changelog is installed"
        how += ", assessments.txt" if own else ""
        components.append(
            {
                "type": "library",
                "bom-ref": purl(c),
                "name": c["name"],
                "version": c["versionInfo"],
                "purl": purl(c),
                "properties": [{"name": "osteotome:vulnerabilities-known-from", "value": how}],
            }
        )
    vulnerabilities = [found[k] for k in sorted(found)]
    document = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": "urn:uuid:"
        + str(uuid.uuid5(uuid.NAMESPACE_URL, json.dumps([top["name"], components, vulnerabilities]))),
        "version": 1,
        "metadata": {
            "timestamp": created(),
            "component": {
                "type": "application",
                "bom-ref": top["name"],
                "name": top["name"],
                "version": top["versionInfo"],
            },
            "properties": [
                {
                    "name": "osteotome:not-in-this-file",
                    "value": "What Debian has not mended is not here: look the parts up in Debian's security tracker by their versions.",
                }
            ],
        },
        "components": components,
        "vulnerabilities": vulnerabilities,
    }
    partial = pathlib.Path(a.out + ".part")
    partial.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    partial.replace(a.out)


if __name__ == "__main__":
    main()

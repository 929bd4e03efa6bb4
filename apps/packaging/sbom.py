#!/usr/bin/env python3
"""Writes what Osteotome is made of as SPDX 2.3 JSON. sbom.py OUT --version V [--with OSTEO_CGAL ...] [--program FILE ...] [--package NAME]

Components and licences are the rows of apps/packaging/licences.txt. With --program the shared libraries that the program really loads are asked of
the loader (ldd) and of dpkg: each becomes a component with its Debian package and version; those that no row declares are NOASSERTION, never a guess.
The same inputs give the same bytes: the time is SOURCE_DATE_EPOCH or that of the commit."""

import argparse, datetime, hashlib, json, os, pathlib, re, subprocess, sys

root = pathlib.Path(__file__).resolve().parents[2]
OPTIONS = ("OSTEO_CGAL", "OSTEO_TETGEN", "OSTEO_CERES", "OSTEO_MOVIE", "OSTEO_WINDOW", "OSTEO_PYTHON")
# A library's package and the row of licences.txt it is built from, where the source package alone does not tell.
SAME_SOURCE = {"suitesparse": "libceres-dev"}


def table(path):
    """(number of the line, its fields) of each row that is no comment."""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line and not line.startswith("#"):
            yield number, [f.strip() for f in line.split("|")]


def rows(path=root / "apps/packaging/licences.txt"):
    out = []
    for number, fields in table(path):
        if len(fields) != 4 or not all(fields):
            sys.exit(f"{path.name}:{number}: a row is: package | licence | when | what for")
        if fields[2] not in OPTIONS + ("always", "runtime", "build", "test"):
            sys.exit(f"{path.name}:{number}: '{fields[2]}' is neither an option nor always, runtime, build or test")
        out.append(dict(zip(("package", "licence", "when", "purpose"), fields)))
    return out


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})


def spdx_id(name):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def created():
    epoch = (
        os.environ.get("SOURCE_DATE_EPOCH")
        or run("git", "-c", "safe.directory=*", "-C", str(root), "log", "-1", "--format=%ct").stdout.strip()
        or "0"
    )
    return datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")


def dpkg(*names):
    """package -> (version, source package) of what is installed."""
    out = {}
    for line in run(
        "dpkg-query", "-W", "-f", "${Package}\t${Version}\t${source:Package}\n", *names
    ).stdout.splitlines():
        package, version, source = line.split("\t")
        if version:
            out[package] = (version, source)
    return out


def owners(paths):
    """Debian packages that files belong to, and the files that belong to none."""
    # Debian 12 knows a library below /lib or below /usr/lib. All are asked for at once: dpkg reads its lists each time.
    names = {
        path: {path, os.path.realpath(path), re.sub(r"^/usr", "", os.path.realpath(path)), "/usr" + path}
        for path in paths
    }
    owner = {}
    for line in run("dpkg", "-S", *sorted(set().union(*names.values()))).stdout.splitlines():
        package, _, path = line.rpartition(": ")
        owner[path] = package.split(":")[0]
    packages, unowned = set(), set()
    for path, known in names.items():
        found = sorted(owner[n] for n in known if n in owner)
        packages.add(found[0]) if found else unowned.add(path)
    return packages, unowned


def loaded_packages(program):
    """Debian packages of the shared libraries that the loader gives a program, and the names of those that belong to none."""
    said = run("ldd", str(program))
    if said.returncode:
        sys.exit(f"{program}: ldd cannot read it: {said.stderr.strip()}")
    paths, strange = set(), set()
    for line in said.stdout.splitlines():
        if "not found" in line:
            strange.add(line.split()[0])
        elif m := re.search(r"=> (/\S+)", line):
            paths.add(m[1])
    packages, unowned = owners(paths)
    return packages, strange | {os.path.basename(p) for p in unowned}


def component(name, version, licence, comment, supplier="Organization: Debian"):
    return {
        "SPDXID": spdx_id(name),
        "name": name,
        "versionInfo": version or "NOASSERTION",
        "supplier": supplier,
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": licence,
        "licenseDeclared": licence,
        "copyrightText": "NOASSERTION",
        "comment": comment,
    }


def main():
    p = argparse.ArgumentParser()
    p.add_argument("out")
    p.add_argument("--version", required=True)
    p.add_argument("--package", default="osteo")
    p.add_argument("--with", dest="options", nargs="*", default=[], choices=OPTIONS)
    p.add_argument("--program", nargs="*", default=[])
    a = p.parse_args()
    used = [r for r in rows() if r["when"] in ("always", "runtime") or r["when"] in a.options]
    copyleft = [r for r in used if re.search(r"\bA?GPL", r["licence"])]
    whole = "Apache-2.0"
    if copyleft:
        whole = "AGPL-3.0-or-later" if any("AGPL" in r["licence"] for r in copyleft) else "GPL-3.0-or-later"
    top = component(
        a.package,
        a.version,
        whole,
        "Own sources: Apache-2.0."
        + (
            " As a whole under "
            + whole
            + ", because of "
            + ", ".join(f"{r['package']} ({r['when']})" for r in copyleft)
            + "."
            if copyleft
            else ""
        ),
        "Organization: Osteotome contributors",
    )
    top["licenseDeclared"] = "Apache-2.0"
    installed = dpkg(*[r["package"] for r in used])
    packages, relations = [top], [
        {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": top["SPDXID"]}
    ]
    by_source = {source: r for r in used for _, source in [installed.get(r["package"], ("", ""))] if source}
    for source, package in SAME_SOURCE.items():
        row = [r for r in used if r["package"] == package]
        if row:
            by_source[source] = row[0]

    def add(c, kind):
        packages.append(c)
        relations.append({"spdxElementId": top["SPDXID"], "relationshipType": kind, "relatedSpdxElement": c["SPDXID"]})

    for r in used:
        brought = (
            "in every build"
            if r["when"] == "always"
            else "loaded when the program runs" if r["when"] == "runtime" else f"brought by {r['when']}"
        )
        add(
            component(r["package"], installed.get(r["package"], ("",))[0], r["licence"], f"{r['purpose']}; {brought}"),
            "DEPENDS_ON" if r["when"] == "runtime" else "BUILD_DEPENDENCY_OF",
        )
        if r["when"] != "runtime":  # x BUILD_DEPENDENCY_OF y reads from x to y
            relations[-1].update(spdxElementId=spdx_id(r["package"]), relatedSpdxElement=top["SPDXID"])
    libraries, strange = set(), set()
    for program in a.program:
        found, odd = loaded_packages(program)
        libraries |= found
        strange |= odd
    if strange:
        sys.exit("these libraries belong to no Debian package: " + ", ".join(sorted(strange)))
    versions = dpkg(*libraries) if libraries else {}
    named = {r["package"] for r in used}
    for name in sorted(libraries - named):
        version, source = versions.get(name, ("", ""))
        row = by_source.get(source)
        add(
            component(
                name,
                version,
                row["licence"] if row else "NOASSERTION",
                f"shared library that is loaded; of the source package {source}"
                + ("" if row else "; /usr/share/doc/" + name + "/copyright says its licence"),
            ),
            "DYNAMIC_LINK",
        )
    body = json.dumps(packages, sort_keys=True)
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"{a.package}-{a.version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/{a.package}-{a.version}-{hashlib.sha256(body.encode()).hexdigest()[:32]}",
        "creationInfo": {"created": created(), "creators": ["Tool: osteotome-sbom"]},
        "packages": packages,
        "relationships": relations,
        "hasExtractedLicensingInfos": [],
    }
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    if a.out == "-":
        sys.stdout.write(text)
    else:
        partial = pathlib.Path(a.out + ".part")
        partial.write_text(text)
        partial.replace(a.out)


if __name__ == "__main__":
    main()

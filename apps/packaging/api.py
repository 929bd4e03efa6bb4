#!/usr/bin/env python3
"""The public headers as pages, by Doxygen, without network, and checked. apps/packaging/api.py OUT

Grouped by component and library as libs/layers.txt and docs/how-to/library.md have them. Every class, struct and enum of a public header must have a page,
every example be shown, links inside lead somewhere and nothing be fetched from elsewhere: else it fails. OUT/osteo.tag is for the Doxygen of others.
"""

import os, pathlib, re, shutil, subprocess, sys, tempfile
import xml.etree.ElementTree

from html_pages import check_pages

root = pathlib.Path(__file__).resolve().parents[2]
LOOK = pathlib.Path("/usr/share/doxygen-awesome-css")  # Debian's doxygen-awesome-css; without it Doxygen's own look
DOXYFILE = root / "apps/packaging/Doxyfile"


def rows(page, heading):
    """Of the table in a page of docs/ whose first column is called so."""
    lines = (root / page).read_text().splitlines()
    at = next(i for i, l in enumerate(lines) if l.startswith(f"| {heading} |"))
    for line in lines[at + 2 :]:
        if not line.startswith("|"):
            return
        yield [c.strip() for c in line.split("|")[1:-1]]


def plain(text):
    """A cell without links and backquotes: paths in it are of the repository."""
    text = re.sub(r"\s*\(\[[^\]]*\]\([^)]*\)\)", "", text)
    text = re.sub(r";?\s*\[[^\]]*\]\([^)]*\)", "", text)
    return text.replace("`", "").replace("()", "")


layers = (root / "libs/layers.txt").read_text()
# Their headers are for Osteotome's programs and have no pages.
programs = re.search(r"^programs: (.*)$", layers, re.M)[1].split()


def headers():
    return [
        h for h in sorted(root.glob("libs/*/*/include/**/*.h")) if h.relative_to(root / "libs").parts[1] not in programs
    ]


def groups():
    """Components with what they hold, as Doxygen's groups."""
    holds = {r[0]: plain(r[2]) for r in rows("docs/developer/architecture.md", "library")}
    libraries, of = [], {}
    for line in layers.splitlines():
        if line.startswith("== "):
            area = line.split()[1]
            of[area] = []
        elif line and line[0] != "#" and ":" not in line and line.split()[0] not in programs:
            libraries.append(line.split()[0])
            of[area].append(libraries[-1])
    components = []  # name, what its example shows, its file, libraries
    for name, _, example in rows("docs/how-to/library.md", "component"):
        name = name.strip("`")
        file, shows = re.sub(r"^\[([^\]]*)\]\([^)]*\)", r"\1", example).split(": ", 1)
        components.append((name, shows, file, of.get(name, [name])))
    own = {
        held[0] for name, *_, held in components if name not in of
    }  # a library that is a component stands there alone
    components = [(n, s, f, [l for l in held if n not in of or l not in own]) for n, s, f, held in components]
    placed = {l for *_, held in components for l in held}
    components.append(("others", "", "", [l for l in libraries if l not in placed]))

    area_of = {l: a for a, held in of.items() for l in held}
    text = [
        "// Made by apps/packaging/api.py.",
        "/// @namespace osteo\n/// Everything; what stands in it is grouped by component and library.",
    ]
    for name, shows, file, held in components:
        if name == "others":
            text.append(
                "/// @defgroup component_others Libraries by their own name\n"
                "/// What no component has is asked for by its own name: `find_package(osteo COMPONENTS base)`. "
                "What belongs to the programs (libs/layers.txt) is not installed."
            )
        else:
            text.append(
                f"/// @defgroup component_{name} Component {name}\n/// Component `{name}`, target `osteo::{name}`. "
                f"An example, which the test `install` compiles and runs: {shows}.\n/// @include {file}"
            )
        text += [
            f"/// @defgroup lib_{lib} {lib}\n/// @ingroup component_{name}\n/// Holds: {holds.get(lib, '')}.\n///\n"
            f"/// Target `osteo::{lib}`, headers `osteo/{area_of[lib]}/{lib}/`."
            for lib in held
        ]
    main = [
        "@mainpage The libraries of Osteotome",
        "",
        "C++20; lengths are millimetres, coordinates LPS, and names carry units. How a program comes by the libraries is in docs/how-to/library.md:",
        "@code{.cmake}",
        "find_package(osteo REQUIRED COMPONENTS imaging haptics)",
        "target_link_libraries(mine PRIVATE osteo::imaging osteo::haptics)",
        "@endcode",
        "",
        "| component | libraries |",
        "|---|---|",
    ]
    for name, _, _, held in components:
        shown = "by their own names" if name == "others" else name
        main.append(f'| @ref component_{name} "{shown}" | ' + ", ".join(f"@ref lib_{l}" for l in held) + " |")
    main += [
        "",
        "What a function may throw is osteo::Error, with the exit code of the programs and what to do about it. Values in osteo::Data do not change once "
        "they are made, and are shared.",
    ]
    text.append("\n".join(f"/// {l}".rstrip() for l in main))
    return "\n\n".join(text) + "\n", components


def stage(into):
    """The headers, each in the group of its library: its first comment is what the file holds, what is in the namespace is in the group."""
    for header in headers():
        area, lib = header.relative_to(root / "libs").parts[:2]
        to = into / header.relative_to(root / "libs" / area / lib / "include")
        lines = header.read_text().splitlines()
        top = next((i for i, l in enumerate(lines) if not l.startswith("// ")), 0)
        if top:
            lines[:top] = [("/// @file\n" if i == 0 else "") + "/" + l for i, l in enumerate(lines[:top])]
        for i, line in enumerate(lines):
            if re.match(r"namespace osteo(::inline \w+)?(::\w+)* \{$", line):
                # One that only declares types of another area holds nothing.
                holds = not re.match(
                    r"(?:\s*(?:class|struct) \w+;)+\s*\}$", "\n".join(lines[i + 1 : i + 6]).split("}")[0] + "}"
                )
                lines[i] = line = line.replace("::inline ", "::")  # which Doxygen does not know
                if holds:
                    lines[i] = line + f"\n/** @addtogroup lib_{lib}\n * @{{ */"
            elif re.match(r"\}  // namespace osteo(::inline \w+|::\w+)*$", line) and holds:
                lines[i] = "/** @} */\n" + line
            elif m := re.match(r"/// @class (vtk\w+)", line):
                lines[i] = f"{line}\n/// @ingroup lib_{lib}"
        # Outside of `code`, <word> is no tag and #word no link.
        for i, line in enumerate(lines):
            code, slashes, said = line.partition("///")
            if slashes:
                said = re.sub(
                    r"`[^`]*`|<(?=[A-Za-z]+[ >])|#(?=\w)", lambda m: m[0] if m[0][0] == "`" else "\\" + m[0], said
                )
                lines[i] = code + slashes + said
        to.parent.mkdir(parents=True, exist_ok=True)
        to.write_text("\n".join(lines) + "\n")


def check(site, components):
    # Of a class whose only inner one is private Doxygen links a list that it then leaves out: nested-classes; of a group with an enum without a name likewise enumval-members.
    bad, pages, links = check_pages(
        site, lambda _, target, lost: not lost and target.endswith(("#nested-classes", "#enumval-members"))
    )
    # What the headers declare, against what has a page or a place in one.
    tags = xml.etree.ElementTree.parse(site / "osteo.tag").getroot()
    known = {
        c.findtext("name").split("::")[-1].split("<")[0].strip()
        for c in tags.iter("compound")
        if c.get("kind") in ("class", "struct", "union") and (site / (c.findtext("filename") or "")).is_file()
    }
    known |= {m.findtext("name") for m in tags.iter("member") if m.get("kind") == "enumeration"}
    grouped = {c.findtext("name"): c for c in tags.iter("compound") if c.get("kind") == "group"}
    declared = 0
    for header in headers():
        for name in re.findall(r"^(?:class|struct|enum class|enum)\s+(\w+)[^;<]*?\{", header.read_text(), re.M):
            declared += 1
            if name not in known:
                bad.append(f"{header.relative_to(root)}: {name} has no page")
    for name, *_, held in components:
        for group in [f"component_{name}", *(f"lib_{lib}" for lib in held)]:
            if group not in grouped:
                bad.append(f"no group {group}")
        example = site / f"group__component__{name.replace('_', '__')}.html"
        if name != "others" and example.exists() and 'class="fragment"' not in example.read_text():
            bad.append(f"component {name}: its example is not shown")
    return bad, pages, links, declared


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: apps/packaging/api.py OUT")
    if shutil.which("doxygen") is None:
        print(
            "doxygen is not here: apt-get install --no-install-recommends doxygen doxygen-awesome-css", file=sys.stderr
        )
        sys.exit(77)
    out = pathlib.Path(sys.argv[1]).resolve()
    if out.exists() and any(out.iterdir()) and not (out / "osteo.tag").exists():
        sys.exit(f"{out} holds something else than these pages; give an empty folder")
    with tempfile.TemporaryDirectory(prefix="osteo-api-") as work:
        work = pathlib.Path(work)
        stage(work / "include")
        text, components = groups()
        (work / "include/groups.dox").write_text(text)
        version = re.search(r"project\(osteotome VERSION (\S+)", (root / "CMakeLists.txt").read_text())[1]
        look = [LOOK / "doxygen-awesome.css", LOOK / "doxygen-awesome-sidebar-only.css"]
        more = f"HTML_EXTRA_STYLESHEET = {' '.join(map(str, look))}\n" if all(p.exists() for p in look) else ""
        (work / "Doxyfile").write_text(DOXYFILE.read_text() + f"""
PROJECT_NUMBER = {version}
INPUT = {work}/include
STRIP_FROM_PATH = {work}/include
STRIP_FROM_INC_PATH = {work}/include
EXAMPLE_PATH = {root}/tests/setup/outside
OUTPUT_DIRECTORY = {work}
GENERATE_TAGFILE = {work}/html/osteo.tag
WARN_LOGFILE = {work}/warnings
{more}""")
        (work / "html").mkdir()
        said = subprocess.run(
            ["doxygen", work / "Doxyfile"],
            capture_output=True,
            text=True,
            cwd=work,
            env={**os.environ, "LC_ALL": "C.UTF-8"},
        )
        if said.returncode:
            sys.exit(said.stdout[-2000:] + said.stderr)
        warned = [l.replace(f"{work}/include/", "") for l in (work / "warnings").read_text().splitlines() if l.strip()]
        bad, pages, links, declared = check(work / "html", components)
        if bad or warned:
            sys.exit("\n".join([*warned[:40], *bad[:40], f"{len(warned)} warnings of Doxygen, {len(bad)} errors"]))
        if out.exists():
            shutil.rmtree(out)
        shutil.copytree(work / "html", out)
    print(
        f"{out}/index.html: {declared} classes, structs and enums, {len(components) - 1} components, {pages} pages, {links} links inside, none broken, "
        "nothing fetched from elsewhere"
    )


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Words that docs/glossary.md no longer uses, counted in what users read. usage: check_language.py SOURCE_DIR [--write]

Words in `code marks` in the glossary's last column are looked for in the help texts (docs/reference), in string literals of the window, of other
libraries and programs, and in the pages of docs: none may be left there. Keys and names in files, which programs of others read, are counted by themselves;
there the count may only fall: tests/papers/language.txt holds what is left, --write writes it. A flag's help may not begin with a word that leans on another flag.
"""

import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
kept = root / "tests/papers/language.txt"
words = []
for line in (root / "docs/glossary.md").read_text().splitlines():
    cells = [c.strip() for c in line.strip().strip("|").split("|")]
    if len(cells) == 4 and cells[0] not in ("term", "---"):
        words += re.findall(r"`([^`]+)`", cells[3])
words = sorted(set(words))
if len(words) < 20:
    sys.exit("docs/glossary.md lists hardly a word that is no longer used: has its table changed?")
finder = re.compile(
    r"(?<![\w-])(" + "|".join(sorted(map(re.escape, words), key=len, reverse=True)) + r")(?![\w-])", re.I
)
literal = re.compile(r'R"(\w*)\((.*?)\)\1"|"((?:\\.|[^"\\\n])*)"', re.S)


# A literal that is one lower-case word is a key or a name in files; so is one within a text of JSON or HTML.
name_in_file = re.compile(r"[a-z][a-z0-9_]*")
inner_key = re.compile(r'\\"([a-z][a-z0-9_]*)\\":|data-\w+=\\"([a-z ]*)\\"')


def strings(folders, keys=False):
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                text = re.sub(r"^\s*#include.*$|//.*$", "", path.read_text(), flags=re.M)
                if path.name == "commands.cpp":  # the second of a row is what a command is found by: old names too
                    text = re.sub(r'(\{(?:tr_later\()?"[^"]*"\)?,\s+(?:tr_later\()?)"[^"]*"', r'\1""', text)
                # Names of before are accepted, and stand in tables called so.
                text = re.sub(r"\bkOld\w*[^;]*;", "", text)
                found = [m[2] or m[3] or "" for m in literal.finditer(text)]
                if keys:
                    inner = [m[1] or m[2] or "" for s in found for m in inner_key.finditer(s)]
                    yield " \n ".join([s for s in found if name_in_file.fullmatch(s)] + inner)
                else:
                    yield " \n ".join(inner_key.sub("", s) for s in found if not name_in_file.fullmatch(s))


def pages(folder):
    for path in sorted((root / folder).rglob("*.md")):
        name = path.relative_to(root).as_posix()
        if name == "docs/glossary.md" or (
            folder == "docs" and name.startswith(("docs/reference", "docs/developer/adr"))
        ):
            continue
        yield re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", "", path.read_text(), flags=re.S)


places = {
    "help": pages("docs/reference"),
    "window": strings(["libs/app/window"]),
    "messages": strings(
        [
            *(
                f"libs/{a.name}"
                for a in sorted((root / "libs").iterdir())
                if a.is_dir() and a.name not in ("app", "cmake")
            ),
            "libs/app/cli",
            "libs/app/stages",
            "libs/app/vtk",
            "apps",
        ]
    ),
    "docs": pages("docs"),
    "keys": strings(["libs", "apps"], keys=True),
}
counts = {}
for place, texts in places.items():
    for text in texts:
        for m in finder.finditer(text):
            key = (place, m[1].lower())
            counts[key] = counts.get(key, 0) + 1
if "--write" in sys.argv:
    kept.write_text(
        "# place word count: what is left of the words that docs/glossary.md no longer uses; check_language.py --write\n"
        + "".join(f"{p}\t{w}\t{n}\n" for (p, w), n in sorted(counts.items()) if p == "keys")
    )
allowed = {}
for line in kept.read_text().splitlines():
    if line and line[0] != "#":
        place, word, n = line.split("\t")
        allowed[place, word] = int(n)
if strict := [k for k in allowed if k[0] != "keys"]:
    sys.exit(f"tests/papers/language.txt may hold keys only, not {strict}")
bad = [
    f"{p}: '{w}' {n} times, {allowed.get((p, w), 0)} were left; docs/glossary.md has the term that is used for it"
    for (p, w), n in sorted(counts.items())
    if n > allowed.get((p, w), 0)
]
# Each flag's help stands alone: in completion, in Slicer and in a schema nothing stands above it.
leaning = re.compile(
    r"(of|with it|with --\S+,|with|in it|in the window|its|it|that|they|them|for|between|from|at once|on|by|as in|below|beside|behind|in place of|without)\b",
    re.I,
)
for path in sorted((root / "docs/reference").glob("*.md")):
    for line in path.read_text().splitlines():
        cells = line.strip("|").split(" | ")
        if line.startswith("| `--") and leaning.match(cells[-1].strip()):
            bad.append(
                f"{path.name}: {cells[0]}: the help '{cells[-1].strip(' |')}' leans on something that is not there: begin with what it is"
            )
fallen = [
    f"{p} '{w}' {n} -> {counts.get((p, w), 0)}" for (p, w), n in sorted(allowed.items()) if n > counts.get((p, w), 0)
]
if fallen:
    print(
        "fewer are left than tests/papers/language.txt says; python3 tests/papers/check_language.py . --write:",
        ", ".join(fallen),
    )
print("\n".join(bad) or f"{len(words)} words that are no longer used, {sum(counts.values())} of them left")
sys.exit(bool(bad))

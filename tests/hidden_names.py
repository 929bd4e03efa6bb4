#!/usr/bin/env python3
"""No source of a library hides a constant that a header of another area has. usage: hidden_names.py SOURCE_DIR

Sources of a library are compiled several as one, in the namespace of their area. A name in an unnamed namespace of one of them is then found by the
others before a name of an area above, without a word from the compiler where both are numbers. (Functions and types of one name do not compile.)
"""

import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
token = re.compile(
    r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/|^[ \t]*#(?:\\\n|[^\n])*',
    re.S | re.M,
)


def declared(text):
    """(name, in an unnamed namespace?) of constants, enumerators, functions, types and aliases at namespace scope."""
    text = token.sub(lambda m: '""' if m[0][0] in 'R"' else " ", text)
    scopes, statement, found = [], "", []  # scopes: "named", "unnamed", "enum" or "other"
    for part in re.split(r"([{};])", text):
        if part not in "{};" or part == "":
            statement += part
            continue
        head = statement.strip()
        outer = all(s in ("named", "unnamed") for s in scopes)
        unnamed = "unnamed" in scopes
        if part == "{":
            m = re.match(r"(?:inline )?namespace\b\s*([\w: ]*)$", head)
            kind = ("other" if "detail" in m[1] else "named" if m[1].strip() else "unnamed") if m else "other"
            if outer and not m:
                e = re.match(r"enum\b(?!\s+(?:class|struct)\b)", head)
                if e:
                    kind = "enum" + ("!" if unnamed else "")
                name_of(head, unnamed, found)
            scopes.append(kind)
        elif part == "}":
            kind = scopes.pop() if scopes else ""
            if kind.startswith("enum"):
                found += [(n, kind.endswith("!")) for n in re.findall(r"(?:^|,)\s*(\w+)", head)]
        elif outer and head:
            name_of(head, unnamed, found)
        statement = ""
    return found


def name_of(head, unnamed, found):
    head = re.sub(r"\[\[[^\]]*\]\]", " ", head)
    head = re.sub(r"^\s*template\s*<[^{}]*?>\s*(?=[a-z\[])", "", head)
    if re.match(r"\s*(using namespace|friend|static_assert|return|if|for|while|extern)\b", head):
        return
    if m := re.match(r"\s*using (\w+) =", head):
        found.append((m[1], unnamed))
    elif m := re.match(r"\s*(?:struct|class|enum(?: class)?|union)\s+(\w+)", head):
        found.append((m[1], unnamed))
    elif m := re.match(r"[\w:<>,&*\s\[\]]*?[\s&*>](\w+)\s*\(", head):
        if not re.search(r"::\s*%s\s*\($" % m[1], head[: m.end()]) and m[1] not in ("operator", "decltype", "noexcept"):
            found.append((m[1], unnamed))
    elif m := re.match(
        r"\s*(?:inline\s+|static\s+|thread_local\s+|const\s+|constexpr\s+)*[\w:<>,&*\s]+?[\s&*>](\w+)\s*(?:=|\[|$)",
        head,
    ):
        found.append((m[1], unnamed))


public = {}  # name -> areas and headers
for header in root.glob("libs/*/*/include/**/*.h"):
    area = header.relative_to(root).parts[1]
    for name, unnamed in declared(header.read_text()):
        if not unnamed:
            public.setdefault(name, {}).setdefault(area, header.name)
areas = {}
for line in (root / "libs/layers.txt").read_text().splitlines():
    if m := re.match(r"== (\w+) \|(.*)", line):
        areas[m[1]] = m[2].split()
bad, looked = [], 0
for path in sorted(root.glob("libs/*/*/src/*")):
    if path.suffix not in (".cpp", ".h"):
        continue
    area = path.relative_to(root).parts[1]
    for name in sorted({n for n, _ in declared(path.read_text()) if re.match(r"k[A-Z]", n)}):
        looked += 1
        others = [a for a in public.get(name, {}) if a in areas[area]]
        if others:
            bad.append(
                f"{path.relative_to(root)}: {name} hides that of {others[0]} ({public[name][others[0]]}): give it another name"
            )
if "kEscape" not in public or looked < 500:
    sys.exit(f"only {looked} names looked at: this test sees nothing")
print("\n".join(bad) or f"{looked} constants of sources hide none of {len(public)} names of headers")
sys.exit(bool(bad))

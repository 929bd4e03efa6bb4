#!/usr/bin/env python3
"""Each risk of docs/intended-use.md has tests, and each test named there is one. usage: check_risks.py SOURCE_DIR"""

import pathlib, re, sys

root = pathlib.Path(sys.argv[1])
page = root / "docs/intended-use.md"
tests = {
    f"{m[1]}.{m[2]}"
    for p in (root / "tests/unit").rglob("*.cpp")
    for m in re.finditer(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", p.read_text(), re.M)
}
cmake = (root / "tests/CMakeLists.txt").read_text()
tests |= set(re.findall(r"osteo_test\(NAME ([\w.]+)", cmake))
tests |= {f"pacs.{part}" for part in re.search(r"foreach\(part ([\w ]+)\)\s+osteo_test\(NAME pacs\.", cmake)[1].split()}


def wrong(text):
    """What is wrong with the table of a page."""
    table = text.split("| risk |", 1)[1].split("\n\n", 1)[0].splitlines()[2:]
    bad = []
    for row in table:
        risk, _, names, _ = (c.strip() for c in row.strip("|").split("|"))
        named = re.findall(r"`([^`]+)`", names)
        bad += [] if named else [f"'{risk}': no test"]
        bad += [
            f"'{risk}': there is no test {n}"
            for n in named
            if not any(t == n or (n.endswith(".*") and t.startswith(n[:-1])) for t in tests)
        ]
    return bad if table else ["no risk at all"]


text = page.read_text()
# What it would say of a page that is wrong.
planted = text.replace("`Audit.*`, `pacs.audit`", "`Audit.NeverWritten`").replace(
    "`pacs.deidentify`, `pacs.tls`, `RolesTest.*`", "by hand"
)
assert len(wrong(planted)) == 2, wrong(planted)
if bad := wrong(text):
    sys.exit("\n".join(f"docs/intended-use.md: {b}" for b in bad))
print(
    f"{text.split('| risk |', 1)[1].split(chr(10) * 2, 1)[0].count(chr(10)) - 1} risks, each with tests that are there"
)

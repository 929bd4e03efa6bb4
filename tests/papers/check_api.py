#!/usr/bin/env python3
"""The reference of the libraries builds and is whole (apps/packaging/api.py judges itself); what the components' examples use has pages that say where it
stands; without Doxygen it says what to install. usage: check_api.py SOURCE_DIR OUT"""

import os, pathlib, re, shutil, subprocess, sys, tempfile
import xml.etree.ElementTree

root, out = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
api = root / "apps/packaging/api.py"

with tempfile.TemporaryDirectory() as empty:
    said = subprocess.run([sys.executable, api, out], env={**os.environ, "PATH": empty}, capture_output=True, text=True)
    assert said.returncode == 77 and "apt-get install" in said.stderr and "doxygen" in said.stderr, said
if shutil.which("doxygen") is None:
    print(said.stderr.strip())
    sys.exit(77)

said = subprocess.run([sys.executable, api, out], capture_output=True, text=True)
if said.returncode:
    sys.exit(said.stdout + said.stderr)
print(said.stdout.strip())

# Classes as examples name them: osteo::Name, in the language of the tag file.
tags = xml.etree.ElementTree.parse(out / "osteo.tag").getroot()
page = {
    c.findtext("name"): out / c.findtext("filename")
    for c in tags.iter("compound")
    if c.get("kind") in ("class", "struct")
}
# Namespaces of areas are inline: programs leave them out.
areas = "|".join(p.parent.name for p in root.glob("libs/*/README.md"))
page |= {re.sub(rf"^osteo::(?:{areas})::", "osteo::", name): file for name, file in page.items()}
shown = {}
for example in sorted((root / "tests/setup/outside").glob("*.cpp")):
    names = sorted(n for n in set(re.findall(r"osteo::(?:\w+::)*[A-Z]\w+", example.read_text())) if n in page)
    for name in names:
        text = page[name].read_text()
        assert re.search(r'#include &lt;.*osteo/\w+/', text), f"{name}: its page does not say which header to include"
        assert re.search(r'class="ingroups".*group__lib__', text), f"{name}: its page is in no library's group"
    shown[example.stem] = names
for component, least in ("haptics", {"osteo::BrickGrid", "osteo::HapticRenderer"}), (
    "geometry",
    {"osteo::TriangleTree"},
):
    assert least <= set(shown[component]), (component, shown[component])
# What a header says is on the page: words above a class, and behind a member.
text = page["osteo::ContactModel"].read_text()
assert "one way from pose to force" in text
assert "mm" in page["osteo::ContactParams"].read_text()
# A header that has an error is not let through.
with tempfile.TemporaryDirectory() as scratch:
    copy = pathlib.Path(scratch)
    for part in ("apps/packaging", "libs", "docs", "tests/setup/outside"):
        shutil.copytree(root / part, copy / part, ignore=shutil.ignore_patterns("src", "*.png"))
    shutil.copy(root / "CMakeLists.txt", copy)
    for lib in (copy / "libs").glob("*/*/"):  # one library is enough
        if lib.name != "heat":
            shutil.rmtree(lib)
    header = next((copy / "libs/simulation/heat/include").rglob("*.h"))
    header.write_text(header.read_text() + "\nclass Lost {};\n/// @ref nowhere_at_all\nvoid lost();\n")
    wrong = subprocess.run(
        [sys.executable, copy / "apps/packaging/api.py", copy / "out"], capture_output=True, text=True
    )
    assert wrong.returncode not in (0, 77) and "nowhere_at_all" in wrong.stderr, wrong
assert all(shown[e] for e in ("imaging", "geometry", "haptics", "tissue", "session", "assessment", "display")), shown
print(", ".join(f"{c}: {len(n)}" for c, n in shown.items()), "classes of examples, each with its page")

#!/usr/bin/env python3
"""Every command in the pages: is there such a command, and does it know these flags? check_docs_run.py runs those of blocks.
usage: check_docs_commands.py OSTEO SOURCE_DIR

Read are fenced blocks and `code` of docs/*.md, README.md and CONTRIBUTING.md."""

import pathlib, re, shlex, subprocess, sys

osteo, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()


def lines(page):
    """(line number, command) of each command of osteo in a page."""
    fenced, number = False, 0
    carried, first = "", 0
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            continue
        if fenced:
            if not carried:
                first = number
            carried += line.rstrip("\\") + " " if line.endswith("\\") else line
            if line.endswith("\\"):
                continue
            text, carried = carried.strip(), ""
            if m := re.match(r"(?:[A-Z_]+=\S+ )*(?:xvfb-run (?:-a )?)?(?:\./)?(osteo)(?= |$)(.*)", text):
                yield first, m[1] + m[2]
        else:
            for m in re.finditer(r"`(?:\./)?(osteo [^`]+)`", line):
                yield number, m[1]


def words(command):
    command = re.split(r"\s+#|\s[|>;]|\s&&|\s2>|   ", command)[0]  # what stands after three blanks is for people
    try:
        return shlex.split(command)
    except ValueError:
        return None


said = subprocess.run([osteo, "help", "docs"], capture_output=True, text=True).stdout
common = set(re.findall(r"^  (--[a-z][a-z0-9-]*)", said[said.index("Common flags:") :], re.M))
known = {}  # command -> its flags


def flags_of(name):
    if name not in known:  # the reference is what help says (a test of its own), and is read more quickly
        pages = [p for kind in ("command", "stage") if (p := root / f"docs/reference/{kind}-{name}.md").exists()]
        known[name] = (
            set(re.findall(r"--[a-z][a-z0-9-]*", "".join(p.read_text() for p in pages))) | common if pages else None
        )
    return known[name]


def judge(command):
    """None when it is right, else what is wrong."""
    said = words(command)
    if said is None:
        return "quotes that do not close"
    said = [w for w in said if w not in ("[...]", "...")]
    if len(said) < 2 or not re.fullmatch(r"[a-z][a-z-]*", said[1]):
        return None  # osteo --version, osteo STAGE
    if said[1] == "help":
        return (
            None
            if len(said) < 3 or said[2] == "--all" or not said[2].islower() or flags_of(said[2]) is not None
            else f"no command {said[2]}"
        )
    flags = flags_of("list-series" if said[1] == "import" and "--list" in said else said[1])
    if flags is not None:
        flags = flags | {"--list"} if said[1] == "import" else flags
    if flags is None:
        return f"no command {said[1]}"
    for word in said[2:]:
        if m := re.match(r"\[?(--[A-Za-z][A-Za-z0-9_-]*)", word):
            flag = m[1].replace("_", "-").rstrip("-")
            if flag not in flags and flag != "--help" and flag.replace("--no-", "--", 1) not in flags:
                # Commands within a command (osteo experiment camera --x) have help of their own.
                inner = [w for w in said[2:] if re.fullmatch(r"[a-z][a-z-]*", w)]
                deeper = (
                    subprocess.run([osteo, said[1], *inner[:1], "--help"], capture_output=True, text=True).stdout
                    if inner
                    else ""
                )
                if flag not in set(re.findall(r"--[a-z][a-z0-9-]*", deeper)):
                    return f"{said[1]} has no flag {flag}"
    return None


wrong, checked = [], 0
pages = [p for p in sorted((root / "docs").rglob("*.md")) if "reference" not in p.parts] + [
    root / "README.md",
    root / "CONTRIBUTING.md",
]
for page in pages:
    name = page.relative_to(root).as_posix()
    for number, command in lines(page):
        checked += 1
        if why := judge(command):
            wrong.append(f"{name}:{number}: {command}: {why}")
if checked < 100:
    wrong.append(f"only {checked} commands found: is the reader of pages still right?")
print("\n".join(wrong) or f"{checked} commands in {len(pages)} pages are known with their flags")
sys.exit(bool(wrong))

#!/usr/bin/env python3
"""Texts of windows, reports and review pages: what the sources mark is in libs/core/base/po/osteotome.pot, and every catalogue has all of it.
usage: catalogues.py ROOT            checks; 0 where all is well
       catalogues.py ROOT --update   writes the .pot and brings new texts into the catalogues, without guesses
       catalogues.py ROOT --missing LANGUAGE   prints what a catalogue lacks, as JSON
Wants xgettext, msgmerge and msgfmt of Debian's gettext."""

import json, pathlib, re, struct, subprocess, sys, tempfile

root = pathlib.Path(sys.argv[1]).resolve()
po = root / "libs/core/base/po"
languages = {
    "de": "nplurals=2; plural=(n != 1);",
    "es": "nplurals=2; plural=(n != 1);",
    "fr": "nplurals=2; plural=(n > 1);",
    "zh_CN": "nplurals=1; plural=0;",
}
# Texts that stand in tables of libraries below, which know nothing of languages: file, pattern, how it is shown.
tables = [
    ("pipelines/hints.json", r'"words": "([^"]*)"', str),
    ("pipelines/hints.json", r'"name": "([^"]*)"', str),
    (
        "libs/simulation/bone/include/osteo/simulation/bone/posture.h",
        r"names\(Posture\) \{\n  return \{(.*?)\}",
        "enum",
    ),
    ("libs/simulation/bone/src/plates.cpp", r'StripPlan\{"[^"]*", "([^"]*)"', str),
    ("libs/simulation/bone/src/plates.cpp", r'\.about = "([^"]*)"', str),
    (
        "libs/app/window/include/osteo/app/window/hand_buttons.h",
        r"names\(HandFunction\) \{\n  return \{(.*?)\}",
        "enum",
    ),
    (
        "libs/network/tutor/include/osteo/network/tutor/playback_params.h",
        r"names\(PlaybackMode\) \{\n  return \{(.*?)\}",
        "enum",
    ),
    ("libs/app/window/src/view_layout.h", r"names\(Layout\) \{\n  return \{(.*?)\}", "enum"),
    ("libs/assessment/evidence/src/score.cpp", r'words\.push_back\(\s*"([^"]*)"\)', str),
    ("libs/assessment/evidence/src/score.cpp", r'not_measured\(\s*"[^"]*", "([^"]*)"', str),
    ("libs/assessment/evidence/src/process.cpp", r'not_measured\(\s*\w+, "([^"]*)"', str),
    ("libs/assessment/evidence/src/process.cpp", r'not_measured\(\s*"[^"]*", "([^"]*)"\)', str),
    ("libs/assessment/evidence/src/step_clock.cpp", r'not_measured\(\s*"[^"]*", "([^"]*)"', str),
    ("libs/assessment/evidence/src/product_cells.cpp", r'r\.word = "([^"\\]*)";', str),
    ("libs/assessment/evidence/src/score.cpp", r'\? "(not judged)" : done \? "done" : "not done"', str),
    ("libs/assessment/evidence/src/score.cpp", r'\? "not judged" : done \? "(done)" : "not done"', str),
    ("libs/assessment/evidence/src/score.cpp", r'\? "not judged" : done \? "done" : "(not done)"', str),
    (
        "libs/assessment/evidence/include/osteo/assessment/evidence/detail/metric_table.h",
        r'MetricWhen::\w+,\s*\w+,\s*((?:"[^"]*"\s*)+)\}',
        "joined",
    ),
    ("libs/display/view/include/osteo/display/view/quality.h", r"names\(Quality\) \{\n  return \{(.*?)\}", "enum"),
]

# Names that structures have in our phantoms, procedures and finders; others are shown as the case has them.
structures = (
    "facial nerve,sigmoid sinus,external ear canal,air cells,dura,teeth,labyrinth,ossicles,chorda tympani,antrum,"
    "alveolar nerve,mandibular nerve,mandibular canal,facial canal,transverse sinus,carotid artery,jugular bulb,"
    "cochlea,malleus,incus,stapes,tegmen,inner ear,semicircular canals,tympanic cavity,bone,metal,soft tissue"
).split(",")

# What instrument_library() calls its instruments, without their sizes.
instruments = (
    "cutting,cutting cylinder,cutting taper,diamond,diamond cylinder,diamond taper,saw,hand saw,suction tube,irrigator,probe,"
    "hook,shaft,plate screws"
).split(",")


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{command[0]}: {done.stderr}")
    return done.stdout


def of_tables():
    """A source that marks the texts of the tables, by the file they are of."""
    for name in structures + instruments:
        yield __file__, name
    for file, pattern, kind in tables:
        path = root / file
        found = re.findall(pattern, path.read_text(), re.S) if path.exists() else []
        if not found:
            yield file, None
        for text in found:
            if kind == "joined":  # literals beside each other
                text = "".join(re.findall(r'"([^"]+)"', text))
            for one in re.findall(r'"([^"]+)"', text) if kind == "enum" else [text]:
                yield file, one.replace("_", " ") if kind == "enum" else one


def make_pot(into):
    sources = sorted(
        str(p.relative_to(root))
        for folder in ("libs", "apps")
        for p in (root / folder).rglob("*")
        if p.suffix in (".cpp", ".h")
        and re.search(r"\btr(_later|_of|_n)?\(", p.read_text())
        and p.name != "translate.h"
    )
    with tempfile.TemporaryDirectory() as work:
        listed = []
        for n, (file, text) in enumerate(of_tables()):
            if text is None:
                bad.append(f"{file}: its table of texts is not found any more (tests/papers/catalogues.py)")
                continue
            listed.append(f"tr({json.dumps(text, ensure_ascii=False)});")
        source = pathlib.Path(work) / "tables.cpp"
        source.write_text("\n".join(listed) + "\n")
        out = pathlib.Path(work) / "all.pot"
        run(
            "xgettext",
            "--language=C++",
            "--from-code=UTF-8",
            "--keyword",
            "--keyword=tr:1",
            "--keyword=tr_later:1",
            "--keyword=tr_of:1c,2",
            "--keyword=tr_n:1,2",
            "--no-location",
            "--no-wrap",
            "--package-name=osteotome",
            f"--directory={root}",
            f"--directory={work}",
            "-o",
            out,
            *sources,
            source.name,
        )
        text = out.read_text()
    text = re.sub(r'"POT-Creation-Date: [^"]*"\n', "", text)
    # xgettext takes "95 % of" for a format of C: places are looked after here.
    text = re.sub(r"^#, (fuzzy, )?c-format\n", "", text, flags=re.M)
    text = re.sub(r"^#, fuzzy\n", "", text, count=1, flags=re.M)
    text = text.replace("charset=CHARSET", "charset=UTF-8")
    text = re.sub(r"^# .*\n|^#\n", "", text, flags=re.M)
    into.write_text(
        "# Texts of Osteotome's windows, reports and review pages. Made by tests/papers/catalogues.py.\n" + text
    )


def unquoted(lines):
    return "".join(json.loads(l.strip()) for l in lines)


def entries(path):
    """(context, msgid) -> (msgid_plural, [msgstr...], flags)"""
    out = {}
    for block in re.split(r"\n\n+", path.read_text()):
        if not re.search(r"^msgid ", block, re.M):
            continue
        parts, flags, key = {}, "", None
        for line in block.splitlines():
            if line.startswith("#,"):
                flags += line
            elif line.startswith("#"):
                continue
            elif m := re.match(r'(msgctxt|msgid_plural|msgid|msgstr(?:\[\d\])?) (".*")', line):
                key = m[1]
                parts[key] = [m[2]]
            elif key:
                parts[key].append(line)
        strings = [unquoted(v) for k, v in sorted(parts.items()) if k.startswith("msgstr")]
        plural = unquoted(parts["msgid_plural"]) if "msgid_plural" in parts else None
        out[unquoted(parts.get("msgctxt", ['""'])), unquoted(parts["msgid"])] = (plural, strings, flags)
    return out


def places(text):
    return sorted(re.findall(r"\{\w+\}", text) + re.findall(r"%[-+]?[0-9]*(?:\.[0-9])?[fdgsu]", text.replace("%%", "")))


def letters_of(font):
    """Characters that an OpenType font has a glyph for, by its cmap of format 4 or 12."""
    data = font.read_bytes()
    tables_at = {
        data[12 + 16 * n : 16 + 16 * n]: struct.unpack(">II", data[20 + 16 * n : 28 + 16 * n])
        for n in range(struct.unpack(">H", data[4:6])[0])
    }
    at = tables_at[b"cmap"][0]
    found = set()
    for n in range(struct.unpack(">H", data[at + 2 : at + 4])[0]):
        sub = at + struct.unpack(">I", data[at + 8 + 8 * n : at + 12 + 8 * n])[0]
        form = struct.unpack(">H", data[sub : sub + 2])[0]
        if form == 12:
            for g in range(struct.unpack(">I", data[sub + 12 : sub + 16])[0]):
                a, b, _ = struct.unpack(">III", data[sub + 16 + 12 * g : sub + 28 + 12 * g])
                found.update(range(a, b + 1))
        elif form == 4:
            half = struct.unpack(">H", data[sub + 6 : sub + 8])[0]
            ends = struct.unpack(f">{half // 2}H", data[sub + 14 : sub + 14 + half])
            starts = struct.unpack(f">{half // 2}H", data[sub + 16 + half : sub + 16 + 2 * half])
            for a, b in zip(starts, ends):
                found.update(range(a, b + 1))
    return found


def check(language, plural, wanted):
    path = po / f"{language}.po"
    if not path.exists():
        return bad.append(f"{path.relative_to(root)} is missing")
    done = subprocess.run(["msgfmt", "-c", "-o", "/dev/null", str(path)], capture_output=True, text=True)
    if done.returncode != 0:
        bad.append(done.stderr)
    have = entries(path)
    head = have.get(("", ""), (None, [""], ""))[1][0]
    if f"Plural-Forms: {plural}" not in head:
        bad.append(f"{language}.po: its head has not 'Plural-Forms: {plural}', by which translate.cpp chooses")
    for key, (several, _, _) in wanted.items():
        if key == ("", ""):
            continue
        name = f"{language}.po: {key[1]!r}"
        if key not in have:
            bad.append(f"{name} is not in it")
            continue
        _, strings, flags = have[key]
        if "fuzzy" in flags:
            bad.append(f"{name} is fuzzy")
        if not strings or not all(strings):
            bad.append(f"{name} is not translated")
            continue
        for s in strings:
            if places(s) != places(key[1]) and (several is None or places(s) != places(several)):
                bad.append(f"{name}: its places are not those of {s!r}")
            if s.count("\n") != key[1].count("\n"):
                bad.append(f"{name}: its lines are not those of {s!r}")
            # With a plain space a colon could come to stand alone on a line.
            if language == "fr" and re.search(r"\S [:;?!»]|« ", s):
                bad.append(f"{name}: a no-break space (U+00A0) belongs before : ; ? ! » and after «, not a plain one")
    bad.extend(f"{language}.po: {k[1]!r} is used nowhere" for k in have if k not in wanted)


bad = []
if "--missing" in sys.argv:
    have = entries(po / f"{sys.argv[-1]}.po") if (po / f"{sys.argv[-1]}.po").exists() else {}
    lacks = [
        [c, i, p]
        for (c, i), (p, _, _) in entries(po / "osteotome.pot").items()
        if i and not all(have.get((c, i), (0, [""]))[1])
    ]
    print(json.dumps(lacks, ensure_ascii=False, indent=0))
    sys.exit(0)
if "--update" in sys.argv:
    make_pot(po / "osteotome.pot")
    for language in languages:
        run(
            "msgmerge",
            "--no-fuzzy-matching",
            "--no-wrap",
            "--no-location",
            "-q",
            "-U",
            "--backup=off",
            po / f"{language}.po",
            po / "osteotome.pot",
        )
        path = po / f"{language}.po"  # what is used nowhere any more goes
        path.write_text(re.sub(r"^#~.*\n", "", path.read_text(), flags=re.M).rstrip("\n") + "\n")
else:
    with tempfile.TemporaryDirectory() as work:
        fresh = pathlib.Path(work) / "fresh.pot"
        make_pot(fresh)
        if entries(fresh).keys() != entries(po / "osteotome.pot").keys():
            bad.append("osteotome.pot is stale: tests/papers/catalogues.py . --update, then translate what is new")
        wanted = entries(fresh)
    for language, plural in languages.items():
        check(language, plural, wanted)
    # What the review's script says is looked up by these.
    for text in re.findall(
        r'\btx\((?:near < 0 \? )?"([^"]*)"', (root / "libs/assessment/review/page/review.js").read_text()
    ):
        if ("", text) not in wanted:
            bad.append(f"review.js says {text!r}, which kScriptTexts of libs/assessment/review/src/page.cpp lacks")
    font = root / "libs/app/window/fonts/NotoSansSC.otf"
    lacking = {c for c in (po / "zh_CN.po").read_text() + "简体中文" if ord(c) > 0x2E80} - {
        chr(c) for c in letters_of(font)
    }
    if lacking:
        bad.append(f"{font.name} lacks {''.join(sorted(lacking))}: libs/app/window/fonts/make_chinese.sh")
for line in bad:
    print(line, file=sys.stderr)
sys.exit(1 if bad else 0)

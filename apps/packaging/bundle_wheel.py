#!/usr/bin/env python3
"""Makes a wheel of the module stand by itself: with the program `osteo` and every shared library that either loads.

usage: bundle_wheel.py WHEEL BUILD OUT

WHEEL is what pip makes of the sources with OSTEO_BUILT=BUILD (wheel.sh). A copy of each library goes into osteotome.libs
under a name of its own, so that no other package of the same process takes it for its own; only the C library and the
compiler's (libstdc++, libgcc_s) are the machine's. The platform of the result is the lowest C library that satisfies all
symbols. Letters for reports, DICOM's dictionary, licences and an SPDX list of the parts come along.
"""

import argparse, base64, hashlib, os, pathlib, re, shutil, subprocess, sys, tempfile, zipfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from sbom import owners

ROOT = pathlib.Path(__file__).resolve().parents[2]
# The machine's own: they belong to its loader and its drivers, which a second copy would get in the way of.
MACHINES_OWN = re.compile(
    r"^(ld-linux.*|lib(c|m|dl|pthread|rt|util|resolv|anl|mvec|BrokenLocale)\.so\.\d+"
    r"|libstdc\+\+\.so\.6|libgcc_s\.so\.1|linux-vdso.*)$"
)
# What the licence of the whole does not allow to come along (docs/how-to/packages.md): Debian builds these under the GPL.
COPYLEFT = re.compile(
    r"lib(x264|x265|avcodec|avformat|swscale|postproc|gdal|poppler|CGAL|tet|cholmod|spqr|fftw3|gsl|readline)\b"
)
ENTRY = "[console_scripts]\nosteo = osteo._command:main\n"


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def needed(elf):
    return run("patchelf", "--print-needed", elf).split()


def resolved(elf):
    """Name in the file -> path, of all that loading it loads."""
    found = {}
    for line in run("ldd", elf).splitlines():
        if m := re.match(r"\s*(\S+) => (\S+)", line):
            if m[2] == "not":
                sys.exit(f"{elf}: the loader does not find {m[1]}")
            found[m[1]] = pathlib.Path(m[2])
    return found


# A table of contents without entries, as ICU reads it (udata.h of ICU: a header of 32 bytes, then how many there are).
NO_ICU_DATA = """
#include <stdint.h>
const struct {
  uint16_t header; uint8_t magic[2]; uint16_t size, reserved; uint8_t big, charset, wide, reserved_byte;
  uint8_t format[4], format_version[4], data_version[4]; char text[8]; uint32_t entries, end;
} icudt%s_dat = {32, {0xda, 0x27}, 20, 0, 0, 0, 2, 0, {'T', 'o', 'C', 'P'}, {1, 0, 0, 0}, {0, 0, 0, 0}, "", 0, 0};
"""


def icu_without_data(name, paths, copy):
    """ICU's names and rules of all languages are a seventh of the wheel. libxml2 alone loads ICU, and asks it for encodings
    of XML files that iconv has not: nothing here reads such. Where something else loads it too, they come along."""
    takers = {taker for taker, path in paths.items() for n in needed(path) if re.match(r"libicu(uc|data|i18n)\b", n)}
    if not (m := re.match(r"libicudata\.so\.(\d+)", name)) or {t.split(".")[0] for t in takers} - {
        "libicuuc",
        "libxml2",
    }:
        return False
    source = copy.with_suffix(".c")
    source.write_text(NO_ICU_DATA % m[1])
    run("cc", "-shared", "-fPIC", "-nostdlib", f"-Wl,-soname,{name}", "-o", copy, source)
    source.unlink()
    return True


def lowest_glibc(elves):
    highest = (0, 0)
    for elf in elves:
        for major, minor in re.findall(r"\bGLIBC_(\d+)\.(\d+)", run("readelf", "-V", elf)):
            highest = max(highest, (int(major), int(minor)))
    return highest


def bundle(tree, elves):
    """Copies what `elves` load beside them and makes each look there alone. Returns the copies and where they came from."""
    libs = tree / "osteotome.libs"
    libs.mkdir()
    paths = {}
    for elf in elves:
        paths.update((n, p) for n, p in resolved(elf).items() if not MACHINES_OWN.match(n))
    if wrong := sorted(n for n in paths if COPYLEFT.search(n)):
        sys.exit(f"these may not come along: {' '.join(wrong)}")
    names = {}
    for name, path in sorted(paths.items()):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        stem, _, rest = name.partition(".so")
        names[name] = f"{stem}-{digest}.so{rest}"
        if not icu_without_data(name, paths, libs / names[name]):
            shutil.copy(path.resolve(), libs / names[name])
        (libs / names[name]).chmod(0o755)
    for elf in [*elves, *sorted(libs.iterdir())]:
        changes = []
        for name in needed(elf):
            if name in names:
                changes += ["--replace-needed", name, names[name]]
        if elf.parent == libs:
            changes += ["--set-soname", elf.name]
        where = "$ORIGIN" if elf.parent == libs else f"$ORIGIN/{os.path.relpath(libs, elf.parent)}"
        run("patchelf", "--remove-rpath", elf)
        run("patchelf", *changes, "--set-rpath", where, elf)
    return sorted(libs.iterdir()), sorted(set(paths.values()))


def write_record(tree, info):
    rows = []
    for path in sorted(p for p in tree.rglob("*") if p.is_file()):
        name = path.relative_to(tree).as_posix()
        if name == f"{info}/RECORD":
            rows.append(f"{name},,")
            continue
        digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).rstrip(b"=").decode()
        rows.append(f"{name},sha256={digest},{path.stat().st_size}")
    (tree / info / "RECORD").write_text("\n".join(rows) + "\n")


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    p.add_argument("wheel", type=pathlib.Path)
    p.add_argument("build", type=pathlib.Path)
    p.add_argument("out", type=pathlib.Path)
    a = p.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tree = pathlib.Path(folder)
        with zipfile.ZipFile(a.wheel) as z:
            z.extractall(tree)
        (info,) = (f.name for f in tree.glob("*.dist-info"))
        version = info.removesuffix(".dist-info").split("-")[1]
        data = tree / "osteo/data"
        program = tree / "osteo/bin/osteo"
        program.parent.mkdir()
        data.mkdir()
        shutil.copy(a.build / "bin/osteo", program)
        program.chmod(0o755)
        run("strip", program)
        elves = [program, *tree.glob("osteo/_osteo*.so")]
        copies, sources = bundle(tree, elves)
        shutil.copy(ROOT / "apps/packaging/wheel_command.py", tree / "osteo/_command.py")
        (tree / info / "entry_points.txt").write_text(ENTRY)
        # Letters of reports, where the machine has none, and the names of DICOM's attributes.
        fonts = sorted(pathlib.Path("/usr/share/fonts").rglob("LiberationSans-*.ttf"))
        dictionary = sorted(pathlib.Path("/usr/share").glob("libdcmtk*/dicom.dic"))
        if len(fonts) != 4 or not dictionary:
            sys.exit("install fonts-liberation and libdcmtk-dev: their files come along")
        for file in [*fonts, dictionary[-1]]:
            shutil.copy(file, data)
        shutil.copy(ROOT / "apps/packaging/wheel_fonts.conf", data / "fonts.conf")
        # Pipelines, manual pages and completion where an environment of Python has them.
        shared = tree / f"osteotome-{version}.data/data/share"
        shutil.copytree(ROOT / "pipelines", shared / "osteo/pipelines")
        run(a.build / "bin/osteo", "docs", "--shared", shared, "--quiet")
        licences = tree / info / "licenses"
        licences.mkdir(exist_ok=True)
        shutil.copy(ROOT / "LICENSE", licences)
        for package in sorted(owners(map(str, [*sources, *fonts, dictionary[-1]]))[0]):
            shutil.copy(f"/usr/share/doc/{package}/copyright", licences / f"{package}.copyright")
        (tree / info / "sboms").mkdir()
        bill = [sys.executable, ROOT / "apps/packaging/sbom.py", tree / info / "sboms/osteotome.spdx.json"]
        run(
            *bill,
            "--version",
            version,
            "--package",
            "osteotome",
            "--with",
            "OSTEO_PYTHON",
            "--program",
            a.build / "bin/osteo",
        )
        major, minor = lowest_glibc([*elves, *copies])
        platform = f"manylinux_{major}_{minor}_{os.uname().machine}"
        described = tree / info / "WHEEL"
        described.write_text(re.sub(r"(?m)^(Tag: .*)-[^-\n]+$", rf"\1-{platform}", described.read_text()))
        write_record(tree, info)
        a.out.mkdir(parents=True, exist_ok=True)
        result = a.out / re.sub(r"-[^-]+\.whl$", f"-{platform}.whl", a.wheel.name)
        with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as z:
            for path in sorted(p for p in tree.rglob("*") if p.is_file()):
                entry = zipfile.ZipInfo(path.relative_to(tree).as_posix(), (2020, 1, 1, 0, 0, 0))
                entry.external_attr = (path.stat().st_mode | 0o100000) << 16
                entry.compress_type = zipfile.ZIP_DEFLATED
                z.writestr(entry, path.read_bytes())
        size = sum(c.stat().st_size for c in copies) / 1e6
        print(f"{result}: {result.stat().st_size / 1e6:.1f} MB, {len(copies)} libraries of {size:.0f} MB")


main()

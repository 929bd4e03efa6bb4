#!/usr/bin/env python3
"""Builds the pages of docs/ as a site by mkdocs, without network, and checks it. apps/packaging/site.py OUT

Every page must be reachable from the navigation, every link and anchor must lead somewhere, and nothing may be fetched from elsewhere: else it fails.
"""

import pathlib, re, shutil, subprocess, sys, tempfile

from html_pages import check_pages

root = pathlib.Path(__file__).resolve().parents[2]
BESIDE = {
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "CHANGELOG.md": "CHANGELOG.md",
    "README.md": "about.md",
}  # pages from outside docs/


def stage(pages):
    shutil.copytree(root / "docs", pages, ignore=shutil.ignore_patterns("*.py"))
    for name, to in BESIDE.items():
        shutil.copy(root / name, pages / to)
    shutil.copy(root / "apps/packaging/site.css", pages)
    for page in pages.rglob("*.md"):
        here = page.parent.relative_to(pages)
        beside = page.name in BESIDE.values() and here == pathlib.Path(".")

        def link(m):
            text, target, anchor = m[1], m[2], m[3] or ""
            if re.match(r"[a-z]+:", target) or not target:
                return m[0]
            # Where it leads in the repository.
            base = pathlib.Path(".") if beside else pathlib.Path("docs") / here
            where = (root / base / target).resolve()
            if not where.exists():
                sys.exit(f"{page.relative_to(pages)}: {target} leads nowhere")
            where = where.relative_to(root).as_posix()
            up = "../" * len(here.parts)
            if where in BESIDE:
                return f"[{text}]({up}{BESIDE[where]}{anchor})"
            if where == "docs" or not where.startswith("docs/"):
                return f"{text} (`{where}` in the sources)"
            inside = where[len("docs/") :]
            if (root / where).is_dir():
                index = [n for n in ("README.md",) if (root / where / n).exists()]
                return f"[{text}]({up}{inside}/{index[0]})" if index else f"{text} (`{where}` in the sources)"
            if inside.endswith(".py"):
                return f"{text} (`{where}` in the sources)"
            return f"[{text}]({up}{inside}{anchor})"

        body = page.read_text()
        # Not inside code.
        parts = re.split(r"(```.*?```)", body, flags=re.S)
        for i in range(0, len(parts), 2):
            parts[i] = re.sub(r"\[([^\]\[]*)\]\(([^)#\s]*)(#[^)\s]*)?\)", link, parts[i])
            # GitHub takes a list right after a line of text for a list; Markdown proper wants a blank line.
            parts[i] = re.sub(r"(?m)^(?![-*|>#\s]|\d+\. )(.+)\n(?=(?:- |1\. ))", r"\1\n\n", parts[i])
            parts[i] = re.sub(r"(?m)^(?!\|)(\S.*)\n(?=\|.*\|\n\|[-| :]+\|)", r"\1\n\n", parts[i])
        page.write_text("".join(parts))
    return [p for p in pages.rglob("*.md")]


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: apps/packaging/site.py OUT")
    if shutil.which("mkdocs") is None:
        print("mkdocs is not here: apt install mkdocs mkdocs-material")
        sys.exit(77)
    out = pathlib.Path(sys.argv[1]).resolve()
    if out.exists() and any(out.iterdir()) and not (out / "sitemap.xml").exists():
        sys.exit(f"{out} holds something else than a site; give an empty folder")
    with tempfile.TemporaryDirectory(prefix="osteo-site-") as work:
        work = pathlib.Path(work)
        staged = {p.relative_to(work / "pages").as_posix() for p in stage(work / "pages")}
        shutil.copy(root / "apps/packaging/mkdocs.yml", work)
        nav = set(re.findall(r"[\w/-]+\.md", (work / "mkdocs.yml").read_text()))
        lost = sorted(p for p in staged - nav if not p.startswith(("reference/", "developer/adr/")))
        if lost:
            sys.exit("no line in apps/packaging/mkdocs.yml leads to " + ", ".join(lost))
        said = subprocess.run(
            ["mkdocs", "build", "--quiet", "--strict", "--config-file", work / "mkdocs.yml"],
            capture_output=True,
            text=True,
        )
        if "Unrecognised theme" in said.stdout + said.stderr:
            print("mkdocs' theme material is not here: apt install mkdocs-material")
            sys.exit(77)
        if said.returncode:
            sys.exit(said.stdout + said.stderr)
        # Shown for any address, so its own paths are of none.
        bad, pages, links = check_pages(work / "site", lambda page, _, lost: lost and page == "404.html")
        if bad:
            sys.exit("\n".join(bad))
        if out.exists():
            shutil.rmtree(out)
        shutil.copytree(work / "site", out)
    print(f"{out}/index.html: {pages} pages, {links} links inside, none broken, nothing fetched from elsewhere")


if __name__ == "__main__":
    main()

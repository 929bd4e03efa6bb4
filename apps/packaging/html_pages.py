"""Pages of a site as their links see them, for what builds one: nothing may be fetched from elsewhere, and links inside lead somewhere."""

import html.parser, re, urllib.parse


class Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.links, self.fetched, self.ids = [], [], set()

    def handle_starttag(self, tag, attrs):
        a = dict(attrs)
        if a.get("id"):
            self.ids.add(a["id"])
        if tag == "a" and a.get("name"):
            self.ids.add(a["name"])
        if tag == "a" and a.get("href"):
            self.links.append(a["href"])
        self.fetched += [a[k] for k in ("src", "data") if a.get(k)]
        if tag == "link" and a.get("href") and a.get("rel") != "canonical":
            self.fetched.append(a["href"])


def check_pages(site, excused=lambda page, target, lost: False):
    """What is wrong, how many pages, how many links inside. `excused`: a page's target that may be wrong; lost: there is no such file,
    else no such anchor in it."""
    bad, pages, links = [], {}, 0
    for path in site.rglob("*.html"):
        pages[path.resolve()] = page = Page()
        page.feed(path.read_text())
    for path, page in pages.items():
        name = path.relative_to(site.resolve()).as_posix()
        bad += [f"{name}: fetches {t}" for t in page.fetched if re.match(r"(https?:)?//", t)]
        for target in page.links + page.fetched:
            if re.match(r"([a-z]+:|//)", target) or target in ("#", ""):
                continue
            links += 1
            file, _, anchor = target.partition("#")
            to = (path.parent / urllib.parse.unquote(file.split("?")[0])).resolve() if file else path
            if to.is_dir():
                to = to / "index.html"
            lost = not to.exists()
            wrong = lost or (anchor and to in pages and urllib.parse.unquote(anchor) not in pages[to].ids)
            if wrong and not excused(name, target, lost):
                bad.append(f"{name}: {target} leads nowhere" if lost else f"{name}: {target}: no such anchor")
    for css in site.rglob("*.css"):
        if re.search(r"url\(['\"]?(https?:)?//", css.read_text(errors="replace")):
            bad.append(f"{css.relative_to(site)}: fetches from elsewhere")
    return bad, len(pages), links

"""Names the links of a folder of HTML pages that lead to no file or no heading, and fails if there are any."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.ids, self.links = set(), []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("id", "name"):
                self.ids.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


folder = Path(sys.argv[1]).resolve()
pages = {path: Page(path) for path in folder.rglob("*.html")}
dead, count = [], 0
for path, page in pages.items():
    for link in page.links:
        parts = urlsplit(link)
        if parts.scheme or parts.netloc or path.name in ("print.html", "404.html", "toc.html"):
            continue
        count += 1
        target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
        if target.is_dir():
            target /= "index.html"
        known = pages.get(target)
        if not target.exists() or (parts.fragment and known and unquote(parts.fragment) not in known.ids):
            dead.append(f"{path.relative_to(folder)}: {link}")
print("\n".join(dead) or f"{count} links on {len(pages)} pages lead somewhere")
sys.exit(bool(dead) or count == 0)

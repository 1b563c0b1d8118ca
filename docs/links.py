"""Check the links of the built site: python docs/links.py build/site

Every link and picture must lead to a file of the site, anchors to an element with this id, and nothing may be loaded
from the network. `make docs` runs this.
"""

import html
import re
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote

LINK = re.compile(r'<(\w+)\b[^>]*?\b(?:href|src)="([^"]+)"')
IDENTIFIER = re.compile(r'\b(?:id|name)="?([^"\s>]+)')
ELSEWHERE = re.compile(r"[a-z]+:|//")
LOADED = {"img", "script", "link", "iframe", "source"}
"""Elements whose address a browser loads together with the page."""
NOT_CHECKED = {"404.html"}
"""Pages that only a server shows; their links start at its root."""


@cache
def identifiers(page: Path) -> set[str]:
    """Return the ids of the elements of a page."""
    return set(IDENTIFIER.findall(page.read_text(encoding="utf-8")))


def broken(site: Path, page: Path) -> list[str]:
    """Return a message for each broken link of a page, and for each file loaded from the network."""
    messages = []
    for element, raw in LINK.findall(page.read_text(encoding="utf-8")):
        link = html.unescape(raw)
        if ELSEWHERE.match(link):
            if element in LOADED and not link.startswith("data:"):
                messages.append(f"{page.relative_to(site)}: loads {link}")
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / unquote(name.partition("?")[0])).resolve() if name else page
        target = target / "index.html" if target.is_dir() else target
        if not target.is_file():
            messages.append(f"{page.relative_to(site)}: {link}: no such file")
        elif anchor and target.suffix == ".html" and unquote(anchor) not in identifiers(target):
            messages.append(f"{page.relative_to(site)}: {link}: no such place")
    return messages


def main(site: Path) -> int:
    """Check all pages, and return 0 if no link is broken, else 1."""
    pages = [page for page in sorted(site.rglob("*.html")) if page.name not in NOT_CHECKED]
    messages = [message for page in pages for message in broken(site, page)]
    print("\n".join(messages) or f"the links of {len(pages)} pages are right", file=sys.stderr)
    return 1 if messages or not pages else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))

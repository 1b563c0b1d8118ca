"""The project's page on PyPI: the README with links and pictures that work there, and the address of the repository.

PyPI shows the README without the repository, so that relative links lead nowhere. The address is that of the repository
whose workflow builds the package (GitHub sets it), or ICCM_REPOSITORY. Without an address, pictures are left out and
links are plain text.
"""

import os
import re

PICTURE = re.compile(r"!\[([^\]]*)\]\((?!https?:)([^)]+)\)")
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:|#)([^)]+)\)")


def repository() -> str | None:
    """Return the address of the repository, if it is known."""
    server, name = os.environ.get("GITHUB_SERVER_URL"), os.environ.get("GITHUB_REPOSITORY")
    return os.environ.get("ICCM_REPOSITORY") or (f"{server}/{name}" if server and name else None)


def revision() -> str:
    """Return the tag or branch that is built."""
    return os.environ.get("GITHUB_REF_NAME") or "main"


def links(address: str | None) -> dict[str, str]:
    """Return the project's links for its metadata."""
    if not address:
        return {}
    return {
        "Source": address,
        "Documentation": f"{address}/tree/{revision()}/docs",
        "Changelog": f"{address}/blob/{revision()}/CHANGELOG.md",
        "Issues": f"{address}/issues",
    }


def description(readme: str, address: str | None) -> str:
    """Return the README as PyPI can show it."""
    if address:
        text = PICTURE.sub(rf"![\1]({address}/raw/{revision()}/\2)", readme)
        return LINK.sub(rf"[\1]({address}/blob/{revision()}/\2)", text)
    lines = []
    for line in readme.splitlines():
        shown = PICTURE.sub("", line)
        if shown != line and not shown.strip("| "):
            continue  # only pictures
        lines.append(LINK.sub(r"\1", shown))
    return _without_empty_tables("\n".join(lines) + "\n")


def _without_empty_tables(text: str) -> str:
    """Return Markdown without tables that have a heading only."""
    return re.sub(r"(?m)^\|.*\|\n\|[-:| ]+\|\n(?!\|)", "", text)

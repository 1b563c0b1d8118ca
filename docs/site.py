"""Generated parts of the site (a hook of MkDocs): options, commands, formats, pictures of samples, and the demo.

In a page, `<!-- options: map -->` is replaced by the options of a command, `<!-- commands -->` by all other commands,
`<!-- formats -->` by the contents of each suffix, `<!-- demo -->` by the demo, `<!-- small demo -->` by a small one.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, get_args

from PIL import Image

from iccm.cli import COMMANDS
from iccm.io import formats, options
from iccm.io.option_groups import grouped

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "build" / "api"
DEMO = ROOT / "build" / "web" / "try.js"
SHOWN_DEMO = """<div id="try"></div>
<noscript>The demo needs JavaScript.</noscript>
<script src="assets/try.js"></script>"""
SMALL_DEMO = """<div id="try" class="try-small"></div>
<noscript>The demo needs JavaScript.</noscript>
<script>
(() => {
  const place = document.getElementById('try');
  new IntersectionObserver(([{isIntersecting}], observer) => {
    if (!isIntersecting) return;
    observer.disconnect();
    const script = document.createElement('script');
    script.src = 'assets/try.js';
    document.body.append(script);
  }, {rootMargin: '100px'}).observe(place);
})();
</script>"""
"""The demo without most of its controls, loaded when it comes close to the window."""
SAMPLES = re.compile(r'((?:\]\(|src=")(?:\.\./)*)\.\./(?=samples/[\w./-]+\.(?:svg|png|jpg)\b)')
"""One level up in a link to a sample: on the site, samples lie beside the pages."""
IMAGE = re.compile(r'<img (?=[^>]*src="([^"]+)")')
SHOWN_SAMPLES = ("*.svg", "*.png", "*.jpg")
WHITE = 250
"""Of 255: a picture has a white background if its corners are opaque and all lighter than this."""
COLOURED = re.compile(r'(?:fill|stroke)="(?!none|#000|black|currentColor)[^"]+"|style=')

HOLDS = {
    "picture": "pictures",
    "drawing": "shapes, artwork",
    "mesh": "meshes",
    "uv": "meshes with new coordinates",
    "overlay": "numbers at vertices (read)",
    "flat": "flattenings",
    "plot": "figures",
    "stmap": "STMaps",
    "map": "saved maps",
    "world": "the place of a picture on a map (written)",
    "outlines": "shapes (read)",
    "manifest": "jobs",
    "constraints": "pins and strokes",
}


def on_startup(**_: Any) -> None:
    """Copy the package as installed, with `io`, `cli` and `extensions` inside `iccm`, for the pages of the API."""
    shutil.rmtree(PACKAGE, ignore_errors=True)
    skipped = shutil.ignore_patterns("__pycache__", "lib", "static")
    for source, name in (
        ("iccm", "iccm"),
        ("io", "iccm/io"),
        ("cli", "iccm/cli"),
        ("extensions", "iccm/extensions"),
    ):
        shutil.copytree(ROOT / source, PACKAGE / name, dirs_exist_ok=True, ignore=skipped)


def on_config(config: Any) -> Any:
    """Set the repository link, if its address is known: from the environment (also in CI), or from the clone."""
    address = os.environ.get("ICCM_REPOSITORY", "")
    if not address and "GITHUB_REPOSITORY" in os.environ:
        address = (
            f"{os.environ.get('GITHUB_SERVER_URL', 'https://github.com')}/{os.environ['GITHUB_REPOSITORY']}"
        )
    if not address:
        command = ["git", "-C", str(ROOT), "remote", "get-url", "origin"]
        found = subprocess.run(command, capture_output=True, text=True)
        address = found.stdout.strip().removesuffix(".git") if found.returncode == 0 else ""
    if address.startswith("https://"):
        config["repo_url"] = address
        config["repo_name"] = "/".join(address.split("/")[-2:])
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pictures and drawings of the samples, and the demo, which are outside the folder of pages."""
    from mkdocs.exceptions import PluginError  # only here, so that tests need no MkDocs
    from mkdocs.structure.files import File

    if not DEMO.is_file():
        raise PluginError(f"{DEMO.relative_to(ROOT)} is missing: build the site by `make docs`")
    files.append(File.generated(config, "assets/try.js", abs_src_path=str(DEMO)))

    for pattern in SHOWN_SAMPLES:
        for path in sorted((ROOT / "samples").rglob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            if "/out/" not in name:
                files.append(File(name, str(ROOT), config["site_dir"], config["use_directory_urls"]))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return the page with tables in place of their comments, and with links to samples as on the site."""
    markdown = re.sub(r"<!-- options: (\w+) -->", lambda found: page_of_options(found[1]), markdown)
    markdown = markdown.replace("<!-- commands -->", commands()).replace("<!-- formats -->", contents())
    markdown = markdown.replace("<!-- demo -->", SHOWN_DEMO).replace("<!-- small demo -->", SMALL_DEMO)
    return SAMPLES.sub(r"\1", markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Add a class to pictures that need adjustment on dark pages: black drawings, and figures on white."""
    folder = (ROOT / "docs" / page.file.src_uri).parent

    def marked(found: re.Match) -> str:
        name = tone(folder, found[1])
        return f'<img class="{name}" ' if name else found[0]

    return IMAGE.sub(marked, html)


def tone(folder: Path, link: str) -> str:
    """Return `ink` for a drawing in black, `figure` for a picture on white, and nothing for other pictures."""
    path = (folder / link).resolve()
    if not path.is_file() and "samples/" in link:  # relative to the site
        path = ROOT / link[link.find("samples/") :]
    if not path.is_file():
        return ""
    if path.suffix == ".svg":
        return "" if COLOURED.search(path.read_text(encoding="utf-8")) else "ink"
    with Image.open(path) as picture:
        small = picture.convert("RGBA")
        right, bottom = small.width - 1, small.height - 1
        corners = [small.getpixel(at) for at in ((0, 0), (right, 0), (0, bottom), (right, bottom))]
    return "figure" if all(min(corner) >= WHITE for corner in corners) else ""


def page_of_options(command: str) -> str:
    """Return the options of a command for their page: a contents by task, and a section for each group."""
    rows = {name: row for name, row in options.of_command(command).items() if command not in row[1].hidden}
    contents = []
    for title, _, names in grouped(rows, {name: option for name, (_, option) in rows.items()}):
        named = ", ".join(f"`--{name.replace('_', '-')}`" for name in names)
        contents.append(f"- [{title}](#{_anchor(title)}): {named}")
    sections = re.sub(
        r"^\*\*(.+?)\*\*(, such as (.+))?$",
        lambda found: f"## {found[1]}\n" + (f"\nSuch as {found[3]}\n" if found[3] else ""),
        options_of(command),
        flags=re.MULTILINE,
    )
    return "\n".join([*contents, "", sections])


def _anchor(title: str) -> str:
    """Return the anchor that MkDocs gives to a heading."""
    return re.sub(r"[^\w-]+", "", title.lower().replace(" ", "-"))


def options_of(command: str) -> str:
    """Return the options of a command, as a table for each group."""
    rows = {name: row for name, row in options.of_command(command).items() if command not in row[1].hidden}
    parts = []
    for title, example, names in grouped(rows, {name: option for name, (_, option) in rows.items()}):
        if len(names) < len(rows):
            parts.append(f"**{title}**, such as `{example}`\n" if example else f"**{title}**\n")
        parts.append("| option | meaning |\n|---|---|")
        parts += [_row(name, *rows[name]) for name in names]
        parts.append("")
    return "\n".join(parts)


def _row(name: str, hint: Any, option: options.Option) -> str:
    choices = [
        value for part in (hint, *get_args(hint)) for value in get_args(part) if isinstance(value, str)
    ]
    value = option.metavar or "|".join(choices) or ("" if hint is bool else "N")
    names = [f"--{name.replace('_', '-')}", *filter(None, [option.short])]
    shown = " ".join([", ".join(reversed(names)), value]).strip()
    text = option.help
    if option.default not in (None, (), False) and "[default" not in text:
        text += f"  [default: {option.default}]"
    return f"| <code>{_escaped(shown)}</code> | {_escaped(text)} |"


def _escaped(text: str) -> str:
    """Return text with the characters escaped that Markdown would interpret."""
    return "".join(f"&#{ord(c)};" if c in "|<>&*_`[]" else c for c in text)


def commands() -> str:
    """Return all commands with their options; those of `map` have a separate page."""
    parts = []
    for name, text in COMMANDS.items():
        parts.append(f"## `iccm {name}`\n\n{text}\n")
        parts.append("[Options of `iccm map`](map.md)\n" if name == "map" else options_of(name))
    return "\n".join(parts)


def contents() -> str:
    """Return the contents of files with each suffix as a table."""
    lines = ["| suffix | contents |", "|---|---|"]
    for suffix, form in formats.every().items():
        parts = [words for name, words in HOLDS.items() if getattr(form, name)]
        if form.picture:
            parts[0] += f" ({_pixels(form.picture)})"
        lines.append(f"| `{suffix}` | {', '.join(parts)} |")
    return "\n".join(lines)


def _pixels(form: formats.PictureFormat) -> str:
    depths = [f"{bits} bit" for bits in form.bits]
    depths += ["float"] if form.light != "display" else []
    lost = [word for word, kept in (("grey", form.grey), ("alpha", form.alpha)) if not kept]
    return ", ".join(depths) + (f"; no {' or '.join(lost)}" if lost else "")

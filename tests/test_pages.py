"""The pages: their commands run and make the pictures shown, and their links are valid."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from iccm.io.pictures import image_files

from .scripts import script
from .test_samples import LIMIT, difference

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))


RECIPES, SITE, LINKS = script("docs/recipes.py"), script("docs/site.py"), script("docs/links.py")
LISTS = script("docs/lists.py")


def name_of(page):
    return page.relative_to(ROOT).as_posix()


def drawn(path):
    """The numbers in a drawing's paths, and the text between them."""
    text = " ".join(element.get("d", "") for element in ET.parse(path).iter())
    return re.split(r"[-\d.e]+", text), np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text), float)


def marked(page):
    """A page as a parameter; all except the README are slow together."""
    return pytest.param(page, marks=() if page.name == "README.md" else pytest.mark.slow, id=name_of(page))


@pytest.mark.slow
@pytest.mark.parametrize("page", [marked(page) for page in RECIPES.pages()])
def test_the_commands_of_a_page_make_its_pictures(page, tmp_path):
    RECIPES.run(page, tmp_path)
    pictures = RECIPES.made(page, tmp_path)
    assert sorted(pictures) == RECIPES.expected(page)
    for name, path in pictures.items():
        kept = RECIPES.PICTURES / name
        if kept.suffix == ".webp":
            assert path.stat().st_size == pytest.approx(kept.stat().st_size, rel=0.1)
            continue
        if kept.suffix == ".svg":
            assert drawn(path)[0] == drawn(kept)[0]
            assert np.abs(drawn(path)[1] - drawn(kept)[1]).max() < 0.5
            continue
        RECIPES.keep(path, tmp_path / "kept.png")
        assert difference(*(image_files.read(p).pixels for p in (tmp_path / "kept.png", kept))) < LIMIT, name


def test_every_picture_kept_is_shown():
    shown_names = {name for page in PAGES for name in RECIPES.shown(page)}
    assert shown_names == {path.name for path in RECIPES.PICTURES.iterdir()}
    assert all(path.stat().st_size <= 150_000 for path in RECIPES.PICTURES.iterdir())


def prose(page):
    """The text of a page without blocks of code."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors(page):
    """The names of the headings of a page in links."""
    titles = re.findall(r"^#+ (.*)", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_links_of_a_page_lead_somewhere(page):
    text = prose(page)
    for link in re.findall(r"\]\(([^)\s]+)\)", text) + re.findall(r'(?:src|href)="([^"]+)"', text):
        if link.startswith("http"):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link


def test_the_link_check_of_the_site_finds_broken_links(tmp_path):
    (tmp_path / "b.html").write_text('<h2 id="there">There</h2>')
    (tmp_path / "a.html").write_text(
        '<a href="b.html#there"></a><a href="b.html#gone"></a><a href="c.html"></a><a href="https://example.org"></a>'
        '<img src="https://example.org/a.png"><img src="data:image/png;base64,AA">'
    )
    messages = LINKS.broken(tmp_path, tmp_path / "a.html")
    assert len(messages) == 3
    assert all(word in text for word, text in zip(("gone", "c.html", "a.png"), messages))
    assert LINKS.main(tmp_path) == 1


def test_every_page_is_in_the_site():
    listed = re.findall(r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    assert sorted(listed) == sorted(path.relative_to(ROOT / "docs").as_posix() for path in PAGES[4:])


AVOIDED = {
    "kink": "corner, vertex",
    "bay": "concavity",
    "limb": "protrusion; of a person: arm, leg",
    "whirl, comb, combed": "swirl, stretch into stripes",
    "void": "virtual triangle",
    "passed over, passes over": "ignored, ignores",
    "let go": "release",
    "told, tells": "reports, lists, shows",
    "goes on, go on, gone on": "continues, starts from",
    "is no, are no": "is not a, are not",
    "lay out, laid out, laid flat": "flatten, flattened",
    "of its own, of their own": "separate, its own",
    "as they come, as it comes": "unchanged",
    "by itself, by themselves": "separately, alone",
    "even sizes": "uniform scale",
    "at rest, holds still": "converged, stable",
    "not weighed": "hard constraint",
    "the turn of": "the rotation of",
    "likewise": "in the same way, too",
    "amid, therein, thereof": "in, among",
}
"""Words of a private dialect, and what pages, messages and comments say instead."""
TERMS = [term.strip() for terms in AVOIDED for term in terms.split(",")]


def uses(text, terms):
    """The terms that occur in a text outside of code, links and file names."""
    plain = re.sub(r"`[^`]*`|\]\([^)]*\)|<[^>]*>", " ", text)
    around = r"(?<![-\w.])(?<!there ){}s?(?![-\w]| longer| more)"
    return [term for term in terms if re.search(around.format(re.escape(term)), plain, re.IGNORECASE)]


NOT_CHECKED = ("CHANGELOG.md",)
"""History."""


@pytest.mark.parametrize("page", [page for page in PAGES if name_of(page) not in NOT_CHECKED], ids=name_of)
def test_a_page_does_not_use_terms_to_avoid(page):
    assert not uses(prose(page), TERMS)


def test_terms_to_avoid_are_found():
    assert len(TERMS) > 20
    assert uses("Two kinks, and the map goes on.", TERMS) == ["kink", "goes on"]
    assert not uses(
        "See `--limb`, [a link](limb.md) and flimsy; there is no limit, and it is no longer slow", TERMS
    )


BLOCK = re.compile(r"^```(?:sh|bash)\n(.*?)^```", re.DOTALL | re.MULTILINE)
CALL = re.compile(r"(?:^|[|&;(] ?)\s*iccm (\w+)((?:\\\n|[^\n|&;#>])*)", re.MULTILINE)


def test_every_command_and_option_shown_exists():
    """Even if a block is not run."""
    from iccm.cli import COMMANDS
    from iccm.io.options import of_command

    general = {"help", "version", "verbose", "quiet", "log-format", "debug"}
    pages = [page for page in [PAGES[0], *PAGES[4:]] if name_of(page) not in NOT_CHECKED]
    checked = 0
    for page in pages:
        calls = [
            call for block in BLOCK.findall(page.read_text(encoding="utf-8")) for call in CALL.findall(block)
        ]
        for command, arguments in calls:
            assert command in COMMANDS, (name_of(page), command)
            if command in ("plugins", "completion"):  # their options are not in the table
                continue
            names = {*of_command(command), *(of_command("map") if command == "batch" else ())}
            existing = {name.replace("_", "-") for name in names} | general
            used = set(re.findall(r" --([a-z][\w-]*)", re.sub(r"'[^']*'", "", arguments)))
            assert used <= existing, (name_of(page), command, used - existing)
            checked += len(used)
    assert checked > 200


def test_pictures_that_need_care_on_dark_pages_are_marked(tmp_path):
    from PIL import Image

    docs = ROOT / "docs"
    assert SITE.tone(docs, "files/shield.svg") == "ink"
    assert SITE.tone(docs, "files/heart.svg") == ""
    assert SITE.tone(docs / "cookbook", "../samples/pins/face.png") == ""
    Image.new("RGB", (5, 3), "white").save(tmp_path / "plot.png")
    Image.new("RGBA", (5, 3), (255, 255, 255, 0)).save(tmp_path / "clear.png")
    assert [SITE.tone(tmp_path, name) for name in ("plot.png", "clear.png", "missing.png")] == [
        "figure",
        "",
        "",
    ]


def test_links_to_samples_lead_to_their_place_on_the_site():
    text = "![a](../../samples/pins/cat.svg) and [b](../../samples/pins/README.md)"
    assert (
        SITE.on_page_markdown(text) == "![a](../samples/pins/cat.svg) and [b](../../samples/pins/README.md)"
    )
    command = "iccm map cat.jpg ../../samples/raster/fish.svg"
    assert SITE.on_page_markdown(command) == command


def test_lists_are_those_of_the_tables():
    lists = LISTS.files()
    assert {path.name for path in lists} >= {"index.html", "iccm_fit.inx", "README.md", "shapes.md"}
    for path, text in lists.items():
        assert path.read_text(encoding="utf-8") == text, "run make generated"
    assert "`iccm deform`" in LISTS.commands() and ".glb" in LISTS.mesh_formats(written=True)
    with pytest.raises(ValueError, match="0 lists"):
        LISTS.with_list("no menu here", "<select>", "</select>", "")


def test_tables_of_options_have_every_option_once():
    from iccm.io.options import of_command

    for command in ("map", "apply", "batch"):
        names = re.findall(r"^\| <code>(?:-\w, )?--([\w-]+)", SITE.options_of(command), re.MULTILINE)
        visible = [name for name, (_, option) in of_command(command).items() if command not in option.hidden]
        assert sorted(names) == sorted(name.replace("_", "-") for name in visible)


def test_every_option_of_a_job_has_a_topic_of_help():
    from iccm.cli import COMMANDS
    from iccm.io.option_groups import TOPICS
    from iccm.io.options import of_command

    used = {option.topic for command in COMMANDS for _, option in of_command(command).values()}
    assert used == {"", *TOPICS}
    assert [name for name, (_, option) in of_command("map").items() if not option.topic] == []


@pytest.mark.parametrize(
    "page", ["docs/architecture.md", "docs/developers/contributing.md", "docs/developers/terms.md"]
)
def test_files_and_folders_that_a_page_for_developers_names_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    paths = re.findall(r"`((?:iccm|io|cli|core|docs|tests|web|plugins)/[\w/.-]*)`", text)
    names = [path for path in paths if "NAME" not in path]
    assert names
    assert [name for name in names if not (ROOT / name).exists()] == []


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("unwarp", "cookbook/mockup"),
        ("dewarp", "cookbook/mockup"),
        ("decal", "cookbook/logo"),
        ("decal", "tutorial/mesh"),
        ("envelope", "comparison"),
        ("envelope", "cookbook/handles"),
        ("puppet warp", "cookbook/deform"),
        ("warp text", "cookbook/lettering"),
        ("UV map", "cookbook/stmap"),
    ],
)
def test_the_search_finds_pages_by_the_words_of_other_programs(word, page):
    assert word in prose(ROOT / "docs" / f"{page}.md")

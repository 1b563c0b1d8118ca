"""The pages: their commands run and make the pictures that they show, their links lead somewhere."""

import importlib.util
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from iccm.io.pictures import image_files

from .test_samples import LIMIT, difference

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))


def loaded(name):
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RECIPES, SITE = loaded("recipes"), loaded("site")


def name_of(page):
    return page.relative_to(ROOT).as_posix()


def drawn(path):
    """The numbers of a drawing's paths, and what stands between them."""
    text = " ".join(element.get("d", "") for element in ET.parse(path).iter())
    return re.split(r"[-\d.e]+", text), np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text), float)


def marked(page):
    """A page as a parameter: all but the README take long together."""
    return pytest.param(page, marks=() if page.name == "README.md" else pytest.mark.slow, id=name_of(page))


@pytest.mark.parametrize("page", [marked(page) for page in RECIPES.pages()])
def test_the_commands_of_a_page_make_its_pictures(page, tmp_path):
    RECIPES.run(page, tmp_path)
    made = RECIPES.made(page, tmp_path)
    assert sorted(made) == RECIPES.shown(page)
    for name, path in made.items():
        kept = RECIPES.PICTURES / name
        if kept.suffix == ".svg":
            assert drawn(path)[0] == drawn(kept)[0]
            assert np.abs(drawn(path)[1] - drawn(kept)[1]).max() < 0.5
            continue
        RECIPES.keep(path, tmp_path / "kept.png")
        assert difference(*(image_files.read(p).pixels for p in (tmp_path / "kept.png", kept))) < LIMIT, name


def test_every_picture_kept_is_shown():
    shown = {name for page in RECIPES.pages() for name in RECIPES.shown(page)}
    assert shown == {path.name for path in RECIPES.PICTURES.iterdir()}
    assert all(path.stat().st_size <= 150_000 for path in RECIPES.PICTURES.iterdir())


def anchors(page):
    """What the headings of a page are called in links."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.*)", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_the_links_of_a_page_lead_somewhere(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        if link.startswith("http"):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name) if name else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link


def test_every_page_is_in_the_site():
    listed = re.findall(r"[\w/.-]+\.md", (ROOT / "mkdocs.yml").read_text())
    assert sorted(listed) == sorted(path.relative_to(ROOT / "docs").as_posix() for path in PAGES[4:])


def test_the_readme_is_one_screen():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 130


def test_tables_of_options_have_every_option_once():
    from iccm.io.options import of_command

    for command in ("map", "apply", "batch"):
        names = re.findall(r"^\| <code>(?:-\w, )?--([\w-]+)", SITE.options_of(command), re.MULTILINE)
        shown = [name for name, (_, option) in of_command(command).items() if command not in option.hidden]
        assert sorted(names) == sorted(name.replace("_", "-") for name in shown)


def test_every_name_in_a_group_is_an_option():
    from iccm.cli import COMMANDS
    from iccm.io.option_groups import TOPICS
    from iccm.io.options import of_command

    known = {name for command in COMMANDS for name in of_command(command)}
    known |= {"verbose", "quiet", "log_format", "debug", "help", "version"}
    listed = [name for topic in TOPICS.values() for name in topic.names]
    assert len(listed) == len(set(listed)) and set(listed) <= known
    assert set(of_command("map")) <= set(listed)

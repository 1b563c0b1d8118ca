"""Plug-ins are installed completely where programs look for them, and removed again."""

import json
import shutil
import sys
import tomllib
import zipfile
from importlib.resources import files as resources
from pathlib import Path

import pytest

import iccm as library
from iccm.io import plugins


@pytest.fixture
def home(tmp_path, monkeypatch):
    """A user without either program."""
    for name in (
        "INKSCAPE_PROFILE_DIR",
        "INKSCAPE_COMMAND",
        "BLENDER_USER_RESOURCES",
        "BLENDER_USER_EXTENSIONS",
    ):
        monkeypatch.delenv(name, raising=False)
    for name in ("HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / ".config"))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    return tmp_path


def files(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@pytest.mark.skipif(sys.platform != "linux", reason="settings by XDG")
@pytest.mark.parametrize(
    ("program", "settings", "extensions"),
    [
        ("inkscape", [".config/inkscape"], [".config/inkscape/extensions"]),
        (
            "blender",
            [".config/blender/4.1", ".config/blender/4.2", ".config/blender/5.0", ".config/blender/notes"],
            [".config/blender/4.2/extensions/user_default", ".config/blender/5.0/extensions/user_default"],
        ),
    ],
)
def test_a_plug_in_is_installed_and_removed(home, iccm, program, settings, extensions):
    assert iccm("plugins", "install", program).code == 2
    for name in settings:
        (home / name).mkdir(parents=True)
    result = iccm("plugins", "install", program)
    places = [home / name / "iccm" for name in extensions]
    assert result.code == 0 and result.lines[:-1] == [f"wrote {place}" for place in places]
    for place in places:
        installed = files(place)
        assert (
            installed == plugins.contents(program)
            and installed["iccm_python.txt"].decode().strip() == sys.executable
        )
    assert iccm("plugins", "install", program).code == 0  # over itself
    assert iccm("plugins", "list").out == "".join(
        f"{program}\t{place}\t{sys.executable}\n" for place in places
    )
    (places[0] / "mine.txt").write_text("kept")
    result = iccm("plugins", "uninstall", program)
    assert result.lines == [f"removed {place}" for place in places]
    assert files(home) == {(places[0] / "mine.txt").relative_to(home).as_posix(): b"kept"}
    assert "no plug-in" in iccm("plugins", "uninstall", program).err and not iccm("plugins", "list").out


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script as Inkscape")
def test_inkscape_is_asked_for_its_folder(home, iccm):
    (home / "bin").mkdir()
    program = home / "bin" / "inkscape"
    program.write_text('#!/bin/sh\n[ "$1" = --user-data-directory ] && echo "$HOME/my settings"\n')
    program.chmod(0o755)
    result = iccm("plugins", "install", "inkscape")
    assert result.lines[0] == f"wrote {home / 'my settings' / 'extensions' / 'iccm'}"


def test_a_folder_or_an_archive_is_named(home, iccm, monkeypatch):
    monkeypatch.chdir(home)
    assert iccm("plugins", "install", "inkscape", "--to", "here").lines[0] == "wrote here/iccm"
    assert files(home / "here" / "iccm") == plugins.contents("inkscape")
    assert iccm("plugins", "install", "blender", "--to", "addon.zip").lines[0] == "wrote addon.zip"
    with zipfile.ZipFile("addon.zip") as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == plugins.contents("blender")
    before = files(home)
    for wrong, message in (
        (("install", "inkscape", "--to", "a.zip"), "name a folder"),
        (("install",), "inkscape, blender or figma"),
        (("uninstall",), "inkscape, blender or figma"),
        (("install", "figma"), "--to"),
        (("install", "gimp"), "'gimp' is not one of"),
        (("install", "inkscape", "--to", "addon.zip/x"), "addon.zip"),
    ):
        result = iccm("plugins", *wrong)
        assert result.code == 2 and message in result.err and len(result.lines) == 1, result.err
    assert files(home) == before


def test_the_plug_in_for_figma_is_written_with_its_window(home, iccm, monkeypatch, tmp_path):
    monkeypatch.chdir(home)
    source = tmp_path / "plugins"
    shutil.copytree(resources("iccm.plugins") / "figma", source / "figma")
    (source / "figma" / "ui.html").unlink(missing_ok=True)
    monkeypatch.setattr(plugins, "resources", lambda _: source)
    result = iccm("plugins", "install", "figma", "--to", "here")
    assert result.code == 2 and "make figma" in result.err and not (home / "here").exists()
    (source / "figma" / "ui.html").write_text("window")
    assert iccm("plugins", "install", "figma", "--to", "here").lines[0] == "wrote here/iccm"
    assert set(files(home / "here" / "iccm")) == {"manifest.json", "code.js", "ui.html", plugins.PYTHON}
    manifest = json.loads((home / "here" / "iccm" / "manifest.json").read_text())
    assert {manifest["main"], manifest["ui"]} < set(files(home / "here" / "iccm"))
    assert iccm("plugins", "uninstall", "figma", "--to", "here").lines == ["removed here/iccm"]
    assert not (home / "here" / "iccm").exists()


def test_the_manifest_is_that_of_this_version():
    manifest = tomllib.loads(plugins.contents("blender")["blender_manifest.toml"].decode())
    assert manifest["version"] == library.__version__ and manifest["id"] == plugins.OWN


def test_only_plug_ins_are_replaced(home, iccm, monkeypatch):
    monkeypatch.chdir(home)
    archive = home / "notes.zip"
    for write in (
        lambda: archive.write_text("notes"),
        lambda: zipfile.ZipFile(archive, "w").writestr("notes.txt", "mine"),
        lambda: (archive.unlink(), archive.symlink_to(home / "elsewhere.zip")),
    ):
        write()
        before = archive.read_bytes() if archive.exists() else None
        result = iccm("plugins", "install", "blender", "--to", "notes.zip")
        assert result.code == 2 and "notes.zip" in result.err
        assert (archive.read_bytes() if archive.exists() else None) == before
    assert not (home / "elsewhere.zip").exists()
    for _ in range(2):
        assert iccm("plugins", "install", "blender", "--to", "iccm.zip").code == 0
    sources = home / "src" / "iccm"
    sources.mkdir(parents=True)
    (sources / "__init__.py").write_text("mine")
    assert iccm("plugins", "install", "blender", "--to", "src").code == 2
    assert files(home / "src") == {"iccm/__init__.py": b"mine"}


def test_an_installed_plug_in_stays_whole_if_the_new_one_cannot_be_written(home, iccm, monkeypatch):
    monkeypatch.chdir(home)
    assert iccm("plugins", "install", "inkscape", "--to", "here").code == 0
    folder = Path("here/iccm")
    *others, last = sorted(set(plugins.contents("inkscape")) - {plugins.PYTHON})
    for name in others:
        (folder / name).write_text(f"an earlier {name}")
    (folder / last).unlink()
    (folder / last).mkdir()  # in the way
    assert iccm("plugins", "install", "inkscape", "--to", "here").code == 2
    assert {name: (folder / name).read_text() for name in others} == {
        name: f"an earlier {name}" for name in others
    }
    assert sorted(path.name for path in folder.iterdir()) == sorted([*others, last, plugins.PYTHON])

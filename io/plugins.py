"""Installation of plug-ins for Inkscape, Blender and Figma: files of `iccm.plugins`, and the path of this Python."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib.resources import files as resources
from pathlib import Path

from ..errors import InputError
from ..saved.archive import ERRORS
from . import files

PROGRAMS = ("inkscape", "blender", "figma")
OWN = "iccm"  # name of a plug-in's folder
SHARED, PYTHON = "iccm_process.py", "iccm_python.txt"
FIGMA_WINDOW = "ui.html"
"""The window of the plug-in for Figma, which contains the demo of the site: a file that `make figma` builds."""
OLDEST_BLENDER = (4, 2)  # oldest supported version of Blender, the first with extensions
PROGRAM_SECONDS = 60  # seconds for a program to report its folder


def contents(program: str) -> dict[str, bytes]:
    """Return the files of a plug-in by name, including the one with the path of the running Python.

    The one for Figma runs without Python; there this file only marks what `install` wrote.

    Raises:
        InputError: the window of the plug-in for Figma has not been built.
    """
    home = resources("iccm.plugins")
    plugin_files = {entry.name: entry.read_bytes() for entry in (home / program).iterdir() if entry.is_file()}
    plugin_files[PYTHON] = f"{sys.executable}\n".encode()
    if program != "figma":
        plugin_files[SHARED] = (home / SHARED).read_bytes()
    elif FIGMA_WINDOW not in plugin_files:
        raise InputError(
            "figma: the window of the plug-in is not built; run `make figma` in a clone, which needs Node.js"
        )
    return plugin_files


def names(program: str) -> set[str]:
    """Return the names of a plug-in's files."""
    if program == "figma":
        return {"manifest.json", "code.js", FIGMA_WINDOW, PYTHON}
    return set(contents(program))


def install(program: str, to: str | None = None) -> list[Path]:
    """Install a plug-in into the program's folders, or into `to`, a folder or for Blender a .zip.

    Returns:
        The folders, or the file, that contain it now.

    Raises:
        InputError: no folder of the program is found, one cannot be written, or it contains something other than an
            earlier version.
    """
    if to and Path(to).suffix == ".zip":
        return [_zipped(program, Path(to))]
    homes = [Path(to)] if to else folders(program)
    if not homes:
        raise InputError(_NOT_FOUND[program])
    plugin_files = contents(program)
    for home in homes:
        _check_own(home / OWN)
    for home in homes:
        files.make_folder(home / OWN)
        with files.together():  # an earlier version stays whole if one file cannot be written
            for name, content in plugin_files.items():
                files.write_bytes(home / OWN / name, content, force=True)
    return [home / OWN for home in homes]


def uninstall(program: str, to: str | None = None) -> list[Path]:
    """Remove the files that `install` wrote, and nothing else; return the folders that contained them."""
    plugin_folders = installed(program, to)
    for folder in plugin_folders:
        for name in names(program):
            (folder / name).unlink(missing_ok=True)
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)
        if not any(folder.iterdir()):
            folder.rmdir()
    return plugin_folders


def installed(program: str, to: str | None = None) -> list[Path]:
    """Return the folders that contain a program's plug-in."""
    homes = [Path(to)] if to else folders(program)
    return [home / OWN for home in homes if (home / OWN / PYTHON).is_file()]


def interpreter(folder: Path) -> str:
    """Return the path of the Python with which an installed plug-in runs iccm."""
    return (folder / PYTHON).read_text(encoding="utf-8").strip()


def folders(program: str) -> list[Path]:
    """Return a program's folders for extensions, from the program, its environment variables, or the defaults."""
    return {"inkscape": _of_inkscape, "blender": _of_blender, "figma": list}[program]()


def _of_inkscape() -> list[Path]:
    """Return the folders for extensions of Inkscape: of its user profile, and of its Flatpak if that was used."""
    home, command = Path.home(), shutil.which(os.environ.get("INKSCAPE_COMMAND") or "inkscape")
    if profile := os.environ.get("INKSCAPE_PROFILE_DIR"):
        profiles = [Path(profile)]
    elif command and (profile_folder := _last_line_of([command, "--user-data-directory"])):
        profiles = [Path(profile_folder)]
    else:
        usual = _settings("inkscape", "inkscape")
        mac = home / "Library/Application Support/org.inkscape.Inkscape/config/inkscape"
        usual = mac if sys.platform == "darwin" and mac.is_dir() else usual
        profiles = [usual] if usual.is_dir() else []
    flatpak = home / ".var/app/org.inkscape.Inkscape/config/inkscape"
    if flatpak.is_dir():
        profiles.append(flatpak)
    return [profile / "extensions" for profile in profiles]


def _of_blender() -> list[Path]:
    if folder := os.environ.get("BLENDER_USER_EXTENSIONS"):
        return [Path(folder) / "user_default"]
    if folder := os.environ.get("BLENDER_USER_RESOURCES"):
        return [Path(folder) / "extensions" / "user_default"]
    home = _settings("blender", "Blender Foundation/Blender")
    if sys.platform == "darwin":
        home = Path.home() / "Library/Application Support/Blender"
    versions = {path: re.fullmatch(r"(\d+)\.(\d+)", path.name) for path in home.glob("*")}
    numbers = {path: (int(match[1]), int(match[2])) for path, match in versions.items() if match}
    ordered = sorted((number, path) for path, number in numbers.items() if number >= OLDEST_BLENDER)
    return [path / "extensions" / "user_default" for _, path in ordered]


def _settings(plain: str, windows: str) -> Path:
    """Return a program's settings folder: by XDG, or in Windows' roaming data."""
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA") or Path.home() / "AppData/Roaming") / windows
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / plain


def _last_line_of(command: list[str]) -> str:
    """Return the last line that a program prints, or an empty text."""
    try:
        process = subprocess.run(command, capture_output=True, text=True, timeout=PROGRAM_SECONDS)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    lines = process.stdout.strip().splitlines()
    return lines[-1] if process.returncode == 0 and lines else ""


def _check_own(folder: Path) -> None:
    """Check that a folder is empty or contains a plug-in that `install` wrote.

    Raises:
        InputError: it contains something else.
    """
    if folder.is_dir() and any(folder.iterdir()) and not (folder / PYTHON).is_file():
        raise InputError(
            f"{folder}: contains something other than a plug-in of iccm; choose another folder with --to"
        )


def _zipped(program: str, path: Path) -> Path:
    if program != "blender":
        raise InputError(f"{path}: {program.capitalize()} does not install from a .zip; name a folder")
    if path.is_symlink() or (path.exists() and not _is_own_zip(path)):
        raise InputError(
            f"{path}: exists and is not a plug-in of iccm; choose another name, or remove the file first"
        )
    with files.replacing(path, force=True) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for name, content in sorted(contents(program).items()):
            archive.writestr(name, content)
    return path


def _is_own_zip(path: Path) -> bool:
    """Return whether a file is a plug-in written by `install`: an archive of its files and no others."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = set(archive.namelist())
    except (OSError, *ERRORS):
        return False
    return {SHARED, PYTHON} <= names and not any("/" in name for name in names)


_NOT_FOUND = {
    "inkscape": "Inkscape: settings not found; pass its folder of extensions (in Inkscape: Edit > "
    "Preferences > System > User extensions) with --to DIR",
    "blender": "Blender: settings of version 4.2 or later not found; start Blender once, or write a file "
    "for Preferences > Get Extensions > Install from Disk with --to iccm-blender.zip",
    "figma": "Figma: has no folder of plug-ins; name one with --to DIR, and import the manifest that is written there",
}

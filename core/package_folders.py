"""The folders of the packages: `iccm.io` is in the folder `io`, where setuptools cannot find it by its name."""

from pathlib import Path

from setuptools import find_packages

FOLDERS = {"iccm": "iccm", "iccm.io": "io", "iccm.cli": "cli", "iccm.extensions": "extensions"}
"""Of the code, each including its subpackages."""
DATA = {
    "iccm.plugins": "plugins",  # modules for other programs, not importable as a package
    **{f"iccm.samples.{name}": f"samples/{name}" for name in ("limbs", "pins", "strokes")},  # of `iccm init`
}


def package_folders(root: Path) -> dict[str, str]:
    """Return the folder of each package by its name, relative to the repository `root`."""
    found = {**FOLDERS, **DATA}
    for name, folder in FOLDERS.items():
        for inner in find_packages(str(root / folder)):
            found[f"{name}.{inner}"] = f"{folder}/{inner.replace('.', '/')}"
    return found

"""Where the packages are: `iccm.io` is in the folder `io`, so that setuptools cannot find it by its name."""

from pathlib import Path

from setuptools import find_packages

FOLDERS = {"iccm": "iccm", "iccm.io": "io", "iccm.cli": "cli"}  # each with all packages in it
DATA = {
    "iccm.plugins": "plugins",  # what other programs import is no package of ours
    **{f"iccm.samples.{name}": f"samples/{name}" for name in ("limbs", "pins", "strokes")},  # of `iccm init`
}


def package_folders(root: Path) -> dict[str, str]:
    """Find the folder of each package, relative to the repository `root`, by its name."""
    found = {**FOLDERS, **DATA}
    for name, folder in FOLDERS.items():
        for inner in find_packages(str(root / folder)):
            found[f"{name}.{inner}"] = f"{folder}/{inner.replace('.', '/')}"
    return found

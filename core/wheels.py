"""Build the wheels of all platforms on this machine, with the compiler of the package `ziglang`.

    python core/wheels.py [FOLDER]

The wheel of this machine is built first, by the usual build backend. The others contain the same files with the
libraries of another platform: nothing else in a wheel depends on the platform, since the core does not use
Python's headers.
"""

import argparse
import hashlib
import re
import subprocess
import sys
import tempfile
import zipfile
from base64 import urlsafe_b64encode
from pathlib import Path
from typing import NamedTuple

from compile import CORE, compile_core, find_compiler, sources

LIBRARIES = "iccm/native/lib/"  # in a wheel


class Platform(NamedTuple):
    """A platform for which a wheel is built.

    Attributes:
        target: its name as in Zig, with the oldest supported version of the system.
        tags: platform tags of the wheel.
    """

    target: str
    tags: tuple[str, ...]


# the oldest systems for which NumPy also provides wheels
PLATFORMS = (
    Platform("x86_64-linux-gnu.2.17", ("manylinux_2_17_x86_64", "manylinux2014_x86_64")),
    Platform("aarch64-linux-gnu.2.17", ("manylinux_2_17_aarch64", "manylinux2014_aarch64")),
    Platform("x86_64-macos.11.0", ("macosx_11_0_x86_64",)),
    Platform("aarch64-macos.11.0", ("macosx_11_0_arm64",)),
    Platform("x86_64-windows-gnu", ("win_amd64",)),
)


def native_wheel(folder: Path) -> Path:
    """Build the wheel of this machine by the build backend, in an otherwise empty folder."""
    command = [sys.executable, "-m", "build", "--wheel", "--outdir", str(folder), str(CORE.parent)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    (wheel,) = folder.glob("*.whl")
    return wheel


def wheel_for(platform: Platform, native: Path, libraries: list[Path], folder: Path) -> Path:
    """Copy a wheel with the libraries and tags of another platform; return its path.

    Args:
        platform: the other platform.
        native: the wheel of this machine.
        libraries: the libraries of the other platform.
        folder: where the wheel is written.
    """
    name, version, *_ = native.name.split("-")
    made = folder / f"{name}-{version}-py3-none-{'.'.join(platform.tags)}.whl"
    part = made.with_suffix(".part")
    with zipfile.ZipFile(native) as source, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as goal:
        record: list[str] = []

        def add(path: str, content: bytes) -> None:
            goal.writestr(zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
            digest = urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{path},sha256={digest},{len(content)}\n")

        for item in source.infolist():
            if item.filename.startswith(LIBRARIES) or item.filename.endswith(".dist-info/RECORD"):
                continue
            content = source.read(item)
            if item.filename.endswith(".dist-info/WHEEL"):
                kept = [
                    line for line in content.decode().splitlines() if line and not line.startswith("Tag:")
                ]
                tags = [f"Tag: py3-none-{tag}" for tag in platform.tags]
                content = ("\n".join([*kept, *tags]) + "\n").encode()
            add(item.filename, content)
        for library in libraries:
            add(LIBRARIES + library.name, library.read_bytes())
        path = f"{name}-{version}.dist-info/RECORD"
        goal.writestr(path, "".join([*record, f"{path},,\n"]))
    return part.replace(made)


def check(library: Path) -> None:
    """Check that a library contains the name of every exported function, which all formats store as text.

    Raises:
        SystemExit: a name is missing.
    """
    content = library.read_bytes()
    text = "".join(source.read_text() for source in sources())
    for name in re.findall(r"^ICCM_EXPORT \w+ (iccm_\w+)\(", text, re.MULTILINE):
        if name.encode() not in content:
            raise SystemExit(f"{library.name}: has no function {name}")


def main() -> None:
    """Build the wheels of all platforms, or of those given by --only."""
    parser = argparse.ArgumentParser(description="Build iccm's wheels for all platforms.")
    parser.add_argument("folder", nargs="?", type=Path, default=CORE.parent / "dist")
    parser.add_argument("--only", metavar="TEXT", default="", help="platforms whose target has this in it")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        native = native_wheel(Path(temporary) / "native")
        for platform in PLATFORMS:
            if args.only not in platform.target:
                continue
            objects = CORE.parent / "build" / f"core-{platform.target}"
            compiled = Path(temporary) / platform.target
            libraries = compile_core(compiled, find_compiler(platform.target), objects)
            for library in libraries:
                check(library)
            print(wheel_for(platform, native, libraries, args.folder))


if __name__ == "__main__":
    main()

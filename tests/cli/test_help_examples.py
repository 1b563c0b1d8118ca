"""The examples in help texts run as printed."""

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from iccm.cli import COMMANDS
from tests.specimens import NAMES, Wing, tps

pytestmark = pytest.mark.usefixtures("solve_once")

ROOT = Path(__file__).parents[2]
ELSEWHERE = {
    "doctor": "has none",
    "edit": "a server, see tests/io/edit",
    "plugins": "programs that are not here, see tests/plugins and test_plugins",
    "completion": "writes into the home folder, see test_help",
    "relayout": "needs meshes with two layouts, see tests/io/run/test_relayout",
}
"""Commands whose examples are run by other tests, or cannot be run."""
QUICK = ("init", "help", "info")


def examples(iccm, command):
    text = iccm(command, "--help").out
    return [line.strip() for line in text.splitlines() if re.match(r"  iccm ", line)]


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder, made current, with the files that examples use."""
    monkeypatch.chdir(tmp_path)
    for folder in ("rose-leaf", "pins"):
        for path in (ROOT / "samples" / folder).iterdir():
            if path.suffix in (".svg", ".jpg", ".png") and path.name != "picture.png":
                shutil.copy(path, path.name)
    (tmp_path / "icons").mkdir()
    for name in ("bell", "home"):
        shutil.copy(ROOT / "docs" / "files" / f"{name}.svg", f"icons/{name}.svg")
    for name in ("shield", "heart", "sheet", "badge", "mug"):
        shutil.copy(ROOT / "docs" / "files" / f"{name}.svg", f"{name}.svg")
    for name in ("landmarks.csv", "africa.geojson", "page.png"):
        shutil.copy(ROOT / "docs" / "files" / name, name)
    Path("table.csv").write_text("name,trade\nKenya,40\nEgypt,90\nChad,4\n")
    ring = [[250, 240], [280, 240], [270, 270], [250, 240]]
    Path("cells.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.export("cow.obj")
    half = ball.submesh([np.flatnonzero(ball.triangles_center[:, 2] > 0.1)], append=True)
    for name in ("face.obj", "glove.obj"):
        half.export(name)
    corners = "v 0 0 {0}\nv 3 0 0\nv 3 2 {0}\nv 0 2 .5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    for name, height in (("old", 0), ("new", 0.3)):
        Path(f"{name}.obj").write_text(corners.format(height))
    Image.fromarray(np.random.default_rng(1).integers(0, 255, (30, 40, 3), np.uint8)).save("bottle.jpg")
    Path("body.obj").write_text("g sleeve\n" + Path("face.obj").read_text())
    normal = np.full((32, 32, 3), (128, 128, 255), np.uint8)
    Image.fromarray(normal).save("normal.png")
    Path("jobs.toml").write_text(
        '[[job]]\nsource = "icons/*.svg"\ntarget = "leaf.svg"\nsize = 32\noutput = "{source.stem}.png"\n'
    )
    Path("tail.json").write_text(
        json.dumps(
            {
                "pins": [
                    {"source": [256, 150], "target": [270, 140]},
                    {"source": [256, 420], "target": [256, 420]},
                ]
            }
        )
    )
    return tmp_path


def add_specimens(files):
    """Write the pictures and landmarks that examples of `iccm standardize` use."""
    wings = {"first": Wing(1, 120), "second": Wing(2, 120)}
    leaves = {"leaf-3": Wing(5, 120), "leaf-7": Wing(3, 120)}
    for folder, landmarks, suffix, specimens in (
        ("wings", "landmarks", ".jpg", wings),
        ("leaves", "lm", ".png", leaves),
    ):
        (files / folder).mkdir()
        (files / landmarks).mkdir()
        for name, wing in specimens.items():
            wing.picture().save(files / folder / f"{name}{suffix}", quality=95)
            rows = [f"{label},{z.real:.3f},{z.imag:.3f}" for label, z in zip(NAMES, wing.landmarks)]
            (files / landmarks / f"{name}.csv").write_text("\n".join(["name,x,y", *rows]) + "\n")
    (files / "wings.tps").write_text(tps(wings, ".jpg"))


@pytest.mark.timeout(600)  # some have ten examples
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in COMMANDS
        if name not in ELSEWHERE
    ],
)
def test_the_examples_of_a_command_run(files, shell, iccm, command, monkeypatch):
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(files / "summary.md"))
    lines = examples(iccm, command)
    assert lines
    if command == "check":
        assert (
            shell(
                f"cd {files} && iccm batch jobs.toml --root out > /dev/null; iccm check out baselines --update"
            ).returncode
            == 0
        )
        shutil.rmtree(files / "out")
    if command in ("apply", "compose", "field"):
        for source, target in (("rose", "leaf"), ("leaf", "heart"), ("heart", "leaf")):
            outlines = f"{source}.svg", f"{target}.svg", "--parts", "largest", "--fit", "whole"
            assert iccm("map", *outlines, "-o", f"{source}-{target}.npz").code == 0
    if command == "init":
        (files / "jobs.toml").unlink()
    if command == "standardize":
        add_specimens(files)
    for line in lines:
        if "| jq" in line and not shutil.which("jq"):
            continue
        line = line.replace("jobs.toml --resume", "jobs.toml --force")
        if re.search(r"[|<>&;$*?~]", line):  # for a shell; others run in this process, which starts faster
            done = shell(f"cd {files} && {line}")
            code, err = done.returncode, done.stderr
        else:
            typed = iccm(*shlex.split(line)[1:])
            code, err = typed.code, typed.err
        assert code == 0 and "Traceback" not in err, (line, err)
        shutil.rmtree(files / "OUT", ignore_errors=True)  # to which all examples of a command write
        if command in ("init", "batch", "map", "deform", "morph"):
            for path in [*files.glob("*-*.*"), *files.glob("out*")]:
                shutil.rmtree(path) if path.is_dir() else path.unlink()

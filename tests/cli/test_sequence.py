"""`iccm map --sequence`: frames whose maps continue from each other."""

import json
from pathlib import Path

import numpy as np
import pytest

import iccm as core
from iccm.io.batch import manifest
from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{}</svg>'
SMALL = ("--size", "24")


@pytest.fixture
def frames(shapes):
    """frames/f8.svg to frames/f11.svg: a bar that is raised at one end."""
    (shapes / "frames").mkdir()
    for k in range(4):
        bar = f'<path d="M10 60H50L90 {60 - 5 * k}V{80 - 5 * k}L50 80H10Z"/>'
        (shapes / "frames" / f"f{8 + k}.svg").write_text(SVG.format(bar))
    return shapes


def done_frames(typed):
    return [line.split(",")[0] for line in typed.lines if ": done" in line]


@pytest.mark.slow
def test_frames_continue_from_each_other_and_are_resumed(frames, iccm):
    command = ("map", "square.svg", "frames/*.svg", "--sequence", "-o", "out/{target.stem}.png", *SMALL)
    result = iccm(*command)
    assert result.code == 0, result.err
    assert done_frames(result) == [
        f"square-f{k}: done" for k in (8, 9, 10, 11)
    ]  # in numerical order, 8 before 10
    maps = [core.load(f"out/f{k}.npz") for k in range(8, 12)]
    z = maps[0]._interior
    steps = np.abs(np.diff([fit.map(z) for fit in maps], axis=0))
    assert steps.max() < 1.5 * 5
    before = [Path(f"out/f{k}.png").read_bytes() for k in range(8, 12)]
    Path("out/f10.png").unlink()
    again = iccm(*command, "--resume")
    assert again.code == 0 and [line for line in again.lines if "unchanged" not in line] == [
        line for line in again.lines if line.startswith("square-f10")
    ]
    assert [Path(f"out/f{k}.png").read_bytes() for k in range(8, 12)] == before
    refused = iccm(*command)
    assert refused.code == 2 and "the file exists" in refused.err


@pytest.mark.slow
def test_textures_and_sources_are_frames_too(frames, iccm):
    for k in range(4):
        image_files.write(f"t{k}.png", image_files.Image(np.full((4, 4, 3), 60 * k, np.uint8)))
    result = iccm(
        *("map", "square.svg", "blob.svg", "--texture", "t?.png", "--sequence", "-o", "t-{texture.stem}.png"),
        *SMALL,
    )
    assert result.code == 0, result.err
    maps = [Path(f"t-t{k}.npz").read_bytes() for k in range(4)]
    assert set(maps) == {maps[0]}  # one map: only the texture changes
    assert [int(image_files.read(f"t-t{k}.png").pixels[12, 12, 0]) for k in range(4)] == [0, 60, 120, 180]


def test_a_manifest_has_sequences_too(frames):
    job = {"source": "frames/*.svg", "target": "disk.svg", "sequence": True, "output": "{source.stem}.png"}
    single = {"source": "square.svg", "target": "disk.svg"}
    lines = [json.dumps(entry) for entry in (job, single, job | {"output": "{number}.png"})]
    tasks = manifest.read("\n".join(lines), "-", root=Path("."))
    assert [task.after for task in tasks] == [0, 1, 2, 3, 0, 0, 6, 7, 8]
    assert tasks[1].name == "f9-disk" and [Path(name).name for name in tasks[1].job.output] == [
        "f9.png",
        "f9.npz",
    ]
    assert tasks[1].job.fit == "whole" and tasks[1].job.holes == "keep" and tasks[4].job.fit is None


@pytest.mark.slow
def test_a_frame_that_differs_too_much_starts_afresh_with_a_note(frames, iccm):
    assert iccm("map", "square.svg", "frames/f8.svg", "-o", "bar.npz").code == 0
    spiky = '<path d="M50 5L54 46L95 50L54 54L50 95L46 54L5 50L46 46Z"/>'
    Path("spiky.svg").write_text(SVG.format(spiky))
    ring = SVG.format('<path fill-rule="evenodd" d="M10 10H90V90H10ZM40 40H60V60H40Z"/>')
    Path("ring.svg").write_text(ring)
    result = iccm(
        "map", "ring.svg", "ring.svg", "--start", "bar.npz", "-o", "a.png", *SMALL, "--fit", "whole"
    )
    assert result.code == 0 and any("a new one is computed" in line for line in result.lines), result.err


@pytest.mark.slow
def test_a_map_of_frames_goes_on_from_itself(shapes, iccm):
    comb = '<path d="M10 90V34H17V80H30V10H37V80H52V26H59V80H84V18H91V90Z"/><path d="M66 44H74V54H66Z"/>'
    Path("comb.svg").write_text(SVG.format(comb))
    assert iccm("map", "comb.svg", "square.svg", "-o", "first.npz").code == 0
    assert iccm("map", "comb.svg", "square.svg", "--start", "first.npz", "-o", "second.npz").code == 0
    first, second = core.load("first.npz"), core.load("second.npz")
    assert first.source.area > 1.1 * core.read_shape("comb.svg").curve.area  # a wide frame
    z = first._interior
    assert np.abs(first.map(z) - second.map(z)).max() < 1e-3 * first._diagonal


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("square.svg", "none/*.svg", "--sequence"), "no file matches"),
        (("square.svg", "frames/*.svg", "--texture", "t.png", "--sequence", "-o", "x.png"), "output: "),
        (("frames/*.svg", "frames/f[89].svg", "--sequence"), "differ: source 4, target 2 files"),
        (("square.svg", "frames/*.svg", "--sequence", "--fit", "cover"), "fit whole"),
        (("square.svg", "frames/*.svg", "--sequence", "--method", "paper"), "balanced method"),
        (("square.svg", "frames/*.svg", "--sequence", "--watch"), "--watch: "),
        (("square.svg", "blob.svg", "--resume"), "--resume: "),
        (("square.svg", "blob.svg", "--start", "blob.svg"), "blob.svg: not a saved map"),
        (("square.svg", "blob.svg", "--start", "none.npz"), "none.npz: no such file"),
        (("square.svg", "blob.svg", "--start", "paper.npz"), "not a balanced map"),
        (("square.svg", "blob.svg", "--start", "paper.npz", "--method", "paper"), "add --method balanced"),
    ],
)
def test_inputs_that_are_not_a_sequence_are_refused(frames, iccm, arguments, message):
    image_files.write("t.png", image_files.Image(np.zeros((2, 2, 3), np.uint8)))
    if "paper.npz" in arguments:
        core.fit([0, 1, 1 + 1j, 1j], [0, 2, 2 + 1j, 1j], method="paper", order=0, vertices=20).save(
            "paper.npz"
        )
    result = iccm("map", *arguments)
    errors = [line for line in result.lines if line.startswith("error: ")]
    assert result.code == 2 and errors and message in errors[0], result.err
    assert not list(Path(".").glob("*.png")) or {path.name for path in Path(".").glob("*.png")} == {"t.png"}


@pytest.mark.slow
def test_a_frame_that_exceeds_a_limit_makes_the_exit_code_1(frames, iccm):
    result = iccm(
        *("map", "square.svg", "frames/f[89].svg", "--sequence", "--max-stretch", "1.02"),
        *("-o", "{target.stem}.png", *SMALL),
    )
    assert result.code == 1, result.err
    assert Path("f8.png").exists() and Path("f9.png").exists()

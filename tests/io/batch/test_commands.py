"""Batches of `iccm flatten` and `iccm relayout`, with the manifests, journal and pools of `iccm map`."""

import json

import pytest

from iccm import cli
from iccm.io.batch import manifest
from iccm.io.batch.manifest import ManifestError

TENT = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 .3\n"
FACES = "f 1{0} 2{1} 5{4}\nf 2{1} 3{2} 5{4}\nf 3{2} 4{3} 5{4}\nf 4{3} 1{0} 5{4}\n"
UPRIGHT = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\n"
TURNED = "vt 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt .5 .5\n"
MANIFEST = """
[defaults]
size = 16
report = "{number}.json"
[[job]]
command = "flatten"
mesh = "old/*.obj"
uv = "{mesh.stem}-uv.obj"
[[job]]
command = "relayout"
old = "old/*.obj"
new = "new/{old.name}"
texture = "{old.stem}.png"
output = "{new.stem}-carried.png"
"""


@pytest.fixture
def meshes(tmp_path, monkeypatch, picture):
    """a.obj and b.obj in two layouts, old/ and new/, with a picture for each, and jobs.toml."""
    monkeypatch.chdir(tmp_path)
    for folder, uv in (("old", UPRIGHT), ("new", TURNED)):
        (tmp_path / folder).mkdir()
        for name in "ab":
            text = TENT + uv + FACES.format(*(f"/{k}" for k in range(1, 6)))
            (tmp_path / folder / f"{name}.obj").write_text(text)
            (tmp_path / f"{name}.png").write_bytes(picture)
    (tmp_path / "jobs.toml").write_text(MANIFEST)
    return tmp_path


@pytest.fixture
def picture():
    """A PNG file, red on the left and blue on the right."""
    from io import BytesIO

    from PIL import Image

    image, file = Image.new("RGB", (16, 16), "blue"), BytesIO()
    image.paste("red", (0, 0, 8, 16))
    image.save(file, "png")
    return file.getvalue()


def batch(capsys, *words):
    """The exit code, and the results in the order of the jobs."""
    code = cli.run(["batch", "jobs.toml", "--root", "out", "-j", "1", *words])
    return code, sorted(
        map(json.loads, capsys.readouterr().out.splitlines()), key=lambda records: records["job"]
    )


@pytest.mark.slow
def test_many_meshes_are_flattened_and_carried_and_resumed(meshes, capsys):
    from PIL import Image

    code, records = batch(capsys)
    assert (code, [record["status"] for record in records]) == (0, ["done"] * 4)
    assert [record["name"] for record in records] == ["a", "b", "a-a", "b-b"]
    assert records[0]["figures"]["uv"] == {"flipped": 0, "degenerate": 0}
    assert records[2]["figures"]["same_triangles"] == 4
    assert "\nvt " in (meshes / "out" / "a-uv.obj").read_text()
    carried = Image.open(meshes / "out" / "b-carried.png").convert("RGB")
    assert carried.size == (16, 16)
    assert carried.getpixel((8, 2)) == (255, 0, 0) and carried.getpixel((8, 13)) == (0, 0, 255)

    (meshes / "old" / "b.obj").write_text((meshes / "old" / "b.obj").read_text().replace(".3", ".4"))
    code, records = batch(capsys, "--resume")
    assert (code, [record["resumed"] for record in records]) == (0, [True, False, True, False])


@pytest.mark.slow
def test_a_job_that_fails_leaves_the_others(meshes, capsys):
    (meshes / "old" / "b.obj").write_text("v 0 0 0\nf 1 1 1\n")
    code, records = batch(capsys)
    assert (code, [record["status"] for record in records]) == (1, ["done", "failed", "done", "failed"])
    assert "b.obj" in records[1]["message"]


@pytest.mark.parametrize(
    "line, message",
    [
        ('command = "fold"', "command: must be one of map, flatten, relayout"),
        ('command = "flatten"\nuv = "a.obj"', "mesh"),
        ('command = "flatten"\nmesh = "old/a.obj"\nturn = 3', "turn: unknown key"),
        ('command = "flatten"\nmesh = "old/a.obj"\noutput = "a.wav"', "a flattening is written as .svg"),
        ('command = "flatten"\nmesh = "old/a.obj"\nmethod = "none.svg"', "none.svg: no such file"),
        ('command = "relayout"\nold = "old/a.obj"\nnew = "new/a.obj"', "output: is missing"),
        ('command = "relayout"\nold = "old/a.obj"\nnew = "new/a.obj"\noutput = "a.png"', "no texture"),
    ],
)
def test_mistakes_are_reported_before_anything_runs(meshes, line, message):
    with pytest.raises(ManifestError) as caught:
        manifest.read("[[job]]\n" + line, "jobs.toml", root=meshes)
    assert any(message in mistake for mistake in caught.value.mistakes), caught.value.mistakes


def test_defaults_hold_for_the_commands_that_know_them(meshes):
    text = '[defaults]\nsize = 8\ncut = true\n[[job]]\ncommand = "flatten"\nmesh = "old/a.obj"'
    (task,) = manifest.read(text, "jobs.toml", root=meshes)
    assert task.job.cut_open and task.job.outputs == (str(meshes / "a-flat.svg"),)
    with pytest.raises(ManifestError, match="colour: unknown key"):
        manifest.read(text.replace("size", "colour"), "jobs.toml", root=meshes)

"""Options that were given and have no effect are refused with a line that names them, and nothing is written.

In a batch, options that are given for several jobs may be without effect in some of them, but not in all.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

SQUARE = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 64 48">{}</svg>'
PLAIN = SQUARE.format('<path d="M8 6h48v20l-9 16H8z"/>')
OTHER = SQUARE.format('<path d="M10 9h40l8 14-8 20H10z"/>')
COLOURED = SQUARE.format('<path fill="#c22" d="M8 6h20v36H8z"/><path fill="#26a" d="M36 6h20v30H36z"/>')
PLATE = "v 0 0 0\nv 3 0 0\nv 3 2 0\nv 0 2 .5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in {"a.svg": PLAIN, "b.svg": OTHER, "c.svg": COLOURED, "m.obj": PLATE}.items():
        Path(name).write_text(text)
    rng = np.random.default_rng(4)
    Image.fromarray(rng.integers(0, 255, (12, 16, 3), dtype=np.uint8)).save("t.png")
    rings = [[0, 0], [9, 0], [9, 5], [0, 0]], [[9, 0], [14, 1], [9, 5], [9, 0]]
    features = [
        {"type": "Feature", "properties": {"v": value, "name": value},
         "geometry": {"type": "Polygon", "coordinates": [ring]}} for value, ring in zip((2, 7), rings)
    ]  # fmt: skip
    Path("regions.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    Path("points.csv").write_text("x,y\n20,20\n30,25\n")
    return tmp_path


@pytest.mark.parametrize(
    "command",
    [
        "map a.svg b.svg -o o.png --size 16 --colorspace sRGB",
        "map a.svg b.svg -o o.png --size 16 --texture c.svg --colorspace sRGB",
        "map a.svg b.svg -o o.png --size 16 --background paper",
        "map a.svg b.svg -o o.png --size 16 --texture t.png --background transparent",
        "map c.svg b.svg -o o.png --size 16 --place inside --background paper",
        "map a.svg b.svg -o o.png --size 16 --detail .5",
        "map a.svg m.obj -o o.obj --texture t.png --detail .5",
        "map a.svg b.svg -o o.png --size 16 --exact-pins",
        "map a.svg b.svg -o o.png --size 16 --rigid-each",
        "morph a.svg b.svg -o o.gif --frames 2 --size 16 --exact-pins",
        "map a.svg b.svg -o o.png --size 16 --method conformal --pin-weight 2",
        "map a.svg b.svg -o o.png --size 16 --method conformal --stroke-weight 2",
        "map a.svg b.svg -o o.png --size 16 --no-cut",
        "map a.svg b.svg -o o.png --size 16 --cut-open",
        "map a.svg b.svg -o o.npz --filter nearest",
        "map a.svg b.svg -o o.npz --edge transparent",
        "map a.svg b.svg -o o.npz --size 16",
        "map a.svg b.svg -o o.svg --size 16",
        "map a.svg b.svg -o o.npz --padding 3",
        "map a.svg b.svg -o o.npz --texture-turn 3",
        "map a.svg b.svg -o o.npz --texture-box bbox",
        "map a.svg m.obj -o o.obj --texture t.png --edge transparent",
        "map a.svg b.svg -o o.npz --carry-maps",
        "map a.svg b.svg -o o.npz --subdivide-rim",
        "map a.svg b.svg -o o.png --sequence",
        "flatten m.obj -o o.svg --margin 2",
        "flatten m.obj -o o.obj --unit um",
        "flatten m.obj -o o.svg --onto b.svg --method lscm",
        "apply b.npz points.csv -o o.csv --filter nearest",
        "apply b.npz points.csv -o o.csv --edge repeat",
        "apply b.npz points.csv -o o.csv --colorspace sRGB",
        "apply b.npz points.csv -o o.csv --max-line-error .5",
        "apply b.npz points.csv -o o.csv --size 20",
        "apply b.npz t.png -o o.png --unmapped keep",
        "apply b.npz a.svg -o o.svg --filter nearest",
        "apply b.npz a.svg -o o.svg --edge repeat",
        "apply b.npz a.svg -o o.svg --kind data",
        "field b.npz -o o.tif --moving t.png",
        "cartogram regions.geojson --by v --key name -o o.geojson",
        "morph a.svg b.svg -o m-{number}.svg --frames 3 --fps 5",
        "morph a.svg b.svg -o m-{number}.svg --frames 3 --size 20",
        "morph a.svg b.svg -o m.css.svg --frames 3 --texture t.png",
        "morph a.svg b.svg -o m-{number}.svg --frames 3 --back-and-forth",
    ],
)
def test_an_option_without_effect_is_refused(iccm, files, command):
    if command.startswith(("apply", "field")):
        assert iccm(*["map", "a.svg", "b.svg", "-o", "b.npz"]).code == 0
    before = sorted(files.iterdir())
    result = iccm(*command.split())
    refused = [word for word in command.split() if word.startswith("--") and word in result.err]
    assert result.code == 2 and refused and len(result.err.strip().splitlines()) == 1, result.err
    assert sorted(files.iterdir()) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "map a.svg b.svg -o o.png --size 16 --place fill --edge clamp --filter auto",  # the defaults
        "map a.svg b.svg -o o.png --size 16 --texture t.png --colorspace sRGB --filter nearest",
        "map c.svg b.svg -o o.png --size 16 --background paper --detail .5",
        "map c.svg b.svg -o o.png --size 16 --place inside --background transparent",
        "map a.svg b.svg -o o.png --size 16 --exact-pins --pin 20,20:21,20",
        "map a.svg b.svg -o o.npz --target-box bbox",  # pictures that are carried later show this box
        "map a.svg b.svg -o o.npz --max-pixels 900 --max-faces 10 --allow-outside",  # limits
        "map a.svg b.svg --stmap o.exr --size 16 --edge repeat",
        "map a.svg m.obj -o o.obj --texture t.png --edge repeat --no-cut",
        "flatten m.obj -o o.svg --unit um",
    ],
)
def test_options_with_an_effect_and_defaults_are_accepted(iccm, files, command):
    result = iccm(*command.split())
    assert result.code == 0, result.err


@pytest.mark.slow
def test_in_a_batch_defaults_need_an_effect_in_one_job_only(iccm, files):
    jobs = '[defaults]\ntarget = "b.svg"\nfilter = "nearest"\n[[job]]\nsource = "a.svg"\noutput = "{}"\n'
    Path("jobs.toml").write_text(
        jobs.format("o.png") + 'size = 16\ntexture = "t.png"\n[[job]]\nsource = "c.svg"\noutput = "o.npz"\n'
    )
    result = iccm("batch", "jobs.toml")
    assert result.code == 0, result.err
    idle = {line["name"]: line["idle"] for line in map(json.loads, result.out.splitlines())}
    assert idle == {"a-b": [], "c-b": ["filter"]}
    Path("jobs.toml").write_text(jobs.format("p.npz"))
    result = iccm("batch", "jobs.toml")
    assert result.code == 1 and "--filter" in result.err and Path("p.npz").exists()


@pytest.mark.slow
def test_in_a_batch_a_value_of_the_job_itself_needs_an_effect(iccm, files):
    Path("jobs.toml").write_text(
        '[[job]]\nsource = "a.svg"\ntarget = "b.svg"\noutput = "o.npz"\nfilter = "nearest"\n'
    )
    result = iccm("batch", "jobs.toml")
    (line,) = map(json.loads, result.out.splitlines())
    assert result.code == 1 and line["status"] == "failed" and "--filter" in line["message"]


@pytest.mark.slow
def test_options_for_files_of_a_pattern_need_an_effect_in_one_of_them(iccm, files):
    options = [
        "batch",
        "[ac].svg",
        "b.svg",
        "-o",
        "{source.stem}-on-b.png",
        "--size",
        "16",
        "--background",
        "paper",
    ]
    assert iccm(*options).code == 0  # a.svg is a plain outline
    result = iccm(*options[:-2], "--exact-pins", "--force")
    assert result.code == 1 and "--exact-pins" in result.err and Path("c-on-b.png").exists()

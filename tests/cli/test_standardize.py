"""`iccm standardize`: drawn wings come onto their mean shape, with their patterns aligned."""

import csv
import json
from contextlib import nullcontext

import numpy as np
import pytest
from PIL import Image

from iccm.errors import InputError
from iccm.io.batch.pools import InProcess
from iccm.io.pictures import image_files
from iccm.io.standardize import run as standardize
from tests.conftest import validator
from tests.specimens import LANDMARKS, NAMES, Wing, write

SIZE = 160


def run(folder, *specimens, **more):
    """Standardise in this process; without specimens, all pictures of the folder."""
    values = {"landmarks": str(folder / "wings.tps"), "size": (SIZE,), "force": True} | more
    plan = standardize.Plan([str(name) for name in specimens or [folder]], str(folder / "out"), **values)
    return standardize.run(plan, lambda count: nullcontext(InProcess()))


def table(folder):
    with (folder / "out" / "specimens.csv").open(encoding="utf-8") as file:
        return {row["specimen"]: row for row in csv.DictReader(file)}


@pytest.fixture(scope="module")
def wings(tmp_path_factory):
    """Three wings with the same pattern, one of which is a mirror image, standardised together."""
    folder = tmp_path_factory.mktemp("wings")
    drawn = {"a": Wing(1), "b": Wing(2), "c": Wing(4, mirrored=True)}
    write(folder, drawn)
    return folder, drawn, run(folder, reflect=True)


@pytest.mark.slow
def test_the_same_pattern_has_nearly_no_spread(wings):
    folder, _, summary = wings
    assert summary.ok
    out = folder / "out"
    mean, spread = (image_files.read(out / f"{name}.tif").pixels for name in ("mean", "spread"))
    count = image_files.read(out / "count.tif").pixels[..., 0]
    assert mean.dtype == np.float32 and set(np.unique(count)) == {0, 3}
    inside = count == 3
    assert np.array_equal(mean[..., -1] > 0, inside)
    # without the map the wings' outlines alone would differ; with it only edges of the pattern are blurred
    assert np.median(spread[inside][:, :3]) < 0.01
    assert np.quantile(spread[inside][:, :3], 0.95) < 0.15
    kept = np.asarray(Image.open(out / "pictures" / "a.png").convert("RGB")) / 255
    assert np.abs(kept[inside] - mean[inside][:, :3]).mean() < 0.03


def test_the_report_is_as_its_schema(wings):
    report = json.loads((wings[0] / "out" / "report.json").read_text())
    schema = validator("standardize-1")
    schema.validate(report)
    assert set(report) == set(schema.schema["properties"])
    assert set(report["specimens"][0]) == set(schema.schema["properties"]["specimens"]["items"]["properties"])


def test_statistics_are_those_of_the_pictures(wings):
    out = wings[0] / "out"
    stack = np.array([np.asarray(Image.open(out / "pictures" / f"{k}.png")) for k in "abc"]) / 255
    inside = (stack[..., 3] >= 0.5).all(axis=0)
    mean, spread = (
        image_files.read(out / f"{name}.tif").pixels[inside][:, :3] for name in ("mean", "spread")
    )
    colours = stack[:, inside, :3]
    assert mean == pytest.approx(colours.mean(axis=0), abs=1e-6)
    assert spread == pytest.approx(colours.std(axis=0, ddof=1), abs=1e-6)


def test_landmarks_are_mapped_onto_those_of_the_mean(wings):
    import iccm

    folder, drawn, _ = wings
    rows = list(csv.DictReader((folder / "out" / "landmarks.csv").open(encoding="utf-8")))
    places = np.array([float(row["x"]) - 1j * float(row["y"]) for row in rows])
    for name in ("a", "b"):
        map = iccm.load(folder / "out" / "maps" / f"{name}.npz").map
        inner = drawn[name].landmarks[4:].conj()
        assert np.abs(map(inner) - places[4:]).max() < 0.01 * SIZE
        # the pattern around the eye comes along
        ring = drawn[name].pixels_of(LANDMARKS[4] + 0.04 * np.exp(1j * np.arange(8))).conj()
        assert abs(map(ring).mean() - places[4]) < 0.02 * SIZE
    # the outline of the mean turns back at its corners, where landmarks are
    assert len(rows) == len(NAMES)


def test_the_table_has_a_row_for_each_specimen(wings):
    rows = table(wings[0])
    assert {name: row["mirrored"] for name, row in rows.items()} == {"a": "False", "b": "False", "c": "True"}
    assert all(0 < float(row["procrustes_distance"]) < 0.1 for row in rows.values())
    sizes = [float(row["centroid_size"]) for row in rows.values()]
    points = wings[1]["b"].landmarks
    assert sizes[1] == pytest.approx(np.sqrt(np.sum(np.abs(points - points.mean()) ** 2)), rel=1e-3)
    report = json.loads((wings[0] / "out" / "report.json").read_text(encoding="utf-8"))
    assert report["landmarks_on_outline"] == ["1", "4", "3", "2"] and report["summarised"] == 3


@pytest.mark.slow
def test_without_reflection_a_mirror_image_fails_and_the_others_do_not(wings):
    summary = run(wings[0])
    assert not summary.ok
    assert {row["specimen"]: row["status"] for row in summary.rows} == {
        "a": "done",
        "b": "done",
        "c": "failed",
    }
    assert "reflect" in next(row["message"] for row in summary.rows if row["specimen"] == "c")


@pytest.mark.slow
def test_a_reference_is_mapped_onto_itself(tmp_path):
    write(tmp_path, {"a": Wing(1), "b": Wing(2)})
    (tmp_path / "broken.png").write_bytes(b"no picture")
    summary = run(tmp_path, reference="b")
    rows = {row["specimen"]: row for row in summary.rows}
    assert rows["broken"]["status"] == "failed" and rows["broken"]["picture"] is None
    assert rows["b"]["dilatation_p95"] < 1.1 < rows["a"]["dilatation_p95"]
    assert rows["a"]["status"] == "done"


@pytest.mark.slow
def test_as_typed_with_a_file_of_landmarks_for_each(tmp_path, iccm, monkeypatch):
    drawn = {"left": Wing(5, 120), "right": Wing(6, 120)}
    write(tmp_path / "pictures", drawn)
    (tmp_path / "points").mkdir()
    for name, wing in drawn.items():
        rows = [f"{a},{z.real:.3f},{z.imag:.3f}" for a, z in zip(NAMES, wing.landmarks)]
        (tmp_path / "points" / f"{name}_landmarks.csv").write_text("\n".join(["name,x,y", *rows]))
    monkeypatch.chdir(tmp_path)
    typed = [
        "standardize",
        "pictures/*.png",
        "--landmarks",
        "points",
        "-o",
        "OUT",
        "--size",
        "100",
        "-j",
        "1",
    ]
    result = iccm(*typed)
    assert (result.code, result.out) == (0, ""), result.err
    assert Image.open("OUT/mean.png").width == 100
    again = iccm(*typed)
    assert again.code == 2 and "OUT/shape.svg" in again.err and "--force" in again.err
    resumed = iccm(*typed, "--resume")
    assert resumed.code == 0, resumed.err


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda text: "", "landmarks"),
        (lambda text: text.replace("LM=6", "LM=60", 1), "not a position"),
        (lambda text: text.split("ID=a\n")[1], "no landmarks for a.png"),
        (lambda text: text.replace("IMAGE=a.png", "IMAGE=b.png", 1), "more than one specimen"),
        (
            lambda text: text.replace("IMAGE", "COMMENT").replace("ID=", "NOTE=") + "LM=1\n3 3\n",
            "without names",
        ),
    ],
)
def test_spoilt_landmarks_are_refused_before_anything_is_written(tmp_path, spoil, words):
    write(tmp_path, {"a": Wing(1, 90), "b": Wing(2, 90)})
    path = tmp_path / "wings.tps"
    path.write_text(spoil(path.read_text()))
    with pytest.raises(InputError, match=words):
        run(tmp_path)
    assert not [path for path in (tmp_path / "out").rglob("*") if path.is_file()]


@pytest.mark.parametrize(
    ("row", "words"),
    [("NA NA", "has no position"), ("1e99999 3", "not a coordinate")],
)
def test_one_wrong_landmark_refuses_its_specimen(tmp_path, row, words):
    write(tmp_path, {"a": Wing(1, 90), "b": Wing(2, 90), "c": Wing(4, 90)})
    path = tmp_path / "wings.tps"
    lines = path.read_text().splitlines()
    lines[1] = row
    path.write_text("\n".join([*lines[:-9], "LM=1", "3 3", "IMAGE=c.png"]))  # so that only one is left
    with pytest.raises(InputError, match=words):
        run(tmp_path)


def test_two_specimens_of_the_same_name_are_refused(tmp_path):
    write(tmp_path, {"a": Wing(1, 90)})
    write(tmp_path / "more", {"a": Wing(2, 90)})
    with pytest.raises(InputError, match="more than one specimen"):
        run(tmp_path, tmp_path / "a.png", tmp_path / "more" / "a.png")

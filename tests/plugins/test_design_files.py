"""What the pages for design programs promise: drawings in the form of their exports go onto a shape and come back."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
EXPORTED = ROOT / "tests" / "io" / "artwork" / "exported"
SHIELD = ROOT / "docs" / "files" / "shield.svg"
PROGRAMS = ("affinity", "figma", "illustrator")
FILES = [path for program in PROGRAMS for path in sorted(EXPORTED.glob(f"{program}-*.svg"))]
DRAWN = ("path", "image", "g", "use", "text")


def elements(path):
    """The elements of a drawing by their names without namespace."""
    return [(e.tag.rpartition("}")[2], e) for e in ElementTree.parse(path).iter() if isinstance(e.tag, str)]


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_an_exported_drawing_goes_onto_a_shape_and_back_as_paths(path, iccm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = iccm("map", f"{path}#canvas", str(SHIELD), "-o", "placed.svg")
    assert done.code in (0, 1), done.err
    made = elements("placed.svg")
    assert any(name in ("path", "image") for name, _ in made)
    size = [
        [ElementTree.parse(file).getroot().get(name) for name in ("width", "height")]
        for file in (SHIELD, "placed.svg")
    ]
    assert None in size[0] or [parse(text) for text in size[0]] == pytest.approx(
        [parse(text) for text in size[1]]
    )
    for _, element in made:
        for key, value in element.attrib.items():
            if key.rpartition("}")[2] == "href":
                assert value.startswith(("#", "data:")), value
            assert "url(http" not in value


def parse(length):
    return float(re.match(r"[\d.]+", length)[0])


@pytest.mark.slow
def test_layers_of_one_canvas_align_after_the_map(iccm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pixels = np.zeros((60, 80, 4), np.uint8)
    pixels[10:50, 15:60] = (200, 40, 30, 255)
    Image.fromarray(pixels).save("shape.png")
    pixels[..., :3] = np.where(np.arange(80)[None, :, None] < 40, 20, 230)
    Image.fromarray(pixels).save("base.png")
    mask = np.where(np.arange(80) < 40, 0, 255)[None].repeat(60, 0).astype(np.uint8)
    Image.fromarray(mask).save("mask.png")
    done = iccm(
        "map", "shape.png", str(SHIELD), "--texture", "base.png", "--data", "mask.png", "-o", "on-{stem}.png"
    )
    assert done.code == 0, done.err
    base, data = (np.asarray(Image.open(f"on-{stem}.png").convert("RGBA")) for stem in ("base", "mask"))
    assert base.shape[:2] == data.shape[:2]
    inside = (base[..., 3] > 250) & (data[..., 3] > 250)
    agree = (base[..., 0] > 128) == (data[..., 0] > 128)
    assert inside.mean() > 0.2 and agree[inside].mean() > 0.98

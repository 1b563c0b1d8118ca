"""Drawings as design programs export them, carried by the identity, look as the originals do in Chromium.

The files are small, and written after the exports of each program: its structure, names and effects.
"""

import base64
import re
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image
from shapely.ops import unary_union

from iccm.arrays import xy_of
from iccm.io.artwork import carry, rendering
from iccm.io.shapes import shape as shapes
from iccm.io.svg import reader
from iccm.maps.triangulated.map import TriangulatedMap
from tests import chromium

EXPORTED = sorted((Path(__file__).parent / "exported").glob("*.svg"))
PROGRAMS = ("affinity", "canva", "figma", "illustrator", "inkscape", "penpot", "sketch")
SHARE = 0.01  # of pixels that may differ by more than a faint edge does
# Text is hinted by Chromium, but not as paths; a line under a stretched circle varies in width.
KNOWN = {"penpot-text.svg": 0.025, "affinity-stroke.svg": 0.015}


def identity(shape):
    """The identity on the canvas of a drawing."""
    z = shape.curve.z
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return TriangulatedMap(z, z, faces, (np.arange(4),))


def carried(path, folder):
    shape = shapes.read(f"{path}#canvas")
    out = folder / f"carried-{path.name}"
    notes = carry(shape, identity(shape), shape, out)
    return out, notes


def test_there_are_forty_files_of_seven_programs():
    names = {path.name.partition("-")[0] for path in EXPORTED}
    assert len(EXPORTED) >= 40 and names == set(PROGRAMS)


def test_the_reference_lists_the_programs_with_what_is_compared():
    page = (Path(__file__).parents[3] / "docs" / "reference" / "artwork.md").read_text(encoding="utf-8")
    rows = [
        line.strip("| ").split(" | ") for line in page.split("## Programs")[1].split("## ")[0].splitlines()
    ]
    listed = {row[0].lower(): row[1:3] for row in rows if len(row) > 3 and row[1].isdigit()}
    files = {program: [p for p in EXPORTED if p.name.startswith(program)] for program in PROGRAMS}
    assert listed == {
        program: [str(len(paths)), str(sum(p.name not in KNOWN for p in paths))]
        for program, paths in files.items()
    }


@pytest.mark.parametrize("path", EXPORTED, ids=lambda path: path.stem)
def test_everything_that_is_drawn_is_carried(path, tmp_path):
    out, notes = carried(path, tmp_path)
    omitted = [note for note in notes if "omitted" in note and "foreignObject" not in note]
    assert re.search(r"<(path|image)\b", out.read_text(encoding="utf-8")) and not omitted


@pytest.mark.slow
@chromium.needed
@pytest.mark.parametrize("program", PROGRAMS)
def test_carried_drawings_look_as_exported(program, tmp_path):
    files = [path for path in EXPORTED if path.name.startswith(program)]
    copies = [carried(path, tmp_path)[0] for path in files]
    pictures = chromium.pictures([drawing for pair in zip(files, copies) for drawing in pair], 300)
    shares = {path.name: chromium.differing(*pictures[2 * k : 2 * k + 2]) for k, path in enumerate(files)}
    assert all(share <= KNOWN.get(name, SHARE) for name, share in shares.items()), shares
    painted = [bool((pictures[2 * k] < 250).any()) for k in range(len(files))]
    assert all(painted)


STYLES = {
    "clips": '<rect x="5" y="5" width="40" height="40" fill="#36c" style="clip-path:circle(15px at 25px 25px)"/>'
    '<rect x="55" y="5" width="40" height="40" fill="#c36" stroke="#000" stroke-width="6" '
    'style="clip-path:polygon(0 0,100% 0,50% 100%)"/>'
    '<g style="clip-path:inset(10% 20px round 8px / 4px)"><rect x="5" y="55" width="90" height="40" fill="#3c6"/></g>'
    '<rect x="75" y="5" width="24" height="24" fill="#993" style="clip-path:path(\'M75 5L99 29L99 5z\')"/>',
    "filters": '<rect x="20" y="20" width="30" height="30" fill="#c33" '
    'style="filter:drop-shadow(6px 4px 3px #036) hue-rotate(60deg)"/><circle cx="70" cy="70" r="15" fill="#fc0" '
    'style="filter:brightness(.7) contrast(140%) blur(2px)"/><rect x="70" y="10" width="20" height="20" fill="#08f" '
    'style="filter:sepia(.8) invert(20%) opacity(.6)"/>'
    '<rect x="10" y="70" width="20" height="20" fill="#08f" style="filter:grayscale(1) saturate(2)"/>',
    "sheets": "<style>:root{--ink:#840} .v{fill:var(--ink)} .w{fill:var(--none, #0a6)}"
    "@supports (fill:red){.s{fill:#08f}}"
    "@layer a,b; @layer b{.l{fill:#f0f}} @layer a{rect.l{fill:#333}} g>rect:nth-of-type(2){fill:#c00}"
    "g>circle:last-of-type{fill:#0cc} #p{d:path('M60 60h30v30z')} #r{width:20px;height:12px;x:8px;y:70px;rotate:20deg;"
    "transform-origin:18px 76px;translate:4px -3px}</style>"
    '<rect class="v" width="20" height="20"/><rect class="w" x="20" width="20" height="20"/>'
    '<rect class="s" x="40" width="20" height="20"/><rect class="l" x="60" width="20" height="20"/>'
    '<g><rect y="30" width="20" height="20"/><circle cx="50" cy="40" r="8"/>'
    '<rect x="20" y="30" width="20" height="20"/><circle cx="70" cy="40" r="8"/></g><path id="p"/><rect id="r"/>',
    "contexts": '<symbol id="s" viewBox="0 0 10 10"><g fill="context-fill"><circle cx="5" cy="5" r="4" '
    'stroke="context-stroke"/></g></symbol><use href="#s" width="50" height="50" fill="#0a0" stroke="#a00"/>'
    '<use href="#s" x="50" y="50" width="50" height="50" fill="#fa0"/><marker id="t" viewBox="0 0 10 10" refX="5" '
    'refY="5" markerWidth="5" markerHeight="5" orient="auto-start-reverse"><path d="M0 0L10 5L0 10z" '
    'fill="context-stroke"/></marker><path d="M8 60L40 60L30 90" fill="none" stroke="#c06" stroke-width="3" '
    'marker-start="url(#t)" marker-mid="url(#t)" marker-end="url(#t)"/>',
    "positions": "<style>svg > g:nth-of-type(2) rect:not(.x):nth-child(odd){fill:#c2a}"
    'g[data-k~="b"] > circle:first-child{fill:#0aa}</style><g color="#174"><rect width="9" height="9"/></g>'
    '<g color="#174"><rect x="10" y="10" width="20" height="20"/><rect x="40" y="10" width="20" height="20" '
    'fill="#888"/><rect class="x" x="70" y="10" width="20" height="20" fill="currentColor"/></g><g data-k="a b">'
    '<circle cx="25" cy="60" r="12"/><circle cx="55" cy="60" r="12"/></g>',
    "groups": '<clipPath id="c"><g><circle cx="30" cy="30" r="20"/></g><circle cx="60" cy="60" r="30"/></clipPath>'
    '<rect width="100" height="100" fill="#36c" clip-path="url(#c)"/>',
    "letters": '<g font-family="DejaVu Sans" font-size="24">'
    '<text x="98" y="25" direction="rtl">\u05e9\u05dc\u05d5\u05dd 12</text>'
    '<text x="2" y="55" style="text-decoration:line-through overline" fill="#a00">Lines</text>'
    '<text x="2" y="90" font-variant="small-caps" dominant-baseline="middle">Caps</text></g>',
}  # fmt: skip


@pytest.mark.slow
@chromium.needed
def test_styles_of_css_look_as_in_chromium(tmp_path):
    """As artwork, and as the picture that is rendered for textures."""
    drawings = []
    for name, body in STYLES.items():
        path = tmp_path / f"{name}.svg"
        path.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">{body}</svg>', encoding="utf-8"
        )
        rendered = rendering.render(path, (-100j, 100 + 0j), (300, 300)).pixels
        Image.fromarray(rendered).save(tmp_path / f"{name}.png")
        data = base64.b64encode((tmp_path / f"{name}.png").read_bytes()).decode()
        (tmp_path / f"{name}-rendered.svg").write_text(
            '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 300 300">'
            f'<image width="300" height="300" href="data:image/png;base64,{data}"/></svg>'
        )
        drawings += [path, carried(path, tmp_path)[0], tmp_path / f"{name}-rendered.svg"]
    pictures = chromium.pictures(drawings, 300)
    for k, name in enumerate(STYLES):
        shown, artwork, rendered = pictures[3 * k : 3 * k + 3]
        share = 0.02 if name == "letters" else SHARE  # hinted letters
        assert chromium.differing(shown, artwork) <= share, name
        assert chromium.differing(shown, rendered) <= share, name


def test_patterns_bend(tmp_path):
    """Where the map moves each column of the canvas up and down, tiles become strips that follow it."""
    drawing, out = tmp_path / "tiles.svg", tmp_path / "out.svg"
    drawing.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 80 40"><pattern id="p" width="40" height="10" '
        'patternUnits="userSpaceOnUse"><rect width="30" height="5" fill="#c00"/></pattern>'
        '<rect width="80" height="40" fill="url(#p)"/></svg>'
    )
    shape = shapes.read(f"{drawing}#canvas")
    x, y = np.meshgrid(np.linspace(0, 80, 161), np.linspace(-40, 0, 81))
    z = (x + 1j * y).ravel()
    grid = np.arange(z.size).reshape(x.shape)
    corners = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    loop = np.concatenate([grid[0], grid[1:, -1], grid[-1, -2::-1], grid[-2:0:-1, 0]])
    map = TriangulatedMap(z, z + 1j * _lift(z.real), faces, (loop,))
    notes = carry(shape, map, shape, out)
    assert "<pattern" not in out.read_text() and not any("pattern" in note for note in notes)
    tiles = unary_union([shapely.Polygon(xy_of(outline.z)) for outline in reader.read(out).outlines])
    strips = []
    for left in (0, 40):
        for top in (0, 10, 20, 30):
            along = np.linspace(left, left + 30, 60)
            edge = along + 1j * (top - _lift(along))  # y down
            strips.append(shapely.Polygon(xy_of(np.concatenate([edge, edge[::-1] + 5j]))))
    expected = unary_union(strips)
    assert tiles.symmetric_difference(expected).area < 0.01 * expected.area


def _lift(x):
    return x * (80 - x) / 200

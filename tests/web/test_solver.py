"""The solver of the demo: its calls of the core and its constants are those of Python, and so are its maps."""

import json
import re
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import iccm
from iccm.balanced.minimise.energy import energy_of
from iccm.curve import Curve, hausdorff, interior_grid
from iccm.plane import triangle_areas

from .pinned import pinned_energy

ROOT = Path(__file__).parents[2]
WEB = ROOT / "web"
PROTOTYPE = re.compile(
    r"(?:declare|struct|function|record)\(\s*(?:\"\"\"|\"|'|`)(.*?)(?:\"\"\"|\"|'|`)\s*\)", re.S
)
SHAPES = {
    **{name: f"docs/files/{name}.svg" for name in ("heart", "bell", "shield", "hand", "home", "worm", "arc")},
    "rose": "samples/rose-leaf/rose.svg",
    "leaf": "samples/rose-leaf/leaf.svg",
    "fish": "samples/raster/fish.svg",
    "whale": "samples/raster/whale.svg",
    "square": "samples/square-country/square.svg",
    "france": "samples/square-country/france.svg",
    "hexagon": "samples/hexagon-blob/hexagon.svg",
    "blob": "samples/hexagon-blob/blob.svg",
    "gingerbread": "samples/limbs/gingerbread.svg",
    "starfish": "samples/limbs/starfish.svg",
}
PAIRS = [
    ("hand", "whale", 1.0),
    ("square", "heart", 1.0),
    ("heart", "bell", 1.0),
    ("rose", "leaf", 1.0),
    ("fish", "whale", 2.0),
    ("square", "france", 1.0),
    ("hexagon", "blob", 1.0),
    ("gingerbread", "starfish", 1.0),
    ("square", "hand", 1.0),
    ("shield", "home", 0.5),
    ("leaf", "worm", 1.0),
    ("blob", "arc", 1.0),
]
PINNED = (0, 1, 4, 5, 9)
"""Of these pairs, those that are also mapped with two pins."""
ENERGY_TOLERANCE = 0.02
OUTLINE_TOLERANCE = 1e-3  # of the diagonal, as by default of the command


def declared(folder, suffix):
    """The prototypes and structs in files of a folder, without differences of white space."""
    declarations = set()
    for path in folder.rglob(f"*{suffix}"):
        for text in PROTOTYPE.findall(path.read_text()):
            if text.lstrip().startswith(("int64_t ", "double ", "struct ")):
                declarations.add(re.sub(r"\s+", " ", text.strip()).replace("( ", "("))
    return declarations


def test_prototypes_and_structs_are_those_of_python():
    in_javascript = declared(WEB, ".js")
    assert len(in_javascript) > 20
    assert in_javascript <= declared(ROOT / "iccm", ".py")


@pytest.mark.parametrize("path", sorted(WEB.glob("*.js")), ids=lambda path: path.name)
def test_files_of_the_search_have_no_copies_of_shared_constants(path):
    shared = re.findall(r"^export const (\w+)", (WEB / "constants.js").read_text(), re.M)
    own = re.findall(r"^(?:export )?const ([A-Z][A-Z_]+) = ", path.read_text(), re.M)
    assert len(shared) > 50 and (path.name == "constants.js" or not set(own) & set(shared))


@pytest.mark.slow
@pytest.mark.timeout(900)  # compiles the core
@pytest.mark.skipif(
    not shutil.which("node") or find_spec("ziglang") is None,
    reason="NO TESTS OF THE DEMO: needs Node.js and ziglang",
)
def test_maps_cost_the_same_as_those_of_the_command(core, tmp_path):
    shapes = {name: iccm.read_shape(ROOT / path) for name, path in SHAPES.items()}
    outlines = {name: shape.curve.z for name, shape in shapes.items()}

    def pair(source, target, balance, pins=()):
        ends = (np.c_[z.real, z.imag].tolist() for z in (outlines[source], outlines[target]))
        numbers = [[*xy(pin.source), *xy(pin.target)] for pin in pins]
        return dict(zip(("source", "target"), ends), balance=balance, pins=numbers)

    fits = [
        iccm.fit(shapes[source], shapes[target], fit="whole", balance=balance)
        for source, target, balance in PAIRS
    ]
    problems = [(*names, []) for names in PAIRS]
    for number in PINNED:
        source, target, balance = PAIRS[number]
        pins = two_pins(fits[number])
        problems.append((source, target, balance, pins))
        fits.append(iccm.fit(shapes[source], shapes[target], fit="whole", balance=balance, pins=pins))
    given = tmp_path / "pairs.json"
    given.write_text(json.dumps([pair(*problem) for problem in problems]))
    command = ["node", Path(__file__).with_name("solve.js"), core, given]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    for (source, target, balance, pins), solved, fit in zip(
        problems, json.loads(result.stdout), fits, strict=True
    ):
        name = f"{source} to {target}, {len(pins)} pins"
        z, u = (np.array(solved[side]).reshape(-1, 2) @ [1, 1j] for side in "zu")
        faces = np.array(solved["faces"]).reshape(-1, 3)
        assert min(triangle_areas(w[faces]).min() for w in (z, u)) > 0, name

        def energy(z, u, faces, fit=fit, balance=balance):
            return (
                pinned_energy(fit, z, u, faces, balance) if len(fit.pins) else energy_of(z, u, faces, balance)
            )

        # radii of pins follow from distances to the outlines, which the demo simplifies
        assert solved["energy"] == pytest.approx(energy(z, u, faces), rel=1e-3 if pins else 1e-9), name
        expected = energy(fit.map.source, fit.map.image, fit.map.faces)
        assert abs(solved["energy"] / expected - 1) <= ENERGY_TOLERANCE, name
        for w, shape in ((z, outlines[source]), (u, outlines[target])):
            assert (
                hausdorff(Curve(rim(w, faces)), Curve(shape)) <= OUTLINE_TOLERANCE * Curve(shape).diagonal
            ), name


def xy(point):
    return [point.real, point.imag]


def two_pins(fit):
    """A pin far from the outline that moves by half of its distance to it, and one that stays near its image."""
    points = interior_grid(fit.source, 400)
    room = fit.source.distances(points)
    first = points[np.argmax(room)]
    second = points[np.argmax(room * np.minimum(1, np.abs(points - first) / (fit.source.diagonal / 3)))]
    place = fit.map(first)
    away = 0.5 * fit.target.distances(np.array([place]))[0] * np.exp(0.7j)
    return [iccm.Pin(first, complex(place + away)), iccm.Pin(second, complex(fit.map(second)))]


def rim(w, faces):
    """The outline of a mesh, in order."""
    edges = {(a, b) for face in faces.tolist() for a, b in zip(face, face[1:] + face[:1])}
    after = {a: b for a, b in edges if (b, a) not in edges}
    order = [next(iter(after))]
    while after[order[-1]] != order[0]:
        order.append(after[order[-1]])
    return w[order]

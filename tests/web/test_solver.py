"""The solver of the demo: its calls of the core and its constants are those of Python, and so are its maps."""

import importlib
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
CONSTANTS = {
    "search.js": {
        "COARSE_SIZE": "search.multilevel.COARSE_MESH_SIZE",
        "FINE_SIZE": "search.multilevel.FINE_MESH_SIZE",
        "COARSE_SIZE_BY_LENGTH": "search.multilevel.COARSE_SIZE_BY_LENGTH",
        "TRIANGLES_PER_AREA": "search.final_mesh.TRIANGLES_PER_AREA",
        "PROMISING": "search.candidates.PROMISING_ENERGY_RATIO",
        "MOST_START_VERTICES": "search.levels.MOST_START_VERTICES",
        "BACKWARD_STEPS": "search.levels.BACKWARD_STEPS",
        "SETTLING": "search.candidates.SETTLING",
        "ROUNDS": "search.candidates.ROUNDS",
        "CLOSE": "search.candidates.CLOSE",
        "FINALISTS": "search.candidates.FINALISTS",
        "RELEASE_ROUNDS": "search.candidates.RELEASE_ROUNDS",
        "RELEASED_STEPS": "search.levels.RELEASED_STEPS",
        "RELEASE_GAIN": "search.candidates.RELEASE_GAIN_SHARE",
        "FINE_POWER": "search.levels.FINE_POWER",
        "FINE_ROUNDS": "search.levels.FINE_ROUNDS",
        "FINE_BACKWARD": "search.levels.FINE_BACKWARD",
        "LAST_ROUNDS": "search.final_mesh.LAST_ROUNDS",
        "LAST_STEPS": "search.final_mesh.LAST_STEPS",
        "LAST_DECREASE": "search.final_mesh.LAST_DECREASE",
        "LAST_DECREASE_WITH_PINS": "search.final_mesh.LAST_DECREASE_WITH_PINS",
        "STIFFENINGS": "search.final_mesh.STIFFENINGS",
        "MOST_STIFFENED": "search.final_mesh.MOST_STIFFENED",
        "BLOCKED_MISS": "search.final_mesh.BLOCKED_MISS",
        "BLOCKED_ENERGY": "search.final_mesh.BLOCKED_ENERGY",
        "AIMED_LIMITS": "search.final_mesh.AIMED_LIMITS",
    },
    "map.js": {
        "UPRIGHT": "model.energy.UPRIGHT",
        "OUTLINE_WEIGHT": "minimise.sliding.OUTLINE_WEIGHT",
        "SPACING_MESH_SIZES": "search.levels.SPACING_MESH_SIZES",
        "MOST_PAIRS": "search.levels.MOST_PAIRS",
        "STEPS": "minimise.untangle.STEPS",
        "PATIENT_STEPS": "search.levels.PATIENT_STEPS",
        "SMOOTHED_RINGS": "model.discrete_map.SMOOTHED_RINGS",
        "SMOOTHINGS": "model.discrete_map.SMOOTHINGS",
        "FORWARD": "model.discrete_map.FORWARD",
        "GOOD_ENOUGH": "model.discrete_map.GOOD_ENOUGH",
        "SETTLED": "model.discrete_map.SETTLED",
        "BADLY_STRETCHED": "model.discrete_map.BADLY_STRETCHED",
        "EASING_STEPS": "model.discrete_map.EASING_STEPS",
        "EASED": "model.discrete_map.EASED",
    },
    "unfold.js": {
        "LEAST_WEIGHT": "minimise.untangle.LEAST_WEIGHT",
        "ENOUGH": "minimise.untangle.ENOUGH",
        "POLISHED": "minimise.untangle.POLISHED",
        "DEEP": "minimise.untangle.DEEP",
        "SLOW": "minimise.untangle.SLOW",
        "SHRINK": "minimise.untangle.SHRINK",
        "LEAST_EPSILON": "minimise.untangle.LEAST_EPSILON",
        "PACE": "minimise.untangle.PACE",
        "BARE": "minimise.unfold.BARE",
        "LOCAL_STEPS": "minimise.unfold.STEPS",
        "LOCAL_POLISHING": "minimise.unfold.POLISHING",
        "LOCAL_SHARE": "model.discrete_map.LOCAL",
    },
    "matching.js": {
        "SAMPLES": "search.initial_matches.OUTLINE_SAMPLES",
        "CYCLIC_SHIFTS": "search.initial_matches.CYCLIC_SHIFTS",
        "POSITION_WEIGHT": "search.initial_matches.POSITION_WEIGHT",
        "TANGENT_CHORD_SHARE": "search.initial_matches.TANGENT_CHORD_SHARE",
        "DIFFERENT": "search.initial_matches.DIFFERENT_MATCH_DISTANCE",
        "ARCLENGTH_SHIFTS": "search.initial_matches.ARCLENGTH_SHIFTS",
        "TURNED_STARTS": "search.pin_continuation.TURNED_STARTS",
    },
    "mesh.js": {
        "MOST_MAGNIFIED": "model.mesh_sizes.MOST_MAGNIFIED",
        "GRID_CELLS_ACROSS": "model.mesh_sizes.GRID_CELLS_ACROSS",
        "TRIANGLES_A_RADIUS": "model.mesh_sizes.TRIANGLES_A_RADIUS",
        "MOST_FINER_AT_PINS": "model.mesh_sizes.MOST_FINER_AT_PINS",
        "MOST_MORE_AT_PINS": "model.mesh_sizes.MOST_MORE_AT_PINS",
    },
    "pairs.js": {"MERGED_SHARE": "model.boundary_pairs.MERGED_SPACING_SHARE"},
    "pins.js": {
        "COST_AT_TOLERANCE": "constraints.soft.COST_AT_TOLERANCE",
        "STIFFNESS": "constraints.soft.STIFFNESS",
        "CORE_SHARE": "minimise.soft_pins.CORE_SHARE",
        "LARGEST_CORE_RADIUS": "minimise.soft_pins.LARGEST_CORE_RADIUS",
        "CORE_MARGIN_RATIO": "minimise.soft_pins.CORE_MARGIN_RATIO",
        "FEWEST_CORE_VERTICES": "minimise.soft_pins.FEWEST_CORE_VERTICES",
        "TOLERANCE_SHARE": "constraints.soft.TOLERANCE_SHARE",
        "MOST_TOLERANCES": "constraints.soft.MOST_TOLERANCES",
    },
    "worker.js": {"NARROW_AIM": "search.final_mesh.NARROW_AIM"},
    "split.js": {
        "SAME_PLACE_SHARE": "model.outline_split.SAME_PLACE_SHARE",
        "SNAPPED_EDGE_SHARE": "model.outline_split.SNAPPED_EDGE_SHARE",
    },
}
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


def constant(text, name):
    """The number in `name = number` of a JavaScript source."""
    match = re.search(rf"\b{name} = ([\d._e-]+)", text)
    assert match, name
    return float(match[1].replace("_", ""))


@pytest.mark.parametrize("name", CONSTANTS)
def test_constants_are_those_of_python(name):
    text = (WEB / name).read_text()
    for ours, path in CONSTANTS[name].items():
        module, _, theirs = path.rpartition(".")
        assert constant(text, ours) == getattr(importlib.import_module(f"iccm.balanced.{module}"), theirs), (
            ours
        )


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

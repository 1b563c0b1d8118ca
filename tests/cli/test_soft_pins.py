"""Pins on the command line, in files and in drawings: soft by default, exact on request."""

import json

import pytest

pytestmark = pytest.mark.usefixtures("solve_once")

EGG = "M50 10C75 10 85 40 85 60C85 85 70 95 50 95C30 95 15 85 15 60C15 40 25 10 50 10Z"
PEAR = "M60 10C80 12 80 40 95 70C105 100 80 110 60 110C35 110 10 100 20 75C30 50 35 8 60 10Z"
PINS = ["--pin", "40,45:50,48", "--pin", "60,45:75,52"]


def draw(folder, name, path, extra=""):
    body = f'<path d="{path}"/>{extra}'
    file = folder / f"{name}.svg"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 120 120">{body}</svg>')
    return str(file)


@pytest.fixture
def pair(tmp_path):
    return draw(tmp_path, "egg", EGG), draw(tmp_path, "pear", PEAR)


def errors(iccm, folder, *arguments):
    """Return the miss of each pin, relative to the diagonal, and the messages."""
    report = folder / "report.json"
    result = iccm("map", *arguments, "-o", folder / "out.png", "--size", "64", "--report", report, "--force")
    assert result.code == 0, result.err
    return [pin["error"] for pin in json.loads(report.read_text())["pins"]], result.err


@pytest.mark.slow
def test_pins_are_soft_with_one_note_and_exact_on_request(iccm, tmp_path, pair):
    missed, notes = errors(iccm, tmp_path, *pair, *PINS)
    assert 1e-5 < max(missed) < 0.03
    assert notes.count("(--exact-pins)") == 1 and "exact_pins" not in notes and "note" in notes
    exact, notes = errors(iccm, tmp_path, *pair, *PINS, "--exact-pins")
    assert max(exact) < 1e-9 and "exact" not in notes


@pytest.mark.slow
def test_typed_settings_and_listed_ones_are_the_same(iccm, tmp_path, pair):
    first, _ = errors(
        iccm, tmp_path, *pair, "--pin", "40,45:50,48,radius=0", "--pin", "60,45:75,52,r=6,tolerance=1"
    )
    listed = [
        {"source": [40, 45], "target": [50, 48], "radius": 0},
        {"source": [60, 45], "target": [75, 52], "radius": 6, "tolerance": 1},
    ]
    file = tmp_path / "pins.json"
    file.write_text(json.dumps({"pins": listed}))
    second, _ = errors(iccm, tmp_path, *pair, "--constraints", file)
    assert first == second
    assert first[0] < 1e-9 < first[1]


@pytest.mark.slow
def test_the_circle_of_a_drawn_pin_is_its_patch(iccm, tmp_path):
    def circles(radius):
        pin = '<circle id="pin-nose" cx="{}" cy="{}" r="{}" fill="none"/>'
        egg = draw(tmp_path, f"egg{radius}", EGG, pin.format(50, 60, radius))
        return egg, draw(tmp_path, f"pear{radius}", PEAR, pin.format(62, 80, 1))

    drawn, _ = errors(iccm, tmp_path, *circles(14))
    mark, _ = errors(iccm, tmp_path, *circles(1))
    listed = tmp_path / "pins.json"
    listed.write_text(json.dumps({"pins": [{"source": [50, 60], "target": [62, 80], "radius": 14}]}))
    plain = draw(tmp_path, "egg", EGG), draw(tmp_path, "pear", PEAR)
    typed, _ = errors(iccm, tmp_path, *plain, "--constraints", listed)
    assert drawn == pytest.approx(typed, rel=1e-6)
    assert mark[0] != pytest.approx(typed[0], rel=1e-3)


@pytest.mark.parametrize("word", ["size=4", "radius=-1", "radius=x", "scale=0"])
def test_wrong_settings_are_named(iccm, tmp_path, pair, word):
    result = iccm("map", *pair, "--pin", f"40,45:50,48,{word}", "-o", tmp_path / "out.png")
    assert result.code == 2 and word.split("=")[0] in result.err and "--pin" in result.err
    assert not (tmp_path / "out.png").exists()


def test_settings_are_refused_by_methods_without_them(iccm, tmp_path, pair):
    result = iccm(
        "map", *pair, "--pin", "40,45:50,48,r=4", "--method", "conformal", "-o", tmp_path / "out.png"
    )
    assert result.code == 2 and "pin" in result.err and "balanced" in result.err


@pytest.mark.parametrize("method", ["balanced", "conformal"])
def test_ends_of_strokes_that_stick_go_with_every_method(iccm, tmp_path, pair, method):
    stroke = {"source": [[40, 45], [60, 50]], "target": [[50, 50], [72, 55]], "ends": "stick"}
    listed = tmp_path / "strokes.json"
    listed.write_text(json.dumps({"strokes": [stroke]}))
    missed, _ = errors(iccm, tmp_path, *pair, "--constraints", listed, "--method", method)
    assert len(missed) == 2 and max(missed) < (1e-9 if method == "balanced" else 0.2)


def sail(folder, name, size):
    """Write a bent sheet of 9 × 7 vertices, of a given size in space."""
    lines = []
    for row in range(7):
        for column in range(9):
            x, y = column / 8, row / 7
            lines.append(f"v {size * 1.4 * x} {size * y} {size * 0.5 * x * x * (1 - y)}")
    for row in range(6):
        for column in range(8):
            first = 9 * row + column + 1
            lines.append(f"f {first} {first + 1} {first + 10} {first + 9}")
    file = folder / f"{name}.obj"
    file.write_text("\n".join(lines) + "\n")
    return str(file)


@pytest.mark.slow
def test_lengths_of_pins_on_meshes_are_in_their_units(iccm, tmp_path, pair):
    results = []
    for size in (1.0, 40.0):
        mesh, pear = sail(tmp_path, f"sail{size:g}", size), pair[1]
        onto = f"60,45:{0.5 * size},{0.6 * size},0,r=12,tolerance={0.02 * size}"
        from_mesh = f"v24:50,48,r={0.2 * size},tolerance=2"
        results.append(
            errors(iccm, tmp_path, mesh, pear, "--pin", from_mesh)[0]
            + errors(iccm, tmp_path, pear, mesh, "--pin", onto)[0]
        )
    assert results[0] == pytest.approx(results[1], rel=1e-3) and min(results[0]) > 1e-5
    mesh = sail(tmp_path, "sail", 1.0)
    exact, notes = errors(iccm, tmp_path, pair[1], mesh, "--pin", "60,45:v24", "--exact-pins")
    assert max(exact) < 1e-9 and "exact_pins" not in notes

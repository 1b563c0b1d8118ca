"""The tables of fits and capabilities agree with the solver and with menus."""

import re
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
import shapely

import iccm
from iccm import capabilities, fits
from iccm.drawings.drawing import Drawing
from iccm.frames.solve import DrawingPair, fit_drawings
from iccm.io.edit.messages import Scene
from iccm.io.options import options_of
from iccm.options import Options
from tests.scripts import script

ROOT = Path(__file__).parents[2]
OF_OUTLINES = {name for name, mode in fits.FITS.items() if not mode.of_drawings}
SQUARE = np.array([0, 1, 1 + 1j, 1j])


def test_the_command_line_offers_and_explains_every_fit():
    hint, option = options_of()["fit"]
    names = next(get_args(part) for part in get_args(hint) if get_args(part))
    assert set(names) == set(fits.FITS)
    assert all(f"{name}: {mode.help}" in option.help for name, mode in fits.FITS.items())


def test_menus_escape_and_capitalise_the_words_of_the_table():
    lists = script("docs/lists.py")
    table = {"stretch": fits.FitMode("Stretch", "to the <box>", "the boxes are mapped")}
    assert '"stretch">Stretch: to the &lt;box&gt;<' in lists.menu_of_inkscape(table)
    assert '("stretch", "Stretch", "To the <box>")' in lists.menu_of_blender(table)


def test_the_page_and_the_add_on_offer_the_fits_that_apply():
    assert set(get_args(get_type_hints(Scene)["fit"])) == set(fits.FITS)
    addon = (ROOT / "plugins/blender/__init__.py").read_text()
    menu = re.search(r"^FITS = \[.*?^\]", addon, re.DOTALL | re.MULTILINE)[0]
    assert set(re.findall(r'^    \("(\w+)"', menu, re.MULTILINE)) == OF_OUTLINES


def test_inkscape_offers_every_way_to_map_parts():
    names = get_args(options_of()["parts"][0])
    dialog = (ROOT / "plugins/inkscape/iccm_fit.inx").read_text()
    menu = re.search(r'<param name="parts".*?</param>', dialog, re.DOTALL)[0]
    assert set(re.findall(r'<option value="(\w+)">', menu)) == set(names)


@pytest.mark.parametrize("name", fits.FITS)
def test_a_fit_is_explained_on_its_page(name):
    assert f"`{name}`" in (ROOT / "docs/choose.md").read_text()


def test_every_replacement_of_a_fit_is_a_fit():
    for name in fits.FITS:
        assert fits.FITS[fits.of_outlines(name)].of_drawings is False


def test_properties_of_fits():
    assert fits.leaves_out_parts("contain") and fits.leaves_out_parts("cover")
    assert not any(map(fits.leaves_out_parts, ("whole", "frame", "auto", None)))
    assert fits.leaves_bare("contain") and not any(map(fits.leaves_bare, ("cover", "auto", None)))
    assert fits.FITS["auto"].is_searched and fits.FITS["frame"].is_searched
    assert not fits.FITS["whole"].is_searched and not fits.FITS["cover"].is_searched


@pytest.mark.parametrize("name", capabilities.CAPABILITIES)
def test_a_constraint_is_refused_where_its_row_does_not_list_it(name):
    row = capabilities.CAPABILITIES[name]
    for method in ("balanced", "conformal", "paper"):
        for kind in capabilities.EVERYWHERE:
            if method in row.methods and kind in row.kinds:
                capabilities.refuse({name}, method, kind, "whole")
            else:
                with pytest.raises(iccm.InputError, match=f"^{name}: "):
                    capabilities.refuse({name}, method, kind, "whole")
    for fit, mode in fits.FITS.items():
        if row.partial or not mode.leaves_out_parts:
            capabilities.refuse({name}, "balanced", row.kinds[0], fit)
        else:
            with pytest.raises(iccm.InputError, match=f"^{name}: .*fit"):
                capabilities.refuse({name}, "balanced", row.kinds[0], fit)


@pytest.mark.parametrize(
    ("given", "kind"),
    [
        ({"rigid", "rigid_target"}, "plane"),
        ({"rigid_target", "importance"}, "plane"),
        ({"rigid_target", "size_map"}, "plane"),
        ({"rigid", "strokes"}, "from surface"),
        ({"rigid_target", "strokes"}, "onto surface"),
    ],
)
def test_constraints_that_exclude_each_other_are_refused(given, kind):
    with pytest.raises(iccm.InputError, match=r"^rigid"):
        capabilities.refuse(given, "balanced", kind, "whole")
    for name in given:
        capabilities.refuse(given - {name}, "balanced", kind if "strokes" in given else "plane", "whole")


def test_the_solver_refuses_fits_that_are_not_in_the_table():
    region = 0.5 + 0.5j + 0.1 * (SQUARE - 0.5 - 0.5j)
    for constraint in ({"source_holes": [region]}, {"rigid": [region]}, {"importance": [[1.0, 2.0]]}):
        (name,) = constraint
        with pytest.raises(iccm.InputError, match=f"^{name}"):
            iccm.fit(SQUARE, 2 * SQUARE, method="conformal", **constraint)


@pytest.mark.parametrize("name", [name for name, mode in fits.FITS.items() if mode.leaves_out_parts])
def test_a_partial_fit_reaches_the_maps_of_drawings(name):
    drawings = [Drawing(shapely.box(0, 0, *size)) for size in ((3, 1), (2, 1.5))]
    fit_modes = []

    def solver(source, target, source_holes, target_holes, options, coarse=None, stretch=1.0):
        fit_modes.append(options.fit)
        raise iccm.InputError("not solved here")

    with pytest.raises(iccm.InputError):
        fit_drawings(DrawingPair(*drawings, Options(fit=name), solver))
    assert fit_modes == [name]

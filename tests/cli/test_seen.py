"""How much of whole drawings is seen: in reports, summaries, batches, checks and plots."""

import json

import pytest

from iccm.maps.summary import summary

pytestmark = pytest.mark.usefixtures("solve_once")

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 60">{}</svg>'
SPLIT = '<path d="M5 5h44.7v50h-44.7z" fill="#204080"/><path d="M50.3 5h44v50h-44z" fill="#fc0"/>'
PLATE = '<path d="M0 0L100 3V60H4z"/>'


@pytest.fixture
def split(shapes, iccm):
    """A drawing with a slit mapped onto one without; the files of its picture and its report."""
    (shapes / "split.svg").write_text(SVG.format(SPLIT))
    (shapes / "plate.svg").write_text(SVG.format(PLATE))
    (shapes / "run").mkdir()
    result = iccm(
        *(
            "map",
            "split.svg",
            "plate.svg",
            "--parts",
            "joined",
            "--fit",
            "frame",
            "--background",
            "transparent",
        ),
        *("-o", "run/o.png", "--report", "run/o.json", "--plot", "o.svg", "--size", "500"),
    )
    assert result.code == 0, result.err
    return result


@pytest.mark.slow
def test_a_slit_of_the_source_is_counted_and_not_noted_where_gaps_are_to_be_transparent(split, shapes):
    report = json.loads((shapes / "run" / "o.json").read_text())
    assert report["cracks"] == pytest.approx(0.6 / 89.3, abs=0.0025)
    assert report["covered"] == pytest.approx(1 - report["cracks"], abs=0.003)
    assert not any("cracks" in line.lower() for line in split.lines)
    assert "cracks" in "\n".join(summary(report))


@pytest.mark.slow
def test_check_compares_the_visible_shares(split, shapes, iccm):
    assert iccm("check", "run", "base", "--update").code == 0
    report = json.loads((shapes / "run" / "o.json").read_text())
    for name, by, code in (
        ("covered", 0.001, 0),
        ("cracks", 0.001, 0),
        ("covered", -0.1, 1),
        ("cracks", 0.01, 1),
    ):
        moved = report | {name: report[name] + by}
        (shapes / "run" / "o.json").write_text(json.dumps(moved))
        result = iccm("check", "run", "base")
        assert result.code == code and (code == 0 or f"{name}: " in result.err)


def test_several_parts_are_one_result(shapes, iccm):
    big, small = '<path d="M5 5h60v50h-60z"/>', '<path d="M75 20h20v10h-20z"/>'
    (shapes / "two.svg").write_text(SVG.format(big + small))
    (shapes / "holed.svg").write_text(SVG.format(big + small))
    result = iccm(
        *("map", "two.svg", "holed.svg", "--place", "inside", "--parts", "all", "--report", "r.json"),
        *("--texture", "checker", "-o", "o.png"),
    )
    assert result.code == 0, result.err
    report = json.loads((shapes / "r.json").read_text())
    assert len(report["parts"]) == 2
    assert report["shown"] == pytest.approx(1, abs=1e-3) and report["cracks"] == 0


@pytest.mark.slow
def test_batches_list_the_visible_shares(split, shapes, iccm):
    (shapes / "jobs.toml").write_text(
        '[[job]]\nsource = "split.svg"\ntarget = "plate.svg"\noutput = "b.png"\nsize = 200\nplace = "inside"\n'
    )
    result = iccm("batch", "jobs.toml", "--html", "b.html")
    assert result.code == 0, result.err
    assert "covered" in (shapes / "b.html").read_text()

"""Names of options: one for each thing, former ones with a notice, aliases that users try, and suggestions for
others.
"""

import json
from pathlib import Path

import pytest

from iccm.cli import COMMANDS, options, settings
from iccm.io.options import of_command, options_of, size
from iccm.io.pictures import image_files

pytestmark = pytest.mark.usefixtures("solve_once")

SMALL = ("--size", "24", "--method", "paper", "--vertices", "40")


def picture_of(path):
    return image_files.read(path).pixels.shape[:2]


@pytest.mark.slow
def test_former_names_work_with_one_line_of_notice(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", "--starts", "2", "--size", "24", "-o", "old.png")
    notices = [line for line in result.lines if "--effort" in line]
    assert (
        result.code == 0
        and len(notices) == 1
        and "--starts" in notices[0]
        and notices[0].startswith("note: ")
    )
    new = iccm("map", "square.svg", "blob.svg", "--effort=2", "--size", "24", "-o", "new.png")
    assert new.code == 0 and "--starts" not in new.err
    assert (shapes / "old.png").read_bytes() == (shapes / "new.png").read_bytes()


def test_every_command_accepts_its_former_option_names(iccm):
    for command in COMMANDS:
        rows = of_command(command)
        for name, (_, option) in rows.items():
            for old in option.old:
                assert old not in rows
                result = iccm(command, f"--{old}", "--no-such-option")
                todays = f"'--{name.replace('_', '-')}'"  # its value is another option
                words = ("--no-such-option", "argument", todays)
                assert any(word in result.err for word in words), (command, name, old)


def test_former_names_hold_in_manifests(shapes, iccm):
    job = {
        "source": "square.svg",
        "target": "blob.svg",
        "size": 16,
        "padding": 2,
        "output": "{source.stem}.png",
    }
    (shapes / "old.jsonl").write_text(json.dumps(job | {"fill": "nearest"}))
    (shapes / "both.jsonl").write_text(json.dumps(job | {"fill": "nearest", "padding_fill": "nearest"}))
    result = iccm("batch", "old.jsonl", "--dry-run")
    assert result.code == 0 and any("fill" in line and "padding_fill" in line for line in result.lines)
    assert iccm("batch", "both.jsonl", "--dry-run").code == 2


@pytest.mark.parametrize(
    ("arguments", "shape"),
    [
        (("--width", "30"), (15, 30)),
        (("--height=20",), (20, 40)),
        (("--size", "30x"), (15, 30)),
        (("--size", "12"), (6, 12)),
    ],
)
def test_one_side_of_a_picture_is_enough(shapes, iccm, arguments, shape):
    (shapes / "wide.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 100"><path d="M10 10H190L150 90H10Z"/></svg>'
    )
    result = iccm(
        "map", "square.svg", "wide.svg", "--method", "paper", "--vertices", "40", *arguments, "-o", "out.png"
    )
    assert result.code in (0, 1) and picture_of("out.png") == shape
    assert "note: --" not in result.err


@pytest.mark.parametrize("value", ["0x20", "x", "0", "20x0", "x0", "ax5"])
def test_unknown_sides_are_refused(value):
    with pytest.raises(ValueError, match=r"side|WxH"):
        size(value)


def test_aliases_are_accepted_and_not_listed(shapes, iccm):
    (shapes / "out.png").write_bytes(b"mine")
    result = iccm("map", "square.svg", "blob.svg", *SMALL, "--overwrite", "--out", "out.png")
    assert result.code == 0 and (shapes / "out.png").read_bytes() != b"mine"
    turned = iccm(
        "map", "square.svg", "blob.svg", "--size", "24", "--rotate", "90", "-o", "turned.png", "--report", "-"
    )
    assert round(json.loads(turned.out)["turn"]) == 90
    assert "--overwrite" not in iccm("map", "--help", "all").out


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("--resolution", "--size"),
        ("--angle", "--turn"),
        ("--landmarks", "--pin"),
        ("--sise", "--size"),
        ("--wrap", "--edge"),
    ],
)
def test_an_unknown_option_gets_a_suggestion(iccm, word, meant):
    result = iccm("map", "a.svg", "b.svg", word, "1")
    assert result.code == 2 and len(result.lines) == 1 and f"did you mean {meant}" in result.err
    assert "did you mean" not in iccm("map", "a.svg", "b.svg", "--xyzzy").err


def test_the_plane_option_suggests_the_uv_layout(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", *SMALL, "--plane", "flat")
    assert result.code == 0 and any("--plane" in line and "FILE#uv" in line for line in result.lines)
    assert "--plane" not in iccm("map", "--help", "mesh").out


def test_an_stmap_is_an_output_that_is_called_one(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", "--size", "24", "-o", "map.exr", "--stmap")
    assert result.code == 0 and json.loads(iccm("info", "map.exr", "--json").out)["kind"] == "STMap"
    several = iccm("map", "square.svg", "blob.svg", "-o", "a.exr", "-o", "b.exr", "--stmap")
    assert several.code == 2 and len(several.lines) == 1 and "--stmap" in several.err


def test_a_file_for_a_command_and_many_files_are_answered_with_the_command(shapes, iccm):
    result = iccm("square.svg", "blob.svg")
    assert result.code == 2 and "iccm map square.svg blob.svg" in result.err
    result = iccm("map", "square.svg", "disk.svg", "blob.svg", "-o", "out")
    assert result.code == 2 and len(result.lines) == 1 and "iccm batch" in result.err


def test_limits_come_from_options_then_the_environment_then_the_file(shapes, iccm, monkeypatch):
    arguments = ("map", "square.svg", "blob.svg", *SMALL, "-o", "out.png", "--force")
    monkeypatch.setenv("ICCM_CONFIG", str(shapes / "config.toml"))
    assert "ICCM_CONFIG" in iccm(*arguments).err
    (shapes / "config.toml").write_text("[limits]\nmax_pixels = 100\n")
    assert iccm(*arguments).code == 2 and "limit of 100 pixels" in iccm(*arguments).err
    monkeypatch.setenv("ICCM_MAX_PIXELS", "200")
    assert "limit of 200 pixels" in iccm(*arguments).err
    assert iccm(*arguments, "--max-pixels", "1000").code == 0
    monkeypatch.setenv("ICCM_MAX_PIXELS", "many")
    wrong = iccm(*arguments)
    assert wrong.code == 2 and len(wrong.lines) == 1 and "max-pixels" in wrong.err
    (shapes / "config.toml").write_text("[limits]\nsize = 3\n")
    wrong = iccm(*arguments)
    assert wrong.code == 2 and len(wrong.lines) == 1 and "config.toml: size" in wrong.err
    assert set(settings.LIMITS) <= set(options_of()) | {
        "threads",
        "workers",
        "timeout",
        "retries",
        "time_limit",
    }


def test_other_names_are_documented():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "commands.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        for name, (_, option) in of_command(command).items():
            for alias in (*dict(option.aliases), *option.old):
                assert f"`--{alias}" in page, (command, name, alias)


def test_zero_is_a_value_and_no_default():
    given = {"padding": 0, "quasi": 0.0, "parts": "", "texture": None, "pin": ()}
    assert options.values(given) == {"padding": 0, "quasi": 0.0, "parts": "", "pin": []}

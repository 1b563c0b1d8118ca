"""The command line: outputs, messages and errors."""

import json
import re
from pathlib import Path

import click
import numpy as np
import pytest

import iccm as core
from iccm import cli
from iccm.cli import logs
from iccm.io import formats
from iccm.io.pictures import image_files
from tests.cases import some_fast

pytestmark = pytest.mark.usefixtures("solve_once")

QUICK = ("--method", "paper", "--order", "0", "--vertices", "60")
PICTURE = (*QUICK, "--size", "48")


def names(folder):
    return {path.name for path in folder.iterdir()}


def test_map_without_options_writes_a_picture_and_a_summary(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", *PICTURE)
    assert result.code == 0 and result.out == ""
    image = image_files.read("square-blob.png")
    assert image.pixels.shape == (48, 48, 4) and image.alpha == 3
    assert image.pixels[24, 24, 3] == 255 and image.pixels[0, 0, 3] == 0
    assert len(np.unique(image.pixels[image.pixels[..., 3] == 255], axis=0)) > 20
    assert result.lines[-1].startswith("square-blob.png  48×48 · ")


def test_an_existing_picture_is_kept_without_force(shapes, iccm):
    (shapes / "square-blob.png").write_bytes(b"mine")
    result = iccm("map", "square.svg", "blob.svg", *PICTURE)
    errors = [line for line in result.lines if line.startswith("error: ")]
    assert result.code == 2 and errors == [
        "error: square-blob.png: the file exists; use --force to replace it"
    ]
    assert (shapes / "square-blob.png").read_bytes() == b"mine"
    assert iccm("map", "square.svg", "blob.svg", *PICTURE, "--force").code == 0
    assert (shapes / "square-blob.png").read_bytes()[:4] == b"\x89PNG"


def test_report_on_stdout_is_the_whole_of_stdout(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", *QUICK, "--report", "-")
    report = json.loads(result.out)
    assert report["schema"] == "iccm.report/1" and report["version"] == core.__version__
    assert report["status"] == "decrease" and report["boundary"]["hausdorff"] < 0.01
    assert {"median", "p95", "max"} <= report["dilatation"].keys()
    assert {"p05", "median", "p95"} <= report["log10_area"].keys()
    assert {"certified", "depth", "zeros"} <= report["injective"].keys()
    assert {"solve", "evaluate", "resample", "total"} <= report["seconds"].keys()
    assert [item["path"] for item in report["inputs"]] == ["square.svg", "blob.svg"]
    assert all(re.fullmatch("[0-9a-f]{64}", item["sha256"]) for item in report["inputs"])
    assert names(shapes) == {"square.svg", "blob.svg", "disk.svg"}


@pytest.mark.slow
def test_all_outputs_of_one_run(shapes, iccm):
    outputs = ("-o", "a.png", "-o", "b.tif", "--report", "r.json", "--plot", "p.png", "--size", "40x30")
    result = iccm("map", "square.svg", "disk.svg#rim", *QUICK, *outputs)
    assert result.code == 0, result.err
    assert names(shapes) == {"square.svg", "blob.svg", "disk.svg", "a.png", "b.tif", "r.json", "p.png"}
    assert image_files.read("a.png").pixels.shape == (30, 40, 4)
    assert np.array_equal(image_files.read("a.png").pixels, image_files.read("b.tif").pixels)
    assert image_files.read("p.png").pixels.shape[:2] == (940, 1500)
    assert json.loads((shapes / "r.json").read_text())["job"]["size"] == [40, 30]


@pytest.mark.slow
def test_picture_on_stdout(shapes, shell):
    line = "iccm map square.svg blob.svg --size 32 -q -o - > out.png && iccm info out.png"
    result = shell(line)
    assert result.returncode == 0 and result.stderr == "" and "size: 32 32" in result.stdout


def test_identity_returns_the_texture_unchanged(shapes, iccm):
    """Neither mirrored nor shifted by half a pixel: an asymmetric picture over the whole canvas, one texel per
    pixel.
    """
    rng = np.random.default_rng(7)
    pixels = rng.integers(0, 256, (50, 50, 3), dtype=np.uint8)
    image_files.write(shapes / "t.png", image_files.Image(pixels))
    result = iccm(
        "map", "square.svg", "square.svg", "--texture", "t.png", *QUICK, "--size", "50", "-o", "o.png"
    )
    assert result.code == 0, result.err
    out = image_files.read("o.png").pixels
    inner = np.s_[7:43, 7:43]
    assert np.array_equal(out[inner][..., :3], pixels[inner])
    assert (out[:4, :, 3] == 0).all() and (out[inner][..., 3] == 255).all()


def test_pins_in_file_units_land_where_they_should(shapes, iccm):
    """A red dot at (30, 40) in the source's file must appear at (60, 35) of the target's, and nothing else."""
    y, x = np.mgrid[0:100, 0:100] + 0.5
    dot = np.hypot(x - 30, y - 40) < 4
    image_files.write(
        shapes / "dot.png", image_files.Image(np.where(dot[..., None], [255, 0, 0], 255).astype(np.uint8))
    )
    options = (
        *QUICK,
        "--texture",
        "dot.png",
        "--size",
        "100",
        "-o",
        "o.png",
        "--quasi",
        "0.01",
        "--pin-weight",
        "10",
    )
    result = iccm("map", "disk.svg", "disk.svg", *options, "--pin", "30,40:60,35", "--pin", "50,80:50,80")
    assert result.code in (0, 1), result.err
    out = image_files.read("o.png").pixels.astype(float)
    red = (out[..., 0] - out[..., 1]) * out[..., 3] / 255
    place = np.average(x, weights=red), np.average(y, weights=red)
    assert np.hypot(place[0] - 60, place[1] - 35) < 2


def test_constraints_from_a_file(shapes, iccm):
    pins = [{"source": [30, 40], "target": [35, 42]}, {"source": [60, 60], "target": [60, 60]}]
    (shapes / "c.json").write_text(json.dumps({"pins": pins}))
    result = iccm(
        "map", "disk.svg", "disk.svg", *QUICK, "--constraints", "c.json", "--quasi", "0.01", "--report", "-"
    )
    assert len(json.loads(result.out)["pins"]) == 2
    (shapes / "c.json").write_text('{"pens": []}')
    result = iccm("map", "disk.svg", "disk.svg", "--constraints", "c.json")
    assert result.code == 2 and "c.json: pens: unknown key" in result.err


@pytest.mark.slow
def test_constraints_from_stdin(shapes, shell):
    line = """echo '{"pins": [{"source": [50, 50], "target": [52, 50]}]}' | """
    options = "--method paper --quasi 0.01 --report - -q | tail -n 1"
    result = shell(line + "iccm map disk.svg disk.svg --constraints - " + options)
    assert result.returncode == 0 and result.stdout == "}\n", result.stderr


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_threads_or_cores(shapes, shell):
    lines = (
        "iccm map square.svg blob.svg --size 64 -q -o a.png; OMP_NUM_THREADS=1 iccm map square.svg blob.svg"
    )
    result = shell(f"export SOURCE_DATE_EPOCH=1; {lines} --size 64 -q -o b.png --threads 1")
    assert result.returncode == 0, result.stderr
    assert (shapes / "a.png").read_bytes() == (shapes / "b.png").read_bytes()


def test_a_picture_without_padding_is_written_in_bands_with_the_same_pixels(shapes, iccm):
    rng = np.random.default_rng(3)
    image_files.write(
        shapes / "t.png", image_files.Image(rng.integers(0, 256, (40, 40, 4), dtype=np.uint8), alpha=3)
    )
    arguments = ("map", "square.svg", "blob.svg", *QUICK, "--texture", "t.png", "--size", "130x150")
    assert iccm(*arguments, "-o", "rows.png").code == 0
    assert iccm(*arguments, "-o", "whole.png", "--padding", "1").code == 0
    rows, whole = image_files.read("rows.png").pixels, image_files.read("whole.png").pixels
    assert rows.shape == (150, 130, 4)
    assert np.array_equal(rows[rows[..., 3] > 0], whole[rows[..., 3] > 0])
    assert np.array_equal(rows[..., 3], whole[..., 3])


@pytest.mark.parametrize("suffix", [".jpg", ".exr", ".webp"])
def test_padding_that_a_format_would_lose_is_refused(shapes, iccm, suffix):
    ran = iccm("map", "square.svg", "blob.svg", *PICTURE, "-o", f"a{suffix}", "--padding", "2")
    assert ran.code == 2 and "--padding has no effect" in ran.err and len(ran.err.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("suffix", some_fast([".png", ".exr"], 1))
def test_a_bound_on_memory_does_not_change_a_picture(shapes, iccm, monkeypatch, suffix):
    from iccm.io import memory as room

    kind = np.float16 if suffix == ".exr" else np.uint8
    pixels = (np.random.default_rng(3).random((300, 200, 4)) * 255).astype(kind)
    image_files.write(shapes / f"t{suffix}", image_files.Image(pixels, 3, suffix == ".exr", "sRGB"))
    arguments = ("map", "square.svg", "blob.svg", *QUICK, "--texture", f"t{suffix}", "--size", "130x150")
    assert iccm(*arguments, "-o", f"free{suffix}", "--stmap", "free-map.exr").code == 0
    monkeypatch.setattr(room, "CACHE_MEMORY_SHARE", 0)  # nothing is kept in memory
    assert iccm(*arguments, "-o", f"bound{suffix}", "--stmap", "map.exr", "--memory", "4G").code == 0
    assert Path(f"bound{suffix}").read_bytes() == Path(f"free{suffix}").read_bytes()
    assert Path("map.exr").read_bytes() == Path("free-map.exr").read_bytes()
    for name, bound in (("a", ()), ("b", ("--memory", "4G"))):
        assert iccm("apply", "map.exr", f"t{suffix}", "-o", f"{name}{suffix}", *bound).code == 0
    assert Path(f"a{suffix}").read_bytes() == Path(f"b{suffix}").read_bytes()
    assert not [path for path in Path().iterdir() if path.name.startswith((".", "tmp"))]


@pytest.mark.parametrize(
    ("memory", "message"),
    [
        ("10M", "10M is too little for"),
        ("two", "'two' is not"),
        ("-1G", "not an amount of memory"),
        ("0", "memory"),
    ],
)
def test_a_bound_on_memory_that_cannot_be_kept_is_refused(shapes, iccm, memory, message):
    ran = iccm("map", "square.svg", "blob.svg", *QUICK, "-o", "a.png", "--memory", memory)
    assert ran.code == 2 and message in ran.err and len(ran.err.splitlines()) == 1
    assert not Path("a.png").exists()


def test_artwork_is_carried_as_paths(shapes, iccm):
    drawing = '<path d="M10 10H90V90H10Z"/><circle cx="40" cy="45" r="6" fill="red"/>'
    (shapes / "art.svg").write_text(
        (shapes / "square.svg").read_text().replace('<path d="M10 10H90V90H10Z"/>', drawing)
    )
    result = iccm("map", "art.svg", "blob.svg", *QUICK, "-o", "o.svg")
    assert result.code == 0, result.err
    assert "red" in (shapes / "o.svg").read_text() and "<path" in (shapes / "o.svg").read_text()
    image_files.write(shapes / "p.png", image_files.Image(np.zeros((9, 9, 3), np.uint8)))
    result = iccm("map", "p.png", "blob.svg", *QUICK, "-o", "o2.svg")
    assert result.code == 2 and all(word in result.err for word in ("o2.svg: ", "artwork", "SVG", "source"))


def test_deform_moves_pins_and_keeps_the_rest_near(shapes, iccm):
    pins = ("--exact-pins", "--pin", "30,50:30,50", "--pin", "70,50:70,45", "--pin", "50,70:50,70")
    result = iccm("deform", "disk.svg", *pins, "--report", "r.json", "-o", "d.png", "--size", "40")
    assert result.code == 0 and " · no folds · " in result.err
    report = json.loads((shapes / "r.json").read_text())
    assert report["status"] == "met" and report["boundary"] is None
    assert max(pin["error"] for pin in report["pins"]) < 1e-9
    assert image_files.read("d.png").pixels[..., 3].any()


def test_overlaps_are_reported_and_refused_by_require_injective(shapes, iccm):
    """The square's ends are rolled into each other: status `overlap`, and exit code 1 only with --require-injective."""
    (shapes / "bar.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 40"><path d="M5 15H85V25H5Z"/></svg>'
    )
    pins = (
        "--exact-pins",
        "--pin",
        "7,20:55,20",
        "--pin",
        "45,20:45,35",
        "--pin",
        "83,20:35,20",
        "--pin",
        "65,20:60,30",
    )
    result = iccm("deform", "bar.svg", *pins, "--report", "r.json")
    report = json.loads((shapes / "r.json").read_text())
    assert result.code == 0 and report["status"] == "overlap" and "overlaps itself" in result.err
    assert not report["injective"]["certified"] and max(pin["error"] for pin in report["pins"]) < 1e-9
    assert iccm("deform", "bar.svg", *pins, "--report", "s.json", "--require-injective").code == 1


@pytest.mark.parametrize(
    ("listed", "message"),
    [
        (
            {"pins": [("nose", [30, 50], [50, 50]), ("", [30, 50], [40, 50])]},
            "pins 1 and 2: .* (pin 1: nose)",
        ),
        (
            {
                "strokes": [
                    ("arm", [[30, 30], [60, 60]], [[40, 40], [60, 60]]),
                    ("leg", [[60, 30], [30, 60]], [[45, 40], [65, 60]]),
                ]
            },
            "strokes 1 and 2: .* source.* gap .*(stroke 1: arm, stroke 2: leg)",
        ),
    ],
)
def test_constraints_that_no_map_meets_are_named(shapes, iccm, listed, message):
    entries = {
        kind: [{"name": name, "source": a, "target": b} for name, a, b in triples]
        for kind, triples in listed.items()
    }
    (shapes / "c.json").write_text(json.dumps(entries))
    result = iccm("map", "square.svg", "disk.svg", "--constraints", "c.json", "-o", "o.png")
    assert result.code == 2 and len(result.lines) == 1
    assert re.search(message.replace("(", r"\(").replace(")", r"\)"), result.err)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("map", "none.svg", "blob.svg"), ["none.svg", "no such file"]),
        (("map", "square.svg", "blob.svg#leaf"), ["blob.svg#leaf", "leaf"]),
        (("map", "square.svg", "disk.svg#leaf"), ["disk.svg#leaf", "rim"]),
        (("map", "empty.svg", "blob.svg"), ["empty.svg"]),
        (("map", "nothing.svg", "blob.svg"), ["nothing.svg"]),
        (("map", "notes.txt", "blob.svg"), ["notes.txt: cannot read a shape from '.txt'"]),
        (("map", "notes", "blob.svg"), ["notes: cannot read a shape from a file without suffix"]),
        (("map", "", "blob.svg"), ["SOURCE: "]),
        (("map", "square.svg", "blob.svg", "--texture", "none.png"), ["none.png", "no such file"]),
        (("map", "square.svg", "blob.svg", "--texture", "notes.png"), ["notes.png"]),
        (("map", "square.svg", "blob.svg", "-o", "no/where.png"), ["no/where.png", "does not exist"]),
        (("map", "square.svg", "blob.svg", "-o", "x.gif7"), ["x.gif7", "suffix"]),
        (("map", "square.svg", "blob.svg", "--pin", "1,2,3"), ["--pin", "SX,SY:TX,TY"]),
        (("map", "square.svg", "blob.svg", "--pin", "1,2:30,40"), ["square.svg: pin 1", "outside", "(1, 2)"]),
        (
            ("map", "square.svg", "blob.svg", "--pin", "4e3,50:30,40"),
            ["square.svg: pin 1", "is 3910 outside"],
        ),
        (("map", "square.svg", "blob.svg", "--size", "99999x99999"), ["--size", "--max-pixels"]),
        (("map", "square.svg"), ["Missing argument", "iccm map --help"]),
        (("map", "square.svg", "blob.svg", "--bogus"), ["--bogus", "iccm map --help"]),
        (("bogus",), ["bogus", "iccm --help"]),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(shapes, iccm, arguments, parts):
    (shapes / "empty.svg").write_text("")
    (shapes / "nothing.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    for name in ("notes.txt", "notes.png"):
        (shapes / name).write_text("hello")
    before = names(shapes)
    method = () if arguments == ("bogus",) else QUICK
    result = iccm(*arguments, *method)
    assert result.code == 2 and result.out == ""
    errors = [line for line in result.lines if not line.startswith("note: ")]
    assert len(errors) == 1 and errors[0].startswith("error: ") and "Traceback" not in result.err
    assert all(part in errors[0] for part in parts), errors
    assert names(shapes) == before


def test_not_converged_is_exit_code_1_with_the_picture(shapes, iccm):
    result = iccm("map", "square.svg", "blob.svg", *PICTURE, "--max-iterations", "1", "-o", "o.png")
    assert (
        result.code == 1
        and result.lines[-1].startswith("error: The iteration limit")
        and "o.png" in names(shapes)
    )


@pytest.mark.slow
def test_require_injective_turns_a_failed_certificate_into_exit_code_1(shapes, iccm):
    """A three-lobed target cannot be covered one-to-one by a source that is mirrored by its pins."""
    pins = ("--pin", "30,50:70,50", "--pin", "70,50:30,50", "--pin", "50,30:50,30", "--pin", "50,70:50,70")
    options = (*QUICK, *pins, "--pin-weight", "1000", "--report", "-")
    free = iccm("map", "disk.svg", "disk.svg", *options)
    assert json.loads(free.out)["injective"]["certified"] is False
    result = iccm("map", "disk.svg", "disk.svg", *options, "--require-injective")
    assert result.code == 1 and ("certified one-to-one" in result.lines[-1] or free.code == 1)


def test_require_injective_takes_a_share_of_the_area(shapes, iccm):
    result = iccm("map", "square.svg", "square.svg", *QUICK, "--require-injective", "--report", "-")
    assert result.code == 0 and json.loads(result.out)["injective"]["share"] > 0.99
    assert json.loads(result.out)["job"]["require_injective"] == 0.99
    more = iccm("map", "square.svg", "square.svg", *QUICK, "--require-injective", "1", "--report", "-")
    assert more.code == 1 and more.lines[-1].endswith("less than 1 (--require-injective)")
    assert iccm("map", "square.svg", "square.svg", *QUICK, "--require-injective", "1.5").code == 2


def test_constraints_that_spoil_the_picture_get_a_note(shapes, iccm):
    pins = ("--pin", "30,50:70,50", "--pin", "70,50:30,50", "--pin", "50,30:50,30", "--pin", "50,70:50,70")
    result = iccm("map", "disk.svg", "disk.svg", *QUICK, *pins, "--pin-weight", "1000", "--report", "-")
    notes = json.loads(result.out)["notes"]
    shown = [line for line in result.lines if line.startswith("note")]
    assert [f"note: {logs.with_options(note)}" for note in notes] == shown
    assert any("picture overlaps itself" in note and "--quasi" in note for note in notes)
    assert any("far from the target's outline (boundary)" in note for note in notes)
    gentle = iccm("map", "disk.svg", "disk.svg", *QUICK, "--pin", "30,50:31,50", "--report", "-")
    assert json.loads(gentle.out)["notes"] == []


def test_quiet_verbose_and_json_messages(shapes, iccm):
    arguments = ("map", "square.svg", "blob.svg", "--report", "r.json", "--force")
    assert iccm(*arguments, "-q").err == ""
    lines = [json.loads(line) for line in iccm(*arguments, "--log-format", "json").lines]
    assert {"level", "message"} <= lines[0].keys() and lines[-1]["level"] == "info"
    result = iccm("map", "none.svg", "blob.svg", "--log-format", "json")
    assert json.loads(result.err)["level"] == "error"
    assert iccm("map", "none.svg", "blob.svg", "-q").lines == ["error: none.svg: no such file"]


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (logs.Terminated(15), 143, "stopped by signal 15"),
        (MemoryError(), 70, "out of memory"),
        (ZeroDivisionError("of pigs"), 70, "internal error, please report it (ZeroDivisionError: of pigs)"),
        (OSError(28, "No space left on device", "x\n.png"), 2, r"x\n.png: No space left on device"),
        (core.InputError("a\nb.svg: is wrong"), 2, r"a\nb.svg: is wrong"),
        (click.UsageError("no"), 2, "no"),
    ],
)
def test_every_failure_is_one_line(capsys, monkeypatch, error, code, message):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr(cli.iccm, "main", fail)
    assert cli.run([]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"error: {message}")


def test_a_signal_inside_compiled_code_is_reported_as_a_signal(capsys, monkeypatch):
    def fail(*arguments, **options):
        raise SystemError("a result with an exception set") from logs.Terminated(15)

    monkeypatch.setattr(cli.iccm, "main", fail)
    assert cli.run([]) == 143
    assert capsys.readouterr().err == "error: stopped by signal 15\n"


def test_debug_shows_the_traceback(shapes, iccm):
    assert "Traceback" in iccm("map", "none.svg", "blob.svg", "--debug").err


@pytest.mark.slow
def test_a_reader_that_goes_away_is_not_an_error(shapes, shell):
    result = shell("set -o pipefail; iccm map square.svg blob.svg --report - -q | head -c 1")
    assert result.stderr == "" and result.returncode in (0, logs.EXIT_PIPE)


@pytest.mark.slow
def test_sigterm_leaves_no_temporary_file(shapes, shell):
    line = "iccm map square.svg blob.svg --method paper --size 9000 & sleep 2; kill -TERM $!; wait $!"
    result = shell(line)
    assert result.returncode in (0, 143)
    assert names(shapes) <= {"square.svg", "blob.svg", "disk.svg", "square-blob.png"}
    if result.returncode == 143:
        assert "stopped by signal 15" in result.stderr and "square-blob.png" not in names(shapes)


def test_version_and_help(iccm):
    assert iccm("--version").out == f"iccm, version {core.__version__}\n"
    help_text = iccm("--help").out
    assert all(name in help_text for name in cli.COMMANDS)
    alone = iccm()
    assert alone.code == 2 and alone.out == "" and alone.err == help_text


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_has_help(iccm, name):
    result = iccm(name, "--help", "all")
    assert result.code == 0 and "--log-format" in result.out and "Usage: iccm" in result.out


def test_completion_scripts_are_generated(shell):
    for name in ("bash", "zsh", "fish"):
        result = shell(f"_ICCM_COMPLETE={name}_source iccm")
        assert result.returncode == 0 and "iccm" in result.stdout


def test_info_lists_every_format(iccm):
    result = iccm("info", "--formats")
    rows = {line.split()[0]: line for line in result.out.splitlines() if line.startswith((".", "lh", "rh"))}
    assert result.code == 0 and rows.keys() == formats.every().keys()
    assert "pictures" in rows[".png"] and not rows[".png"].endswith("*") and rows[".gif"].endswith("*")
    assert "meshes" in rows[".stl"] and rows[".stl"].endswith("*") and not rows[".glb"].endswith("*")
    assert iccm("info").code == 2 and iccm("info", "--formats", "--json").code == 2


@pytest.mark.parametrize("line", ["map a.svg b.svg -o out20", "map a.xyz b.svg -o o.png"])
def test_messages_list_few_suffixes(shapes, iccm, line):
    for name in ("a.svg", "b.svg", "a.xyz"):
        (shapes / name).write_bytes((shapes / "disk.svg").read_bytes())
    result = iccm(*line.split())
    assert result.code == 2 and len(result.lines) == 1
    assert 1 < len(re.findall(r" \.[a-z0-9]+\b", result.err)) <= formats.MOST_LISTED_SUFFIXES


@pytest.mark.slow
def test_a_batch_asks_whether_a_name_without_suffix_is_a_folder(shapes, iccm):
    result = iccm("batch", "disk.svg", "blob.svg", "square.svg", "-o", "out20")
    assert result.code == 2 and "out20/" in result.err and not (shapes / "out20").exists()
    assert iccm("batch", "disk.svg", "square.svg", "--size", "16", "-o", "out20/").code == 0
    assert (shapes / "out20" / "disk.png").exists()


def test_info_and_doctor(shapes, iccm):
    result = iccm("info", "disk.svg", "--json")
    facts = json.loads(result.out)
    assert facts["kind"] == "shapes" and facts["ids"] == ["rim"] and facts["canvas"] == [0, 0, 100, 100]
    assert facts["outlines"][0]["area"] == pytest.approx(np.pi * 40**2, rel=1e-3)
    assert iccm("info", "none.svg").code == 2
    (shapes / "j.toml").write_text('[[job]]\nsource = "disk.svg"\ntarget = "blob.svg"')
    assert "jobs: 1" in iccm("info", "j.toml").out
    doctor = iccm("doctor")
    assert doctor.code == 0 and "a square onto itself is correct" in doctor.out


def test_info_describes_meshes_pictures_and_constraints(shapes, iccm):
    corners = (
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nvt .6 .5\nvt .6 .6\n"
    )
    (shapes / "m.obj").write_text(corners + "g one\nf 1/1 2/2 3/3\ng two\nf 1/5 3/6 4/7\n")
    facts = json.loads(iccm("info", "m.obj", "--json").out)
    assert (facts["kind"], facts["vertices"], facts["faces"], facts["uv_charts"]) == ("mesh", 4, 2, 2)
    assert facts["parts"] and [loop["vertices"] for loop in facts["loops"]] == [4] and facts["genus"] == 0
    (shapes / "c.json").write_text('{"pins": [{"source": [1, 2], "target": [3, 4]}]}')
    assert "pins: 1" in iccm("info", "c.json").out
    image_files.write(shapes / "p.png", image_files.Image(np.full((5, 7, 3), 9, np.uint8)))
    assert "size: 7 5" in iccm("info", "p.png").out


@pytest.mark.slow
def test_file_names_that_are_not_text_are_refused_in_one_line(shapes, shell):
    name = r"""name=$(printf 'caf\351'); cp square.svg "$name.svg"; """
    shell(
        name
        + 'iccm map square.svg blob.svg --method paper --vertices 40 --size 9 -o a.png; cp a.png "$name.png"'
    )
    pair = "iccm map square.svg blob.svg -q --force"
    for line in (
        'iccm map "$name.svg" blob.svg',
        """echo '{"source": "caf*.svg"}' | iccm batch - -j 1""",
        *(
            f'{pair} {option} "$name.{kind}"'
            for option, kind in (("-o", "png"), ("-o", "svg"), ("--report", "json"))
        ),
        f'{pair} --stmap "$name.exr"',
        f'{pair} --texture "$name.png"',
        'iccm info "$name.png"',
    ):
        result = shell(name + line)
        assert (
            result.returncode == 2 and len(result.stderr.splitlines()) == 1 and "not UTF-8" in result.stderr
        )
    assert shell(name + 'iccm info --json "$name.svg"').returncode == 0


def test_the_default_output_is_not_written_through_a_link(shapes, iccm):
    (shapes / "square-blob.png").symlink_to("elsewhere.png")
    for more in ((), ("--force",)):
        result = iccm("map", "square.svg", "blob.svg", *more, "--size", "16")
        assert result.code == 2 and "square-blob.png" in result.err and "-o" in result.err
    assert not (shapes / "elsewhere.png").exists()


def test_a_time_limit_ends_a_command_in_a_line(shapes, iccm):
    for command in (
        ("map", "square.svg", "blob.svg", "-o", "o.png"),
        ("deform", "square.svg", "--pin", "30,30:30,35", "--pin", "70,70:80,70", "-o", "o.png"),
        ("morph", "square.svg", "blob.svg", "-o", "o.gif", "--frames", "3"),
    ):
        result = iccm(*command, "--time-limit", "1e-9")
        assert result.code == 1 and "--time-limit" in result.err and len(result.lines) == 1, result.err
        assert not list(shapes.glob("o.*"))
    assert iccm("map", "square.svg", "blob.svg", "--time-limit", "0").code == 2

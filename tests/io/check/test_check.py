"""The comparison detects regressions: each test introduces one."""

import json
import shutil
from xml.etree import ElementTree

import numpy as np
import pytest

from iccm.io.check import compare
from iccm.io.check.regression import as_picture
from iccm.io.pictures import image_files

REPORT = {
    "version": "1",
    "status": "decrease",
    "energies": [{"total": 0.5}, {"total": 1e-5}],
    "boundary": {"rms": 1e-4, "hausdorff": 2e-3},
    "pins": [],
    "seconds": {"total": 1.25},
}


def scene(width=64, height=48):
    """A smooth picture with an edge and alpha."""
    y, x = np.mgrid[0:height, 0:width]
    rgb = np.stack([x * 255 / width, y * 255 / height, 128 + 100 * np.sin(x / 5)], axis=-1)
    alpha = np.where(np.hypot(x - width / 2, y - height / 2) < 20, 255, 0)
    return np.dstack([rgb, alpha]).astype(np.uint8)


def save(path, pixels):
    image_files.write(path, image_files.Image(pixels, alpha=3 if pixels.shape[2] == 4 else -1))


@pytest.fixture
def folders(tmp_path, monkeypatch, iccm):
    """A run, and baselines stored from it."""
    monkeypatch.chdir(tmp_path)
    run = tmp_path / "run"
    (run / "deep").mkdir(parents=True)
    save(run / "a.png", scene())
    save(run / "deep" / "b.png", scene(40, 40)[..., :3])
    (run / "r.json").write_text(json.dumps(REPORT))
    (run / "other.obj").write_text("v 0 0 0\n")
    (run / ".iccm-journal.jsonl").write_text("{}\n")
    assert iccm("check", "run", "base", "--update").code == 0
    return run, tmp_path / "base"


def report_with(change):
    changed = json.loads(json.dumps(REPORT))
    change(changed)
    return json.dumps(changed)


def test_the_same_passes(folders, iccm):
    run, base = folders
    assert iccm("check", run, base).code == 0
    assert not (base / ".iccm-journal.jsonl").exists()


def test_allowed_differences_pass(folders, iccm):
    run, base = folders
    faint = scene()
    faint[3, 3, 0] += 1
    save(run / "a.png", faint)
    (run / "r.json").write_text(report_with(lambda r: r.update(version="2", seconds={"total": 9})))
    assert iccm("check", run, base).code == 0


def shifted(pixels):
    return np.roll(pixels, 1, axis=1)


def hue(pixels):
    """Increase red by a hundredth of white, which is hardly visible."""
    out = pixels.astype(int)
    out[..., 0] = np.minimum(out[..., 0] + 3, 255)
    return out.astype(np.uint8)


def one_pixel(pixels):
    out = pixels.copy()
    out[20, 30, 2] ^= 0x80
    return out


@pytest.mark.parametrize(
    ("plant", "message"),
    [
        (shifted, "rms difference"),
        (hue, "max difference"),
        (one_pixel, "column 30, row 20"),
        (lambda p: p[:, :-1], "63x48"),
        (lambda p: p[..., :3], "3 channels"),
        (lambda p: p.astype(np.uint16) * 257, "uint16"),
        (lambda p: p[::-1], "structural similarity"),
        (lambda p: np.dstack([p[..., :3], 255 - p[..., 3]]), "max difference"),
    ],
)
def test_a_changed_picture_is_caught(folders, iccm, plant, message):
    run, base = folders
    save(run / "a.png", plant(scene()))
    result = iccm("check", run, base, "--diff", "diff", "--junit", "j.xml")
    assert result.code == 1 and message in result.err and "a.png" in result.err
    assert image_files.read("diff/a.png.diff.png").pixels.std() > 10
    suite = ElementTree.parse("j.xml").getroot()[0]
    assert suite.get("tests") == "4" and suite.get("failures") == "1"
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["a.png"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda r: r["energies"][1].update(total=1.1e-5),
            "energies.1.total: 1.1e-05 instead of 1e-05",
        ),
        (lambda r: r["energies"].append({"total": 1e-6}), "energies.2.total: not in the baseline"),
        (lambda r: r.update(status="limit"), 'status: "limit"'),
        (lambda r: r["boundary"].pop("rms"), "boundary.rms: missing"),
        (lambda r: r["boundary"].update(rms=None), "boundary.rms: null"),
        (lambda r: r.update(pins=[{"error": 1}]), "pins.0.error"),
        (lambda r: r["boundary"].update(hausdorff=True), "boundary.hausdorff: true"),
    ],
)
def test_a_changed_report_is_caught(folders, iccm, change, message):
    run, base = folders
    (run / "r.json").write_text(report_with(change))
    result = iccm("check", run, base)
    assert result.code == 1 and message in result.err


@pytest.mark.parametrize(
    ("run_report", "baseline_report", "message"),
    [
        (REPORT, {}, "its baseline is empty"),
        (REPORT, [], "its baseline is empty"),
        (REPORT, [1, 2], "content: an object instead of a list"),
        (REPORT, 3, "content: an object instead of 3"),
        ({}, REPORT, "status: missing"),
        ({**REPORT, "boundary": {}}, REPORT, "boundary.rms: missing"),
        ({**REPORT, "boundary": 3}, REPORT, "boundary: 3 instead of an object"),
        ({**REPORT, "pins": [{"error": []}]}, REPORT, "pins.0.error: not in the baseline"),
    ],
)
def test_reports_of_another_form_are_failures_that_name_the_figure(
    folders, iccm, run_report, baseline_report, message
):
    run, base = folders
    (run / "r.json").write_text(json.dumps(run_report))
    (base / "r.json").write_text(json.dumps(baseline_report))
    result = iccm("check", run, base)
    assert result.code == 1 and f"r.json: {message}" in result.err
    assert ": : " not in result.err and result.err.count("not in the baseline") <= 1


@pytest.mark.parametrize(
    "change",
    [
        lambda r: r.update(depth=3),
        lambda r: r.update(depth={"least": 1, "most": [1, 2]}),
        lambda r: r["boundary"].update({"mean.of": 3}),
        lambda r: r["energies"][1].update(bend=1e-9),
        lambda r: r.update(uv={"flipped": 0}),
    ],
)
def test_figures_that_the_baseline_lacks_are_a_note_and_those_that_are_gone_a_failure(folders, iccm, change):
    run, base = folders
    for name in (run, base):
        (name / "r.json").write_text(report_with(lambda r: r.update(uv={})))
    (run / "r.json").write_text(report_with(lambda r: (r.update(uv={}), change(r))))
    result = iccm("check", run, base, "--json")
    assert result.code == 0 and "r.json: not in the baseline" in result.err
    records = {record["name"]: record for record in map(json.loads, result.out.splitlines())}
    assert len(records["r.json"]["notes"]) == 1 and records["r.json"]["state"] == "same"
    (run / "r.json").rename(run / "newer.json")
    (base / "r.json").rename(run / "r.json")
    (run / "newer.json").rename(base / "r.json")
    assert iccm("check", run, base).code == 1


@pytest.mark.parametrize(
    ("versions", "change", "code", "noted"),
    [
        (("3", "2"), lambda r: r.update(notes=["a word", "b"]), 0, True),
        (("3", "2"), lambda r: r.update(notes=["the word"]), 0, False),
        (("2", "2"), lambda r: r.update(notes=["a word"]), 1, False),
        (("3", "2"), lambda r: r.update(notes=["a word"], boundary={"rms": 9}), 1, True),
    ],
)
def test_notes_of_another_version_may_have_other_words(folders, iccm, versions, change, code, noted):
    run, base = folders
    for folder, version in zip((run, base), versions):
        text = report_with(lambda r, version=version: r.update(version=version, notes=["the word"]))
        (folder / "r.json").write_text(text)
    changed = json.loads((run / "r.json").read_text())
    change(changed)
    (run / "r.json").write_text(json.dumps(changed))
    result = iccm("check", run, base)
    assert result.code == code and ("r.json: the notes differ" in result.err) == noted


def test_missing_additional_and_other_files_are_caught(folders, iccm):
    run, base = folders
    (run / "deep" / "b.png").unlink()
    (run / "new.png").write_bytes((run / "a.png").read_bytes())
    (run / "other.obj").write_text("v 0 0 1\n")
    result = iccm("check", run, base)
    assert result.code == 1
    for part in (
        "deep/b.png: missing in the run",
        "new.png: has no baseline",
        "other.obj: the contents differ",
    ):
        assert part in result.err


def test_a_torn_picture_or_report_is_a_failure_not_the_end(folders, iccm):
    run, base = folders
    (run / "a.png").write_bytes((run / "a.png").read_bytes()[:200])
    (run / "r.json").write_text("{")
    result = iccm("check", run, base, "--diff", "diff")
    assert result.code == 1 and "r.json" in result.err and "a.png" in result.err and "2 of 4" in result.err


def test_tolerances_are_per_key(folders, iccm):
    run, base = folders
    (run / "r.json").write_text(report_with(lambda r: r["boundary"].update(rms=1.5e-4, hausdorff=3e-3)))
    (base / "tolerances.toml").write_text('[report]\n"boundary.*" = {rel = 0.6}\n')
    assert iccm("check", run, base).code == 0
    (base / "tolerances.toml").write_text(
        '[report]\n"boundary.*" = {rel = 0.6}\n"boundary.rms" = {rel = 0.1}\n'
    )
    result = iccm("check", run, base)
    assert result.code == 1 and "boundary.rms" in result.err and "hausdorff" not in result.err
    save(run / "a.png", hue(scene()))
    (base / "tolerances.toml").write_text(
        '[pictures]\nmax = 0.02\nrms = 0.02\n[report]\n"*" = {ignore = true}\n'
    )
    assert iccm("check", run, base).code == 0
    (base / "tolerances.toml").write_text("[pictures]\nmaximum = 1\n")
    result = iccm("check", run, base)
    assert result.code == 2 and "pictures.maximum: unknown key" in result.err


def test_tolerances_that_are_named_hold_instead_of_those_of_the_baselines(folders, iccm):
    run, base = folders
    save(run / "a.png", hue(scene()))
    (base / "tolerances.toml").write_text("[pictures]\nmax = 0.001\nrms = 0.001\n")
    (run.parent / "loose.toml").write_text("[pictures]\nmax = 0.02\nrms = 0.02\n")
    assert iccm("check", run, base).code == 1
    assert iccm("check", run, base, "--tolerances", "loose.toml").code == 0


def test_update_rewrites_and_removes(folders, iccm):
    run, base = folders
    save(run / "a.png", shifted(scene()))
    (run / "other.obj").unlink()
    assert iccm("check", run, base).code == 1
    assert iccm("check", run, base, "--update").code == 0
    assert iccm("check", run, base).code == 0 and not (base / "other.obj").exists()


def test_links_out_of_the_folders_are_not_followed(folders, iccm, tmp_path):
    run, base = folders
    (tmp_path / "secret.obj").write_text("v 1 2 3\n")
    (run / "inside.png").symlink_to("a.png")
    assert iccm("check", run, base, "--update").code == 0
    assert (base / "inside.png").read_bytes() == (run / "a.png").read_bytes()
    (run / "leak.obj").symlink_to(tmp_path / "secret.obj")
    for more in ((), ("--update",)):
        result = iccm("check", run, base, *more)
        assert result.code == 2 and "leak.obj" in result.err and not (base / "leak.obj").exists()
    (run / "leak.obj").unlink()
    (base / "a.png").unlink()
    (base / "a.png").symlink_to(tmp_path / "secret.obj")
    result = iccm("check", run, base, "--update")
    assert result.code == 2 and "a.png" in result.err
    assert (tmp_path / "secret.obj").read_text() == "v 1 2 3\n"


def test_nothing_to_compare_is_an_error(tmp_path, iccm):
    (tmp_path / "run").mkdir()
    (tmp_path / "base").mkdir()
    assert iccm("check", tmp_path / "run", tmp_path / "base").code == 2
    assert iccm("check", tmp_path / "none", tmp_path / "base").code == 2
    assert iccm("check", tmp_path / "run", tmp_path / "base", "--update").code == 2


def test_float_pictures_with_infinities(folders, iccm):
    run, base = folders
    bright = np.full((8, 8, 3), 0.5, np.float32)
    bright[2, 2] = np.inf
    for folder in (run, base):
        save(folder / "f.exr", bright)
    assert iccm("check", run, base).code == 0
    bright[2, 2] = 0.5
    save(run / "f.exr", bright)
    result = iccm("check", run, base)
    assert result.code == 1 and "infinity" in result.err


def test_junit_follows_source_date_epoch(folders, iccm, monkeypatch):
    run, base = folders
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    reports = []
    for name in ("one.xml", "two.xml"):
        iccm("check", run, base, "--junit", name)
        reports.append((run.parent / name).read_bytes())
    assert reports[0] == reports[1] and b"1970-01-01T00:00:00" in reports[0]


@pytest.mark.slow
def test_the_whole_loop_on_real_results(shapes, iccm):
    """A worse solution, by fewer iterations, is a regression of picture and report."""
    options = ("--method", "paper", "--vertices", "60", "--size", "48", "--force")
    (shapes / "out").mkdir()
    outputs = ("-o", "out/o.png", "--report", "out/o.json")
    assert iccm("map", "square.svg", "blob.svg", *options, *outputs).code == 0
    assert iccm("check", "out", "base", "--update").code == 0
    assert iccm("map", "square.svg", "blob.svg", *options, *outputs).code == 0
    assert iccm("check", "out", "base").code == 0
    assert iccm("map", "square.svg", "blob.svg", *options, *outputs, "--max-iterations", "2").code == 1
    result = iccm("check", "out", "base")
    assert result.code == 1 and "o.png" in result.err and "o.json: status" in result.err
    shutil.rmtree("base")


def test_texture_coordinates_may_move_a_little_and_nothing_else_of_a_mesh(folders, iccm):
    import trimesh

    run, base = folders

    def written(name, *, by=0.0, up=0.0):
        uv = np.array([[0, 0], [1, 0], [0, 1]]) + by
        mesh = trimesh.Trimesh([[0, 0, up], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], process=False)
        mesh.visual = trimesh.visual.TextureVisuals(uv)
        if name.endswith(".glb"):
            mesh.export(run / name)
        else:
            rows = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + [f"vt {u} {v}" for u, v in uv]
            (run / name).write_text("\n".join([*rows, "f 1/1 2/2 3/3", ""]))

    for name in ("m.obj", "m.glb"):
        written(name)
        assert iccm("check", run, base, "--update").code == 0
        written(name, by=5e-5)
        assert (run / name).read_bytes() != (base / name).read_bytes()
        assert iccm("check", run, base).code == 0
        written(name, by=1e-3)
        assert f"{name}: uv difference 0.001 is more than 0.0001" in iccm("check", run, base).err
        written(name, up=1e-3)
        assert f"{name}: the contents differ, not only in texture coordinates" in iccm("check", run, base).err
        written(name)


@pytest.mark.parametrize("root", ["base", "/far off/run", "."])
def test_remarks_that_name_other_folders_are_the_same(folders, iccm, root):
    """Reports refer to outputs by path; only files that are not in the folder count as different."""
    run, base = folders

    def noted(name):
        return report_with(
            lambda r: r.update(notes=[f"{name}/deep/b.png: is empty"], also_written=[f"{name}/other.obj"])
        )

    (run / "r.json").write_text(noted("out/run"))
    (base / "r.json").write_text(noted(root))
    assert iccm("check", run, base).code == 0
    (base / "r.json").write_text(noted(root).replace("b.png", "c.png"))
    result = iccm("check", run, base)
    assert result.code == 1 and "r.json: notes.0" in result.err


def verdict(tmp_path, before, after):
    for name, pixels in (("run.exr", after), ("base.exr", before)):
        image_files.write(tmp_path / name, image_files.Image(pixels, colorspace="lin_rec709"))
    return compare.compare("a.exr", tmp_path / "run.exr", tmp_path / "base.exr", compare.Tolerances())


def test_figures_are_the_largest_and_the_root_of_the_mean_square(tmp_path):
    before = np.full((7, 20, 1), 0.25, np.float32)
    after = before.copy()
    after[5, 16], after[2, 3] = 0.75, 0.125
    verdict_found = verdict(tmp_path, before, after)
    assert verdict_found.figures["max"] == 0.5
    assert verdict_found.figures["rms"] == pytest.approx(np.sqrt((0.5**2 + 0.125**2) / 140))
    assert verdict_found.worst == (16, 5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_differences_are_relative_to_white_in_every_depth(tmp_path, dtype):
    top = np.iinfo(dtype).max
    before = np.full((7, 20, 1), top // 2, dtype)
    after = before.copy()
    after[5, 16] += top // 255
    for name, pixels in (("run.png", after), ("base.png", before)):
        save(tmp_path / name, pixels)
    verdict_found = compare.compare(
        "a.png", tmp_path / "run.png", tmp_path / "base.png", compare.Tolerances()
    )
    assert verdict_found.ok and verdict_found.figures["max"] == pytest.approx(1 / 255)


def test_pixels_that_are_not_finite_must_be_the_same_ones(tmp_path):
    before, after = (np.full((8, 9, 1), 0.5, np.float32) for _ in range(2))
    before[2, 3] = after[3, 2] = np.nan
    assert any("NaN" in problem for problem in verdict(tmp_path, before, after).problems)


def test_pictures_with_alpha_are_shown_over_grey():
    pixels = np.array([[[255, 0, 51, 102]]], np.uint8)  # alpha 0.4
    assert as_picture(pixels)[0, 0] == pytest.approx([0.7, 0.3, 0.38])
    assert as_picture(np.array([[[255, 102]]], np.uint8))[0, 0] == pytest.approx([0.7] * 3)


def test_figures_may_be_within_either_tolerance(folders, iccm):
    run, base = folders
    (run / "r.json").write_text(report_with(lambda r: r["boundary"].update(rms=1.5e-4, hausdorff=2.1e-3)))
    (base / "tolerances.toml").write_text('[report]\n"boundary.*" = {rel = 0.1, abs = 6e-5}\n')
    assert iccm("check", run, base).code == 0

"""Manifests: defaults, patterns, templates, and every mistake with its place."""

import glob as python_glob
import json
import os
from pathlib import Path

import pytest

from iccm import InputError
from iccm.io import limits
from iccm.io.batch import manifest
from iccm.io.batch.globs import Globs
from iccm.io.batch.manifest import ManifestError, read


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a.svg", "b.svg", "c.svg", "t.png"):
        (tmp_path / name).write_text("x")
    (tmp_path / "out").mkdir()
    return tmp_path


def jobs(text, name="jobs.toml", folder=None, **options):
    return read(text, name, root=folder / "out", **options)


def mistakes(text, name="jobs.toml", folder=None, **options):
    with pytest.raises(ManifestError) as caught:
        jobs(text, name, folder, **options)
    return caught.value.mistakes


def test_defaults_and_templates(folder):
    text = """
    [defaults]
    size = 64
    report = "{source.stem}/{target.stem}-{number}.json"
    [[job]]
    source = "a.svg"
    target = "b.svg#leaf"
    output = ["{source.stem}-{target.id}.png", "{source.name}.jpg"]
    [[job]]
    source = "b.svg"
    target = "c.svg"
    size = "8x9"
    name = "special {number}"
    """
    first, second = jobs(text, folder=folder)
    out = str(folder / "out")
    assert first.job.output == (f"{out}/a-leaf.png", f"{out}/a.svg.jpg")
    assert first.job.report == f"{out}/a/b-1.json" and first.job.size == (64,)
    assert second.job.size == (8, 9) and second.name == "special 2" and second.job.output == ()


def test_globs_multiply_in_a_fixed_order(folder):
    tasks = jobs('[[job]]\nsource = "[ab].svg"\ntarget = "*.svg"', folder=folder)
    assert [task.name for task in tasks] == ["a-a", "a-b", "a-c", "b-a", "b-b", "b-c"]
    assert [task.number for task in tasks] == [1, 2, 3, 4, 5, 6]
    assert all(task.job.output == (str(folder / "out" / f"{task.name}.png"),) for task in tasks)


def test_json_lines_with_defaults_and_stdin(folder):
    lines = [{"defaults": {"quasi": 0.5}}, {"source": "a.svg", "target": "b.svg"}]
    text = "\n".join(json.dumps(line) for line in lines) + "\n\n"
    for name in ("jobs.jsonl", "-"):
        (task,) = jobs(text, name, folder)
        assert task.job.quasi == 0.5 and task.place == f"{name}: line 2"
    (task,) = jobs('[[job]]\nsource = "a.svg"\ntarget = "b.svg"', "-", folder)
    assert task.place == "-: job 1"


def test_inputs_are_relative_to_the_manifest(folder):
    (folder / "deep").mkdir()
    (folder / "deep" / "d.svg").write_text("x")
    (folder / "deep" / "pins.json").write_text("{}")
    text = '[[job]]\nsource = "d.svg"\ntarget = "../a.svg"\nconstraints = "pins.json"'
    (task,) = jobs(text, "deep/jobs.toml", folder)
    assert task.job.inputs == ("deep/d.svg", "deep/../a.svg", "deep/pins.json")


@pytest.mark.parametrize(
    ("key", "output"),
    [("texture", "a-b.png"), ("normal", "a-b-t.png"), ("data", "a-b-t.png"), ("report", "a-b.png")],
)
def test_a_job_without_an_output_names_one_for_each_texture(folder, key, output):
    (task,) = jobs(f'[[job]]\nsource = "a.svg"\ntarget = "b.svg"\n{key} = "t.png"', folder=folder)
    expected = () if key == "report" else (str(folder / "out" / output),)
    assert task.job.output == expected


def test_every_mistake_is_listed_with_its_place(folder):
    text = """
    colour = 3
    [[job]]
    source = "a.svg"
    target = "none.svg"
    [[job]]
    source = "a.svg"
    target = "*.obj"
    [[job]]
    source = "a.svg"
    target = "b.svg"
    pin = ["1,2:3,4", "5"]
    quasy = 1
    size = "big"
    [[job]]
    source = "a.svg"
    target = "c.svg"
    output = "{sauce.stem}.png"
    [[job]]
    target = "c.svg"
    """
    errors = mistakes(text, folder=folder)
    for place, message in (
        ("jobs.toml: colour", "unknown key"),
        ("jobs.toml: job 1", "none.svg: no such file"),
        ("jobs.toml: job 2: target", "no file matches '*.obj'"),
        ("jobs.toml: job 3: pin.1", "SX,SY:TX,TY"),
        ("jobs.toml: job 3: quasy", "unknown key"),
        ("jobs.toml: job 3: size", "WxH"),
        ("jobs.toml: job 4: output", "{sauce.stem}; use one of"),
        ("jobs.toml: job 5: source", "is missing"),
    ):
        assert any(line.startswith(place) and message in line for line in errors), (place, errors)
    assert len(errors) == 8


def test_syntax_errors_have_line_and_column(folder):
    assert "line 2, column" in mistakes("[[job]]\nsource = = 3", folder=folder)[0]
    errors = mistakes('{"source": "a.svg", "target": "b.svg"}\n{"source": \n[1]\n', "jobs.jsonl", folder)
    assert errors[0].startswith("jobs.jsonl: line 2: column")
    assert errors[1].startswith("jobs.jsonl: line 3:") and "JSON object" in errors[1]


@pytest.mark.parametrize("text", ["", "[defaults]\nsize = 3\n"])
def test_no_jobs_is_a_mistake(folder, text):
    assert "no jobs" in mistakes(text, folder=folder)[0]


@pytest.mark.parametrize("text", ["defaults = 3", "job = 3", "job = [1, 2]", "[job]\nsource = 'a.svg'"])
def test_wrong_tables_are_mistakes(folder, text):
    assert "must be" in mistakes(text, folder=folder)[0]


def test_deep_nesting_is_a_mistake(folder):
    assert mistakes("a = " + "[" * 100_000, folder=folder)
    assert mistakes("[" * 100_000, "jobs.jsonl", folder)


@pytest.mark.parametrize(
    ("text", "name"), [("size = " + "9" * 5000, "jobs.toml"), ('{"size": ' + "9" * 5000 + "}", "j.jsonl")]
)
def test_a_number_without_end_is_a_mistake(folder, text, name):
    assert "digits" in mistakes(text, name, folder)[0]


def test_two_jobs_may_not_write_one_file(folder):
    errors = mistakes('[[job]]\nsource = "*.svg"\ntarget = "a.svg"\noutput = "o.png"', folder=folder)
    assert len(errors) == 1 and "writes the same file" in errors[0]  # one mistake for all files


def test_an_output_may_not_be_an_input_of_another_job(folder):
    text = '[[job]]\nsource = "a.svg"\ntarget = "b.svg"\ntexture = "t.png"\noutput = "../t.png"'
    assert "also an input" in mistakes(text, folder=folder, outside=True)[0]


@pytest.mark.parametrize("output", ["../o.png", "/tmp/o.png", "sub/../../o.png", "link/o.png", "file.png"])
def test_outputs_do_not_leave_the_root(folder, output):
    (folder / "elsewhere").mkdir()
    (folder / "out" / "link").symlink_to(folder / "elsewhere")
    (folder / "out" / "file.png").symlink_to(folder / "elsewhere" / "o.png")
    text = f'[[job]]\nsource = "a.svg"\ntarget = "b.svg"\noutput = "{output}"'
    (mistake,) = mistakes(text, folder=folder)
    assert f"job 1: output: {output}" in mistake and "--allow-outside" in mistake
    assert jobs(text, folder=folder, outside=True)


def test_a_template_cannot_smuggle_a_folder(folder):
    text = '[[job]]\nsource = "a.svg#../../x"\ntarget = "b.svg"\noutput = "{source.id}.png"'
    (task,) = jobs(text, folder=folder)
    assert task.job.output == (str(folder / "out" / ".._.._x.png"),)


def test_stdout_is_refused_as_a_report(folder):
    assert "`-`" in mistakes('[[job]]\nsource = "a.svg"\ntarget = "b.svg"\nreport = "-"', folder=folder)[0]


def listed(folder, *lines, name="jobs.jsonl", **options):
    """The mistakes of a manifest with these lines, each given as JSON or text."""
    text = "\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines)
    (folder / name).write_text(text, encoding="utf-8")
    try:
        manifest.read(manifest.load(str(folder / name)), str(folder / name), root=folder, **options)
    except InputError as error:
        return [line.removeprefix(f"{folder}/{name}: ") for line in error.mistakes]
    return []


def nested(depth):
    value = "a.png"
    for _ in range(depth):
        value = [value]
    return value


JOB = {"source": "square.svg", "target": "blob.svg"}
WILL_FAIL = {
    "a NUL": ({"output": "a\0.png"}, "NUL"),
    "a surrogate": ({"output": "a\ud800.png"}, "UTF-8"),
    "deep nesting": ({"output": nested(900)}, "nested more than 8 deep"),
    "deep constraints": ({"constraints": nested(900)}, "nested more than 8 deep"),
    "memory without end": ({"memory": "9" * 400}, "memory"),
    "a number without end": ({"memory": 10**400}, "at most"),
    "an unknown suffix": ({"output": "a.xyz"}, "a.xyz: unknown suffix"),
    "an unknown plot": ({"plot": "a.gif"}, "a.gif: unknown suffix for --plot"),
    "an STMap of bytes": ({"stmap": "a.png"}, "a.png: an STMap needs floats"),
    "a folder": ({"output": "folder.png"}, "is a folder"),
    "a long name": ({"output": "a" * 252 + ".png"}, "longer than 255 bytes"),
    "stdin": ({"source": "-"}, "cannot read from `-`"),
    "the journal": ({"report": ".iccm-journal.jsonl"}, "is the batch's journal"),
    "the manifest": ({"report": "jobs.jsonl"}, "is the manifest"),
    "an input of no shape": ({"target": "notes.txt"}, "cannot read a shape from '.txt'"),
    "a name of Windows": ({"output": "con.png"}, "the name 'con.png'"),
    "a colon": ({"output": "a:b.png"}, "Windows does not allow ':'"),
    "a dot at the end": ({"output": "a./b.png"}, "the name 'a.'"),
}


@pytest.mark.parametrize("mistake", WILL_FAIL)
def test_certain_failures_are_reported_before_anything_runs(shapes, mistake):
    (shapes / "folder.png").mkdir()
    (shapes / "notes.txt").touch()
    values, message = WILL_FAIL[mistake]
    errors = listed(shapes, {**JOB, **values})
    assert len(errors) == 1 and errors[0].startswith("line 1: ") and message in errors[0], errors


def test_an_output_may_not_be_a_folder_of_another(shapes):
    errors = listed(shapes, {**JOB, "output": "o.png/x.png"}, {**JOB, "output": "O.png"})
    assert len(errors) == 1 and errors[0].startswith("line 1: output: ") and "cannot be a folder" in errors[0]


def test_the_check_finds_outputs_that_cannot_be_written_and_makes_no_folder(shapes, iccm):
    os.mkfifo("pipe.png") if hasattr(os, "mkfifo") else None
    (shapes / "there.png").touch()
    names = [
        "square.svg/o.png",
        "there.png",
        "deep/er/o.png",
        *(["pipe.png"] if hasattr(os, "mkfifo") else []),
    ]
    (shapes / "j.jsonl").write_text("".join(json.dumps({**JOB, "output": name}) + "\n" for name in names))
    before = sorted(shapes.iterdir())
    result = iccm("batch", "j.jsonl", "--dry-run")
    assert result.code == 2 and len(result.lines) == len(names) - 1 and sorted(shapes.iterdir()) == before
    assert "is a file, not a folder" in result.lines[0] and "use --force" in result.lines[1]
    (shapes / "j.jsonl").write_text(json.dumps({**JOB, "output": "deep/er/o.png"}) + "\n")
    assert iccm("batch", "j.jsonl", "--dry-run").code == 0 and sorted(shapes.iterdir()) == before


def test_duplicate_keys_are_refused(shapes):
    (message,) = listed(shapes, '{"source": "square.svg", "target": "blob.svg", "size": 9, "size": 8}')
    assert "line 1: the key 'size' is given twice" in message


@pytest.mark.parametrize("name", ["A.PNG", "é.png", "\u212b.png"])
def test_names_that_collide_on_some_file_systems_are_refused(shapes, name):
    pairs = {"A.PNG": "a.png", "é.png": "e\u0301.png", "\u212b.png": "å.png"}
    errors = listed(shapes, {**JOB, "output": pairs[name]}, {**JOB, "output": name})
    assert len(errors) == 1 and "the same file on case-insensitive disks" in errors[0]


def test_a_mistake_in_the_defaults_is_reported_once_at_the_defaults(shapes):
    errors = listed(shapes, {"defaults": {"size": -3, "output": "{nonsense}.png"}}, JOB, JOB)
    assert len(errors) == 2 and all(line.startswith("line 1: [defaults]: ") for line in errors)
    errors = listed(
        shapes,
        '[defaults]\nquasi = -1\n[[job]]\nsource = "square.svg"\n[[job]]\nsource = "no.svg"',
        name="j.toml",
    )
    (about_quasi,) = [line for line in errors if "quasi" in line]
    assert about_quasi.startswith("[defaults]: quasi: ") and about_quasi.endswith("greater than 0")


def test_globs_with_too_many_matches_are_refused_before_they_are_expanded(shapes, monkeypatch):
    monkeypatch.setattr(limits, "JOBS", 5)
    (message,) = listed(shapes, {"source": "*.svg", "target": "*.svg"})
    assert message.startswith("line 1: its patterns match 9 jobs, more than 5")


GLOBS = [
    "*.svg",
    "**",
    "**/*.svg",
    "[ab].*",
    "*/c?.svg",
    "deep/**",
    "**/deep/*",
    "./*.svg",
    "deep/../*.svg",
    ".*",
    "*/.*",
]


@pytest.mark.parametrize("pattern", GLOBS)
def test_globs_match_the_files_that_python_matches(folder, pattern):
    for name in ("deep/ca.svg", "deep/deeper/cb.svg", ".hidden.svg", "deep/.x.svg", ".git/d.svg"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    expected = {str(Path(name)) for name in python_glob.glob(pattern, recursive=True) if os.path.isfile(name)}
    assert Globs([""]).files(pattern) == sorted(expected) and expected


OUT = ["/**", "../*.svg", "*/../../*", "/etc/h*s", "link/*", "*k/*", "lin?.svg"]


@pytest.mark.parametrize("pattern", OUT)
def test_a_glob_stays_in_the_root_unless_it_may_leave(folder, pattern):
    (folder / "deep").mkdir()
    (folder / "manifests").mkdir()
    (folder / "manifests" / "link").symlink_to("/etc")
    (folder / "manifests" / "lin1.svg").symlink_to("/etc/hosts")
    text = json.dumps({"source": pattern, "target": "a.svg"})
    (line,) = mistakes(text, str(folder / "manifests" / "j.jsonl"), folder)
    assert line.startswith(f"{folder}/manifests/j.jsonl: line 1: source: {pattern!r} matches ")
    assert line.endswith("outside the manifest's folder and the root; allow this with --allow-outside")


def test_globs_are_bounded_in_files_and_time(folder, monkeypatch):
    assert jobs('[[job]]\nsource = "**/*.svg"\ntarget = "a.svg"', folder=folder)
    text = '[[job]]\nsource = "**/*.zzz"\ntarget = "a.svg"'
    for name, most in (("GLOB_ENTRIES", 3), ("GLOB_SECONDS", -1)):
        with monkeypatch.context() as changed:
            changed.setattr(limits, name, most)
            (line,) = mistakes(text, folder=folder)
            assert "job 1: source: '**/*.zzz' " in line and "narrower folder" in line


def test_with_outside_globs_go_anywhere(folder):
    (folder / "deep").mkdir()
    text = json.dumps({"source": "../*.svg", "target": "../a.svg", "output": "{source.stem}.png"})
    tasks = jobs(text, str(folder / "deep" / "j.jsonl"), folder, outside=True)
    assert [task.job.source for task in tasks] == [str(folder / "deep" / ".." / f"{x}.svg") for x in "abc"]


def test_a_byte_order_mark_and_odd_ends_of_lines_are_read(shapes):
    assert listed(shapes, "\ufeff" + json.dumps(JOB)) == []
    assert listed(shapes, json.dumps({**JOB, "name": "a\u2028b\x85c"}, ensure_ascii=False)) == []


@pytest.mark.parametrize("size", ["[0.0, 0.0]", "[0, 0]", "[0.0]", "[64, 1e9]", "-1.0"])
def test_sizes_of_no_pixels_are_a_mistake(shapes, iccm, size):
    job = f'{{"source": "square.svg", "target": "blob.svg", "output": "o.png", "size": {size}}}'
    Path("j.jsonl").write_text(job)
    result = iccm("batch", "j.jsonl")
    assert (
        result.code == 2 and "size" in result.err and "line 1" in result.err and "Traceback" not in result.err
    )

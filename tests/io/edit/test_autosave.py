"""Unsaved changes are kept, offered at the next start, and deleted once they are saved."""

import os
import stat
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.edit import autosave, saving
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.edit.workspace import SAMPLES, EditedFiles
from iccm.io.run.job import make

pytestmark = pytest.mark.usefixtures("solve_once")

JOB = make({"source": "square.svg", "target": "blob.svg"})
SCENE = Scene.model_validate({"pins": [{"source": [40, 45], "target": [47, 50]}], "balance": 2.0})
AT = 4321, "token"


def test_what_was_not_saved_is_there_again_with_the_map_it_goes_on_from(shapes, state):
    edited = Session(JOB)
    edited.solve(edited.pair.first)
    edited.follow(SCENE)
    edited.solve(SCENE)
    autosave.keep(edited, SCENE, *AT)
    assert edited.start(SCENE) is not None
    again, left = Session(JOB), autosave.read(JOB)
    autosave.offer(again, left)
    assert (left.port, left.token) == AT and again.scene == again.pair.first
    described = again.describe()
    assert described["left"] == SCENE.model_dump(mode="json")
    assert datetime.fromisoformat(described["left_when"]) == left.when
    again.solve(SCENE)
    assert np.array_equal(again._map.image, edited._map.image)
    if os.name != "nt":
        assert (state / "iccm" / "edit").stat().st_mode & 0o077 == 0


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
@pytest.mark.parametrize("before", [False, True])
def test_the_token_is_the_users_alone(shapes, state, before):
    """Whatever the umask is, and even if an earlier version left folders and files that everybody can read."""
    folder = state / "iccm" / "edit"
    old = os.umask(0)
    try:
        if before:
            (folder / "files").mkdir(parents=True)
            autosave.path(JOB).write_text("{}")
        edited = Session(JOB)
        path = Path(EditedFiles(source="square.svg", target="blob.svg").put("other.svg", b"<svg/>"))
        autosave.keep(edited, SCENE, *AT)
    finally:
        os.umask(old)
    assert path.is_relative_to(folder) and "token" in autosave.path(JOB).read_text()
    paths = [state / "iccm", *(state / "iccm").rglob("*")]
    modes = {each: stat.S_IMODE(each.stat().st_mode) for each in paths}
    assert set(modes.values()) == {0o700, 0o600}
    assert all((mode == 0o700) == each.is_dir() for each, mode in modes.items())


def test_it_is_of_this_pair_alone_wherever_the_command_is_typed(shapes, monkeypatch):
    autosave.keep(Session(JOB), SCENE, *AT)
    (shapes / "deep").mkdir()
    monkeypatch.chdir(shapes / "deep")
    assert autosave.read(make({"source": "../square.svg", "target": "../blob.svg"})).scene == SCENE
    assert autosave.read(make({"source": "../square.svg", "target": "../disk.svg"})) is None
    assert autosave.read(make({"source": "../square.svg#2", "target": "../blob.svg"})) is None


def test_what_is_saved_is_forgotten(shapes):
    edited = Session(JOB)
    autosave.keep(edited, SCENE, *AT)
    saving.save(edited, SCENE, "c.json", replace=False)
    autosave.keep(edited, SCENE, *AT)
    assert autosave.read(JOB) is None


def test_what_is_offered_stays_until_it_is_taken_or_forgotten(shapes):
    autosave.keep(Session(JOB), SCENE, *AT)
    edited = Session(JOB)
    autosave.offer(edited, autosave.read(JOB))
    autosave.keep(edited, edited.pair.first, *AT)  # nothing has been changed yet
    assert autosave.read(JOB).scene == SCENE
    edited.left = None
    autosave.keep(edited, edited.pair.first, *AT)
    assert autosave.read(JOB) is None


def test_a_sample_opens_without_what_was_tried_on_it_before(state):
    name = next(iter(SAMPLES))
    earlier, later = EditedFiles(), EditedFiles()
    earlier.open_sample(name)
    first = earlier.session.pair.first
    autosave.keep(earlier.session, first.model_copy(update={"pins": first.pins[1:]}), *AT)
    assert autosave.read(earlier.session.pair.job) is not None
    later.open_sample(name)
    assert later.session.describe()["left"] is None


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"scene": {"balance": 0}}', "\0"])
def test_what_cannot_be_read_is_not_offered(shapes, text):
    autosave.keep(Session(JOB), SCENE, *AT)
    autosave.path(JOB).write_text(text)
    assert autosave.read(JOB) is None


def test_where_nothing_can_be_kept_a_line_says_so(shapes, state):
    (state / "iccm").write_text("a file")
    with pytest.raises(InputError, match="iccm: cannot create a private folder"):
        autosave.keep(Session(JOB), SCENE, *AT)

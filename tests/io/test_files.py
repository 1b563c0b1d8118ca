"""Outputs are complete or absent; unreadable inputs are reported in one line."""

import errno
import hashlib
import ntpath
import os
import stat
from types import SimpleNamespace

import pytest

from iccm import InputError
from iccm.io import files


def only(folder, *names):
    return sorted(p.name for p in folder.iterdir()) == sorted(names)


def test_written_whole_with_the_suffix_kept(tmp_path):
    out = tmp_path / "picture.png"
    with files.replacing(out) as temporary:
        assert temporary.suffix == ".png" and temporary.parent == tmp_path
        temporary.write_bytes(b"new")
        assert not out.exists()
    assert out.read_bytes() == b"new" and only(tmp_path, "picture.png")


def test_new_files_have_ordinary_permissions(tmp_path):
    old = os.umask(0o027)
    try:
        with files.replacing(tmp_path / "a") as temporary:
            temporary.write_text("x")
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, InputError])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, error):
    out = tmp_path / "a.obj"
    out.write_text("old")
    with pytest.raises(error), files.replacing(out, force=True) as temporary:
        temporary.write_text("half")
        raise error("stop")
    assert out.read_text() == "old" and only(tmp_path, "a.obj")


def test_an_existing_file_needs_force(tmp_path):
    out = tmp_path / "a.txt"
    out.write_text("old")
    with pytest.raises(InputError, match="--force"), files.replacing(out):
        pass
    with files.replacing(out, force=True) as temporary:
        temporary.write_text("new")
    assert out.read_text() == "new"


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path):
    out = tmp_path / "a.txt"
    with pytest.raises(InputError, match="another program created"), files.replacing(out) as temporary:
        temporary.write_text("mine")
        out.write_text("theirs")
    assert out.read_text() == "theirs" and only(tmp_path, "a.txt")


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    with files.replacing(tmp_path / "link.txt", force=True) as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.txt").is_symlink() and (tmp_path / "real.txt").read_text() == "new"


@pytest.mark.parametrize(
    "name, message",
    [("missing/a.png", "does not exist"), (".", "is a folder"), ("a" * 300, "cannot write this file")],
)
def test_impossible_outputs_are_one_line(tmp_path, name, message):
    with pytest.raises(InputError, match=message) as caught, files.replacing(tmp_path / name):
        pytest.fail("the block must not run")
    assert "\n" not in str(caught.value) and only(tmp_path)


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
@pytest.mark.skipif(os.name != "nt" and os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="not writable"), files.replacing(tmp_path / "a"):
        pytest.fail("the block must not run")
    tmp_path.chmod(0o700)


def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="No space left"), files.replacing(tmp_path / "a") as temporary:
        temporary.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert only(tmp_path)


def test_other_errors_of_the_block_pass_through(tmp_path):
    with pytest.raises(FileNotFoundError), files.replacing(tmp_path / "a"):
        (tmp_path / "texture.png").read_bytes()
    assert only(tmp_path)


def test_a_removed_temporary_file_is_reported(tmp_path):
    with (
        pytest.raises(InputError, match="cannot write this file"),
        files.replacing(tmp_path / "a") as temporary,
    ):
        temporary.unlink()


def test_inputs(tmp_path):
    (tmp_path / "a").write_bytes(b"content")
    (tmp_path / "empty").touch()
    assert files.open_input(tmp_path / "a") == tmp_path / "a"
    assert files.read_bytes(tmp_path / "a", max_bytes=7) == b"content"
    # no memory is reserved for the limit
    assert files.read_bytes(tmp_path / "a", max_bytes=1 << 60) == b"content"
    assert files.sha256(tmp_path / "a") == hashlib.sha256(b"content").hexdigest()
    for call, message in [
        (lambda: files.open_input(tmp_path / "b"), "b: no such file"),
        (lambda: files.open_input(tmp_path), "is a folder"),
        (lambda: files.open_input("a\0b"), "cannot read this file"),
        (lambda: files.read_bytes(tmp_path / "a", max_bytes=6), "7 bytes, more than the limit of 6"),
        (lambda: files.read_bytes(tmp_path / "empty", max_bytes=6), "empty"),
        (lambda: files.sha256(tmp_path / "b"), "no such file"),
    ]:
        with pytest.raises(InputError, match=message):
            call()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes of POSIX")
def test_a_pipe_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="plain file"):
        files.open_input(tmp_path / "pipe")


def test_a_mistake_names_the_file_and_not_the_temporary_one(tmp_path):
    out = tmp_path / "picture.png"
    with (
        pytest.raises(InputError, match=f"^{out}: cannot write this file"),
        files.replacing(out) as temporary,
    ):
        raise InputError(f"{temporary}: cannot write this file")
    assert only(tmp_path)


def test_temporary_files_of_an_output_are_recognised_by_name(tmp_path):
    out = tmp_path / "picture.png"
    with files.replacing(out) as temporary:
        kept = [tmp_path / name for name in (".picture.png", ".picture.abc.png", "picture.abcdefgh.png")]
        for path in kept:
            path.touch()
        assert files.sweep([tmp_path / "other.png", tmp_path / "picture.tif"]) == []
        assert files.sweep([out]) == [temporary] and all(path.exists() for path in kept)
        temporary.touch()


@pytest.mark.parametrize(
    "name",
    [
        *("picture", "a.b.jsonl", "x" * 60 + ".png", ".hidden", "p.abcdefgh"),
        *([] if os.name == "nt" else ["two\nlines.png"]),
    ],
)
def test_temporary_files_of_any_name_are_swept(tmp_path, name):
    with files.replacing(tmp_path / name) as temporary:
        assert files.sweep([tmp_path / name, tmp_path / "gone" / name]) == [temporary]
        temporary.touch()


def test_outputs_are_not_written_through_dangling_links_without_force(tmp_path):
    (tmp_path / "a.png").symlink_to(tmp_path / "gone" / "b.png")
    (tmp_path / "gone").mkdir()
    with pytest.raises(InputError, match="link"), files.replacing(tmp_path / "a.png"):
        pytest.fail("the block must not run")
    assert only(tmp_path / "gone")
    with files.replacing(tmp_path / "a.png", force=True) as temporary:
        temporary.write_text("new")
    assert (tmp_path / "gone" / "b.png").read_text() == "new"


@pytest.fixture
def permissive():
    """An umask that permits everything."""
    old = os.umask(0)
    yield
    os.umask(old)


@pytest.mark.skipif(os.name == "nt", reason="permissions of POSIX")
def test_private_folders_and_files_are_closed_for_any_umask_also_existing_ones(tmp_path, permissive):
    top = tmp_path / "state" / "iccm"
    deep = top / "edit" / "files"
    files.make_private_folder(deep, top)
    for folder in (top.parent, top, top / "edit", deep):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    for folder in (top, top / "edit", deep):
        folder.chmod(0o755)
    (deep / "a").write_text("old")
    (deep / "a").chmod(0o644)
    files.make_private_folder(deep, top)
    assert {stat.S_IMODE(folder.stat().st_mode) for folder in (top, top / "edit", deep)} == {0o700}
    files.write_bytes(deep / "a", b"new", force=True, private=True)
    files.write_bytes(deep / "b", b"new", private=True)
    assert {stat.S_IMODE(path.stat().st_mode) for path in deep.iterdir()} == {0o600}


def test_files_written_together_appear_all_or_not_at_all(tmp_path):
    (tmp_path / "b").write_text("old")
    with pytest.raises(KeyError), files.together():
        files.write_bytes(tmp_path / "a", b"new")
        files.write_bytes(tmp_path / "b", b"new", force=True)
        raise KeyError
    assert only(tmp_path, "b") and (tmp_path / "b").read_text() == "old"
    with files.together():
        files.write_bytes(tmp_path / "a", b"new")
        files.write_bytes(tmp_path / "b", b"new", force=True)
        assert not (tmp_path / "a").exists()
    assert only(tmp_path, "a", "b") and (tmp_path / "b").read_text() == "new"
    files.write_bytes(tmp_path / "c", b"at once")
    assert (tmp_path / "c").read_text() == "at once"


@pytest.mark.parametrize(
    "data", [rb'{"id": "\ud800"}', rb'["a", {"\udfff x": 1}]', b'["\xed\xa0\x80"]', r'["\uD83D"]']
)
def test_json_with_halves_of_surrogate_pairs_is_refused(data):
    with pytest.raises(InputError):
        files.parse_json(data)


def test_whole_surrogate_pairs_are_characters(tmp_path):
    assert files.parse_json(rb'{"id": "\ud83d\ude00"}') == {"id": "\N{GRINNING FACE}"}
    assert files.parse_json('["é"]'.encode("utf-16")) == ["é"]


def test_paths_on_several_drives(monkeypatch):
    monkeypatch.setattr(files, "os", SimpleNamespace(path=ntpath))
    same_drive = files.relative_path(r"C:\out\a.png", r"C:\out\site")
    other_drive = files.relative_path(r"D:\out\a.png", r"C:\out\site")
    common = files.common_folder([r"C:\out\a", r"c:\out\b"])
    with pytest.raises(InputError) as caught:
        files.common_folder([r"C:\out\a", r"D:\out\b"])
    monkeypatch.undo()
    assert (same_drive, other_drive, common) == (r"..\a.png", r"D:\out\a.png", r"C:\out")
    assert "C:, D:" in str(caught.value) and "one drive" in str(caught.value)


def test_an_input_is_found_under_a_name_of_another_case(tmp_path):
    """As on macOS, where both names are one file: here one is a link to the other."""
    (tmp_path / "Shape.svg").write_text("input")
    with pytest.raises(InputError, match="another output"):
        files.check_outputs([str(tmp_path / "Shape.svg")], [tmp_path / "Shape.svg"], force=True)
    os.link(tmp_path / "Shape.svg", tmp_path / "shape.SVG")
    with pytest.raises(InputError, match="another output"):
        files.check_outputs([str(tmp_path / "shape.SVG")], [tmp_path / "Shape.svg"], force=True)
    os.link(tmp_path / "Shape.svg", tmp_path / "copy.svg")  # a file of its own, as far as names say
    files.check_outputs([str(tmp_path / "copy.svg")], [tmp_path / "Shape.svg"], force=True)

"""Saved maps: they are restored bit for bit, and invalid files are rejected in one line."""

import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

import iccm
from iccm.errors import InputError
from iccm.status import Status

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "map-file.md"
SQUARE = np.array([0, 1, 1 + 1j, 1j])
T = np.exp(2j * np.pi * np.arange(60) / 60)
FLOWER = T * (2 + 0.3 * np.cos(5 * np.angle(T)))
RING = {"source_holes": [0.5 + 0.5j + 0.2 * T], "target_holes": [0.5 * T]}


@pytest.fixture(scope="module")
def fits(bent):
    return {
        "deformed": bent,
        "balanced": iccm.fit(SQUARE, FLOWER, fit="whole", pins=[(0.5 + 0.5j, 0.1j)]),
        "with a rigid region": iccm.fit(SQUARE, FLOWER, fit="whole", rigid=[0.5 + 0.5j + 0.1 * T]),
        "with a hole": iccm.fit(SQUARE, FLOWER, fit="whole", **RING),
        "partial": iccm.fit(SQUARE, np.array([0, 4, 4 + 3j, 2.2 + 3j, 2.1 + 1j, 1.9 + 3j, 3j]), fit="cover"),
        "quasi-conformal": iccm.fit(SQUARE, FLOWER, method="paper", quasi=0.1, vertices=40),
    }


@pytest.fixture(scope="module")
def bent():
    return iccm.deform(SQUARE, pins=[(0.2 + 0.2j, 0.2 + 0.2j), (0.8 + 0.8j, 1 + 1.2j)])


@pytest.fixture
def saved(bent, tmp_path):
    bent.save(tmp_path / "map.npz")
    return tmp_path / "map.npz"


@pytest.mark.slow
def test_a_loaded_map_equals_the_saved_one_bit_for_bit(fits, tmp_path):
    assert fits["partial"].coverage.is_partial and len(fits["with a hole"].map.loops) == 2
    for name, fit in fits.items():
        fit.save(path := tmp_path / "map.npz")
        loaded = iccm.load(path)
        z = fit._interior
        w = fit.map(z)
        assert loaded.map(z).tobytes() == w.tobytes(), name
        assert loaded.inverse(w).tobytes() == fit.inverse(w).tobytes(), name
        assert loaded.report() == fit.report() and loaded.status is fit.status, name
        pixels = [iccm.warp(map, iccm.checkerboard(64), size=64).pixels for map in (fit, loaded)]
        assert pixels[0].tobytes() == pixels[1].tobytes(), name
        loaded.save(tmp_path / "again.npz")
        assert (tmp_path / "again.npz").read_bytes() == path.read_bytes(), name


def test_the_reader_of_the_page_evaluates_the_map(bent, saved, monkeypatch, capsys):
    monkeypatch.chdir(saved.parent)
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 30
    reader: dict = {}
    exec(code.partition("print(")[0], reader)
    z = bent._interior[::97]
    w = bent.map(z)
    assert np.abs([reader["forward"](point) for point in z] - w).max() < 1e-12
    assert np.abs([reader["inverse"](point) for point in w] - z).max() < 1e-12


def changed(path, **arrays):
    """Write the file with other arrays; None removes one."""
    with np.load(path) as file:
        contents = {**file, **arrays}
    np.savez(path, **{name: values for name, values in contents.items() if values is not None})


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("format", lambda a: np.array("iccm.map/2")),
        ("about", lambda a: np.array('{"names": ["a", "b"]}')),
        ("vertices", lambda a: np.where(np.arange(a.size) == 3, np.nan, a)),
        ("vertices", lambda a: a[:-1]),
        ("images", lambda a: a.conj()),
        ("images", lambda a: a.astype(np.complex64)),
        ("faces", lambda a: np.where(a == 7, a.max() + 1, a)),
        ("faces", lambda a: a - 1),
        ("faces", lambda a: a[:, ::-1]),
        ("faces", lambda a: None),
        ("sides", lambda a: a[::-1]),
        ("bulges", lambda a: a[:-1]),
        ("loops", lambda a: a[::-1]),
        ("loops_ends", lambda a: a + 1),
        ("near", lambda a: np.float64(7)),
        ("source", lambda a: a[[0, 2, 1, 3]]),
        ("source", lambda a: a[:0]),
        ("source_box", lambda a: a[::-1]),
        ("target_y", lambda a: np.int32(0)),
        ("hole_partners", lambda a: np.array([[5, 5]], np.int32)),
        ("pins", lambda a: np.array([[object(), None]])),
    ],
)
def test_unsound_maps_are_refused_in_one_line(saved, name, change):
    with np.load(saved) as file:
        stored = file[name]
    changed(saved, **{name: change(stored)})
    with pytest.raises(InputError, match=r"map\.npz") as error:
        iccm.load(saved)
    assert "\n" not in str(error.value)


def test_other_files_are_refused(saved, tmp_path):
    whole = saved.read_bytes()
    for content in (b"", b"PK\x03\x04", whole[: len(whole) // 2], whole[:-40]):
        (tmp_path / "torn.npz").write_bytes(content)
        with pytest.raises(InputError, match=r"torn\.npz"):
            iccm.load(tmp_path / "torn.npz")
    np.save(tmp_path / "array.npy", np.arange(3))
    for name in ("array.npy", "missing.npz"):
        with pytest.raises(InputError, match=re.escape(name)):
            iccm.load(tmp_path / name)


def test_files_from_before_there_were_rigid_regions_are_read(saved):
    changed(saved, rigid=None, rigid_ends=None)
    assert iccm.load(saved).status.ok and not iccm.load(saved).rigid


def rewritten(path, name, content, method=zipfile.ZIP_DEFLATED):
    """Write the file with other bytes for one member; `content` makes them from the old ones."""
    with zipfile.ZipFile(path) as archive:
        members = {entry: archive.read(entry) for entry in archive.namelist()}
    old = members.pop(f"{name}.npy")
    with zipfile.ZipFile(path, "w") as archive:
        for entry, data in members.items():
            archive.writestr(entry, data)
        archive.writestr(*content(f"{name}.npy", old), compress_type=method)


def header(shape, descr="<c16", version=1):
    """The header of an array in NumPy's format."""
    text = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape!r}, }}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + len(text).to_bytes(2, "little") + text


@pytest.mark.parametrize(
    "content",
    [
        lambda name, old: (name[:-4], b"hello"),  # a member that is not an array
        lambda name, old: (name, b"hello"),
        lambda name, old: (name, header((2_000_000_000,))),
        lambda name, old: (name, header((10**30,))),
        lambda name, old: (name, header((-1,)) + bytes(16)),
        lambda name, old: (name, header((10**12,), "<U0")),
        lambda name, old: (name, header((1,), "|O") + b"cos\nsystem\n(S'true'\ntR."),
        lambda name, old: (name, header((3,), "<c16", 3) + bytes(48)),
        lambda name, old: (name, header("(" * 5000)),
        lambda name, old: (name, header("(3, ")),
        lambda name, old: (name, old[:-1]),
        lambda name, old: (name, old + b"\0"),
        lambda name, old: (name, old[:-16] + np.array([1e101 + 0j]).tobytes()),
    ],
)
def test_members_that_are_not_the_arrays_they_claim_to_be_are_refused(saved, content):
    rewritten(saved, "vertices", content)
    with pytest.raises(InputError, match=r"map\.npz.*vertices") as error:
        iccm.load(saved)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_compressions_that_numpy_does_not_write_are_refused(saved, method):
    rewritten(saved, "faces", lambda name, old: (name, old), method)
    with pytest.raises(InputError, match="faces"):
        iccm.load(saved)


def test_arrays_stored_by_columns_are_read(bent, saved):
    changed(saved, faces=np.asfortranarray(bent.map.faces.astype(np.int32)))
    assert np.array_equal(iccm.load(saved).map.faces, bent.map.faces)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("names", ["a.svg", 3]),
        ("names", ["a.svg", "b\nc.svg"]),
        ("names", ["a.svg", "\ud800"]),
        ("ended", [["x"]]),
        ("ended", None),
        ("ended", "MAYBE"),
        ("notes", "all is well"),
        ("notes", [3]),
        ("energies", {"total": 1}),
        ("energies", [{"total": "1"}]),
        ("energies", [3]),
        ("rigid", [True]),
        ("rigid", [0]),
        ("rigid", 2),
        ("rigid_of_target", 1),
        ("job", ["plot"]),
    ],
)
def test_values_of_another_type_are_refused(saved, key, value):
    with np.load(saved) as file:
        about = json.loads(str(file["about"]))
    changed(saved, about=np.array(json.dumps(about | {key: value})))
    with pytest.raises(InputError, match=r"map\.npz.*about") as error:
        iccm.load(saved)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_crowded_conformal_map_is_read_as_it_was_written(tmp_path):
    """Vertices that crowding requires may be closer to each other than an outline's may be."""
    square, dart = np.array([0, 100, 100 + 100j, 100j]), np.array([0, 50 + 49.9j, 100, 50 + 50j])[::-1]
    fit = iccm.fit(square, dart, method="conformal")
    assert fit.status is Status.CROWDED
    fit.save(path := tmp_path / "map.npz")
    loaded = iccm.load(path)
    assert loaded.status is Status.CROWDED
    assert np.array_equal(loaded.map.polygon, fit.map.polygon)
    points = np.array([10 + 10j, 50 + 50j, 90 + 20j])
    assert np.array_equal(loaded.map(points), fit.map(points))

"""Textures transferred between two layouts of a surface, compared with the surface's colours by formula."""

import json

import numpy as np
import pytest
from matplotlib.tri import LinearTriInterpolator, Triangulation

from iccm.io.pictures import image_files
from iccm.meshes.charted import Charted
from iccm.meshes.relayout import Origin, partners

N = 256
MIDDLE = np.array([0.5, 0.5])


def grid(n):
    """The quads of a grid over the unit square, with x and y."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    return x.ravel(), y.ravel(), np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1).reshape(-1, 4)


def hill(x, y):
    return 0.3 * np.sin(3 * x) * np.cos(2 * y)


def plane(x, y):
    return 0 * x


def upright(x, y):
    return 0.05 + 0.9 * np.column_stack([x, y])


def turned(angle, mirrored=False, bent=0.0):
    """Another layout: shrunk, rotated by radians, and possibly mirrored and bent."""

    def layout(x, y):
        c, s = np.cos(angle), np.sin(angle)
        uv = (upright(x, y) - MIDDLE) * 0.65 @ np.array([[c, s], [-s, c]]) + MIDDLE
        uv += bent * np.column_stack([np.sin(4 * y), np.cos(3 * x)])
        return uv * [-1, 1] + [1, 0] if mirrored else uv

    return layout


def write(path, layout, n=16, height=hill, shuffled=False):
    x, y, quads = grid(n)
    rows = [f"v {a:.9g} {b:.9g} {c:.9g}" for a, b, c in zip(x, y, height(x, y))]
    rows += [f"vt {a:.9g} {b:.9g}" for a, b in layout(x, y)]
    if shuffled:
        quads = np.roll(np.random.default_rng(0).permutation(quads), 1, axis=1)
    rows += ["f " + " ".join(f"{c + 1}/{c + 1}" for c in quad) for quad in quads]
    path.write_text("\n".join(rows) + "\n")


def colour(x, y):
    """Colours (…, 3) in 0..255 of the surface over x, y."""
    return 255 * np.stack(
        [0.5 + 0.4 * np.sin(9 * x), 0.5 + 0.4 * np.cos(7 * y), 0.5 + 0.3 * np.sin(5 * x + 6 * y)], -1
    )


def texels():
    """u and v of the centres of a picture's texels."""
    t = (np.arange(N) + 0.5) / N
    return np.meshgrid(t, 1 - t)


def old_texture(path):
    u, v = texels()
    x, y = (u - 0.05) / 0.9, (v - 0.05) / 0.9
    image_files.write(path, image_files.Image(colour(x, y).round().clip(0, 255).astype(np.uint8)))


def brute_force(layout, n):
    """The picture expected in another layout, NaN outside: matplotlib finds the triangle of each texel."""
    x, y, quads = grid(n)
    uv = layout(x, y)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = Triangulation(*uv.T, faces)
    coordinates = (LinearTriInterpolator(mesh, w)(*texels()).filled(np.nan) for w in (x, y))
    return colour(*coordinates)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "old.obj", upright)
    old_texture(tmp_path / "old.png")
    return tmp_path


@pytest.mark.parametrize(
    ("layout", "n", "shuffled", "same_triangles"),
    [
        (turned(0.4, bent=0.03), 16, False, 512),
        (turned(0.4, bent=0.03), 16, True, 512),
        (turned(2.0, mirrored=True), 16, True, 512),
        (turned(-1.0, bent=0.03), 25, False, 0),  # another mesh of the surface
    ],
)
def test_a_texture_in_another_layout_equals_a_brute_force_bake(
    folder, iccm, layout, n, shuffled, same_triangles
):
    write(folder / "new.obj", layout, n, shuffled=shuffled)
    result = iccm(
        "relayout",
        "old.obj",
        "new.obj",
        "--texture",
        "old.png",
        "-o",
        "o.png",
        "--size",
        N,
        "--report",
        "r.json",
    )
    report = json.loads((folder / "r.json").read_text())
    assert (result.code, report["status"], report["same_triangles"]) == (0, "done", same_triangles)
    expected, picture = brute_force(layout, n), image_files.read("o.png").pixels.astype(float)
    inside = np.isfinite(expected).all(axis=-1)
    assert inside.sum() > 0.2 * N * N
    off = (np.abs(picture - expected)[inside] > 8).any(axis=-1).mean()
    assert off <= 0.005


@pytest.mark.parametrize(
    ("shuffled", "place", "match"),
    [
        (False, lambda x, y, z: (3 * x, y + 2, np.sin(9 * x)), "auto"),  # another shape, by index
        (False, lambda x, y, z: (3 * x, y + 2, np.sin(9 * x)), "index"),
        (False, lambda x, y, z: (x, y, z + 0.3 * (x > 0.7)), "auto"),  # most of it in the same place
        (True, lambda x, y, z: (100 * y, 100 * z + 7, 100 * x), "auto"),  # in another place and order
        (True, lambda x, y, z: (100 * y, 100 * z + 7, 100 * x), "position"),  # by the best similarity
        (True, lambda x, y, z: ((x + 2) ** 2, y + 2, z), "auto"),  # another shape and order, by connectivity
    ],
)
def test_the_same_faces_in_another_shape_or_place_are_found(folder, iccm, shuffled, place, match):
    write(folder / "new.obj", turned(0.4, bent=0.03), shuffled=shuffled)
    lines = (folder / "new.obj").read_text().splitlines()
    moved = [
        f"v {' '.join(map(str, place(*map(float, line[2:].split()))))}" for line in lines if line[:2] == "v "
    ]
    (folder / "new.obj").write_text("\n".join(moved + [line for line in lines if line[:2] != "v "]) + "\n")
    words = ("--texture", "old.png", "-o", "o.png", "--size", N, "--match", match, "--report", "r.json")
    result = iccm("relayout", "old.obj", "new.obj", *words)
    assert result.code == 0, result.err
    assert json.loads((folder / "r.json").read_text())["same_triangles"] == 512
    expected, picture = (
        brute_force(turned(0.4, bent=0.03), 16),
        image_files.read("o.png").pixels.astype(float),
    )
    inside = np.isfinite(expected).all(axis=-1)
    assert (np.abs(picture - expected)[inside] > 8).any(axis=-1).mean() <= 0.01


def test_meshes_far_from_each_other_are_refused(folder, iccm):
    write(folder / "new.obj", turned(0.4), 9, height=lambda x, y: hill(x, y) + 50)
    for match, tried in (
        ("auto", "by position, by index, by topology"),
        ("index", "--match index"),
    ):
        result = iccm(
            "relayout", "old.obj", "new.obj", "--texture", "old.png", "-o", "o.png", "--match", match
        )
        assert result.code == 2 and tried in result.err
        assert not (folder / "o.png").exists()


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", ["normal", "normal-down"])
def test_normals_rotate_with_the_tangents(folder, iccm, kind, mirrored):
    """On a plane, the tangents are the layouts' own directions."""
    angle, up = 0.7, 1 if kind == "normal" else -1
    write(folder / "flat.obj", upright, height=plane)
    write(folder / "new.obj", turned(angle, mirrored), height=plane)
    n = np.array([0.5, 0.2, np.sqrt(1 - 0.29)])
    stored = np.tile((128 + 127 * n * [1, up, 1]).round().astype(np.uint8), (N, N, 1))
    image_files.write("n.png", image_files.Image(stored))
    assert iccm("relayout", "flat.obj", "new.obj", f"--{kind}", "n.png", "-o", "o.png").code == 0
    pixels = image_files.read("o.png").pixels
    normal = (pixels[len(pixels) // 2, len(pixels) // 2].astype(float) - 128) / 127 * [1, up, 1]
    # a direction of the surface appears in the new picture rotated by the angle, and mirrored if the picture is
    seen = (n[0] + 1j * n[1]) * np.exp(1j * angle)
    seen = -seen.conj() if mirrored else seen
    assert normal == pytest.approx([seen.real, seen.imag, n[2]], abs=0.015)


def test_several_textures_keep_their_type_and_names(folder, iccm):
    write(folder / "new.obj", turned(0.3))
    image_files.write("rough.tif", image_files.Image(np.full((64, 64, 1), 30000, np.uint16)))
    words = ("--texture", "old.png", "--data", "rough.tif", "-o", "new-{stem}.tif", "--size", "128")
    assert iccm("relayout", "old.obj", "new.obj", *words).code == 0
    rough = image_files.read("new-rough.tif").pixels
    assert (rough.shape, rough.dtype) == ((128, 128, 1), np.uint16)
    assert (rough[60:68, 60:68] == 30000).all()
    assert image_files.read("new-old.tif").pixels.dtype == np.uint8


def test_parts_too_far_from_the_old_surface_stay_empty_and_are_reported(folder, iccm):
    write(folder / "new.obj", turned(0.0), 10, lambda x, y: hill(x, y) + 0.3 * (x > 0.55))
    words = ("--texture", "old.png", "-o", "o.png", "--report", "r.json", "--padding", "0", "--size", N)
    result = iccm("relayout", "old.obj", "new.obj", *words)
    report = json.loads((folder / "r.json").read_text())
    assert (result.code, report["status"]) == (1, "far")
    assert 0.3 < report["far_texels"] / report["layout"]["covered_texels"] < 0.6
    assert f"{report['far_texels']} texels stay empty, because they are farther from old.obj" in result.err
    assert not image_files.read("o.png").pixels[N // 2, int(0.7 * N)].any()


@pytest.mark.parametrize(
    ("layout", "width", "height", "side"),
    [
        (upright, N, N, N),
        (upright, N, N // 4, N),  # square
        (lambda x, y: upright(x, y) / 2, N, N, 2 * N),
        (lambda x, y: upright(y, x) * (1, 0.5), N, N, 2 * N),
        (lambda x, y: upright(x, y) / 1.5, N, N, 2 * N),  # the next power of two
        (lambda x, y: upright(x, y) / 1.05, N, N, N),  # nearly that power of two
        (upright, 3 * N // 2, N, 2 * N),
        (lambda x, y: 0.45 * upright(x, y), N, N, 2 * N),  # at most twice the old texture
    ],
)
def test_pictures_are_as_dense_on_the_surface_as_the_old_ones(folder, iccm, layout, width, height, side):
    image_files.write("t.png", image_files.Image(np.zeros((height, width, 3), np.uint8)))
    write(folder / "new.obj", layout, 4)
    write(folder / "old.obj", upright, 4)
    words = ("--texture", "t.png", "-o", "o.png", "--report", "r.json")
    assert iccm("relayout", "old.obj", "new.obj", *words).code == 0
    shape = image_files.read("o.png").pixels.shape
    assert shape[:2] == (side, side)
    assert json.loads((folder / "r.json").read_text())["size"] == [shape[1], shape[0]]


def test_a_triangle_far_smaller_than_a_texel_does_not_make_pictures_larger(folder, iccm):
    """It is a quarter of a texel high in the old layout, and a thousandth of that in the new one."""
    write(folder / "new.obj", turned(0.0))
    words = (
        "relayout",
        "old.obj",
        "new.obj",
        "--texture",
        "old.png",
        "-o",
        "o.png",
        "--report",
        "r.json",
        "--force",
    )
    sizes = []
    for _ in range(2):
        assert iccm(*words).code == 0
        sizes.append(json.loads((folder / "r.json").read_text())["size"])
        for name, uv in (
            ("old", "vt 0 .96\nvt .04 .96\nvt 0 .961\n"),
            ("new", "vt .9 .1\nvt .94 .1\nvt .9 .100001\n"),
        ):
            with (folder / f"{name}.obj").open("a") as file:
                file.write("v 2 0 0\nv 2.1 0 0\nv 2 .1 0\n" + uv + "f -3/-3 -2/-2 -1/-1\n")
    assert sizes[1] == pytest.approx(sizes[0], rel=0.02)


def test_a_limited_picture_size_gets_a_note(folder, iccm, monkeypatch):
    monkeypatch.setattr("iccm.meshes.relayout.LARGEST_TEXELS_ACROSS", 8)
    image_files.write("t.png", image_files.Image(np.zeros((16, 16, 3), np.uint8)))
    write(folder / "new.obj", lambda x, y: upright(x, y) / 2, 4)
    write(folder / "old.obj", upright, 4)
    (folder / "old.obj").write_text("mtllib m.mtl\nusemtl a\n" + (folder / "old.obj").read_text())
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd t.png\n")
    for words in (["--texture", "t.png", "-o", "o.png"], ["-o", "o.obj"]):
        result = iccm("relayout", "old.obj", "new.obj", *words)
        assert "use --size 32" in result.err
        assert (
            "use --size" not in iccm("relayout", "old.obj", "new.obj", *words, "--size", "16", "--force").err
        )


@pytest.mark.slow
def test_a_palette_becomes_a_picture_with_room_for_its_colours(folder, iccm):
    """If charts are points, each on its own colour, the old picture's size does not matter."""
    x, y, quads = grid(4)
    palette = np.random.default_rng(1).integers(0, 256, (1, 16, 3)).astype(np.uint8)
    image_files.write("t.png", image_files.Image(palette))
    rows = [f"v {a} {b} 0" for a, b in zip(x, y)] + [f"vt {(k + 0.5) / 16} 0.5" for k in range(16)]
    rows += ["f " + " ".join(f"{c + 1}/{k + 1}" for c in quad) for k, quad in enumerate(quads)]
    (folder / "old.obj").write_text("\n".join(rows) + "\n")
    write(folder / "new.obj", lambda x, y: np.column_stack([x, y]), 4, plane)
    assert iccm("relayout", "old.obj", "new.obj", "--texture", "t.png", "-o", "o.png").code == 0
    picture = image_files.read("o.png").pixels
    side = len(picture) // 4
    assert side > 100
    for k in range(16):
        column, row = divmod(k, 4)
        tile = picture[(3 - row) * side :, column * side :][1 : side - 1, 1 : side - 1].astype(int)
        assert np.abs(tile - palette[0, k]).max() <= 1


def test_triangles_without_area_in_the_new_layout_are_reported(folder, iccm):
    """The right half of its faces is a line there."""
    write(folder / "old.obj", upright, 4, plane)
    write(folder / "new.obj", lambda x, y: np.column_stack([np.minimum(x, 0.5), y]), 4, plane)
    image_files.write("t.png", image_files.Image(np.full((8, 8, 3), 200, np.uint8)))
    result = iccm("relayout", "old.obj", "new.obj", "--texture", "t.png", "-o", "o.png")
    assert result.code == 0
    assert "new.obj: 50.0% of the surface shows no texture" in result.err


def test_a_layout_without_area_is_not_done(folder, iccm):
    write(folder / "new.obj", lambda x, y: 0 * upright(x, y), 4)
    words = ("--texture", "old.png", "-o", "o.png", "--report", "r.json")
    result = iccm("relayout", "old.obj", "new.obj", *words)
    assert (result.code, json.loads((folder / "r.json").read_text())["status"]) == (1, "empty")
    assert "cover no texel" in result.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "o.png"), "no texture"),
        (("--texture", "old.png", "-o", "a.png", "-o", "b.png"), "1 texture but 2 outputs"),
        (("--texture", "old.png", "--force", "-o", "old.png"), "is also an input"),
        (("--normal", "grey.png", "-o", "o.png"), "normal map needs 3"),
        (("--texture", "old.png", "-o", "o.xyz"), "o.xyz"),
    ],
)
def test_wrong_options_are_refused_in_one_line(folder, iccm, words, message):
    write(folder / "new.obj", turned(0.3))
    image_files.write("grey.png", image_files.Image(np.zeros((8, 8, 1), np.uint8)))
    result = iccm("relayout", "old.obj", "new.obj", *words)
    assert result.code == 2
    assert message in result.err
    assert not (folder / "o.png").exists()


def test_partners_are_found_for_any_order_and_rotation_of_faces():
    x, y, quads = grid(3)
    points = np.column_stack([x, y, hill(x, y)])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    order = np.random.default_rng(1).permutation(len(faces))
    shuffled = np.roll(faces[order], 1, axis=1)
    old, new = (Charted("m", points, f, points[:, :2], f) for f in (faces, shuffled))
    partner, turn = partners(old, new)
    assert (partner == order).all()
    assert (np.take_along_axis(shuffled, turn, axis=1) == faces[order]).all()
    apart = Charted("m", points + np.array([0, 0, 1]), faces, points[:, :2], faces)
    assert (partners(old, apart)[0] == -1).all()


def test_footprints_of_a_rotated_layout_are_rotated():
    """The new layout is half as large, and rotated by 90 degrees: a texel to its right is two texels down in the old
    layout, whose picture is twice as wide as high.
    """
    points, faces = (
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    uv = points[:, :2]
    old = Charted("old", points, faces, uv, faces)
    new = Charted("new", points, faces, 0.5 + 0.5 * (uv - 0.5) @ np.array([[0, 1], [-1, 0]]), faces)
    origin = Origin.of(old, new, 64, 64)
    rows, columns = np.array([30, 20]), np.array([40, 25])
    places = origin.places(rows, columns, (128, 64))
    assert places.jacobian == pytest.approx(np.array([[0, -4, 2, 0]] * 2), abs=1e-6)

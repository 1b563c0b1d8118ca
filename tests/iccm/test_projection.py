"""Sheets on simple surfaces seen by a camera, against ray tracing, which knows nothing of how they are unrolled."""

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.projection.camera import Camera
from iccm.projection.marked import planar, revolved
from iccm.projection.method import FlatView, solve
from iccm.projection.surfaces import Ball, Flat, Revolved
from iccm.projection.view import Projected
from tests.cases import some_fast

BOX = 3 + 2j, 203 + 82j  # the canvas of the label
SIZE = 120.0, 48.0  # of the label on the surface
TURN, PITCH, DISTANCE = 25.0, 12.0, 400.0


def rays(pixels, turn=TURN, pitch=PITCH, distance=DISTANCE):
    """Origin and directions of the rays through points of the picture, in the axes of the object."""
    a, b = np.radians(turn), np.radians(pitch)
    # from the camera's axes: first raise it by the pitch, then go around the object by the turn
    origin = np.array([0, 0, distance])
    ways = np.stack([pixels.real, pixels.imag, np.full(pixels.shape, -distance)], axis=-1)
    raised = np.array([[1, 0, 0], [0, np.cos(b), np.sin(b)], [0, -np.sin(b), np.cos(b)]])
    around = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
    return origin @ (around @ raised).T, ways @ (around @ raised).T


def first_hit(a, b, c):
    """The smaller solution of a t² + 2 b t + c = 0; NaN for rays that miss."""
    root = b * b - a * c
    with np.errstate(invalid="ignore"):
        return (-b - np.sqrt(root)) / a


def on_canvas(s, t, size=SIZE):
    """Points of the label's canvas for lengths on the surface from the label's middle; NaN beyond the label."""
    extent = BOX[1] - BOX[0]
    z = (BOX[0] + BOX[1]) / 2 + s / size[0] * extent.real + 1j * t / size[1] * extent.imag
    return np.where((np.abs(s) < size[0] / 2) & (np.abs(t) < size[1] / 2), z, np.nan)


def traced_cone(pixels, top, bottom, height):
    """What rays through pixels see of a label on a frustum, by the quadratic equation of its surface."""
    o, d = rays(pixels)
    radius, k = (top + bottom) / 2, (top - bottom) / height
    level = radius + k * o[1]
    a = d[..., 0] ** 2 + d[..., 2] ** 2 - (k * d[..., 1]) ** 2
    b = d[..., 0] * o[0] + d[..., 2] * o[2] - k * d[..., 1] * level
    t = first_hit(a, b, o[0] ** 2 + o[2] ** 2 - level**2)
    x, y, z = np.moveaxis(o + t[..., None] * d, -1, 0)
    return on_canvas(radius * np.arctan2(x, z), y * np.hypot(height, top - bottom) / height)


def traced_ball(pixels, radius, size):
    o, d = rays(pixels)
    t = first_hit((d * d).sum(-1), d @ o, o @ o - radius**2)
    x, y, z = np.moveaxis(o + t[..., None] * d, -1, 0)
    return on_canvas(radius * np.arctan2(x, z), radius * np.arcsin(np.clip(y / radius, -1, 1)), size)


def traced_flat(pixels):
    o, d = rays(pixels)
    x, y, _ = np.moveaxis(o - (o[2] / d[..., 2])[..., None] * d, -1, 0)
    return on_canvas(x, y)


SURFACES = {
    "plane": (Flat(140, 60), traced_flat),
    "cylinder": (Revolved(45, 45, 100), lambda p: traced_cone(p, 45, 45, 100)),
    "cone": (Revolved(50, 35, 80), lambda p: traced_cone(p, 50, 35, 80)),
    "sphere": (Ball(60), lambda p: traced_ball(p, 60, SIZE)),
}


@pytest.mark.parametrize("name", SURFACES)
def test_every_pixel_shows_the_point_hit_by_its_ray(name):
    surface, traced = SURFACES[name]
    view = Projected(surface, Camera.around(TURN, PITCH, DISTANCE), SIZE)
    fit = solve(FlatView(BOX), view)
    assert fit.certificate.certified and fit.status.ok and not fit.notes
    x, y = np.meshgrid(np.linspace(-75, 75, 91), np.linspace(-65, 65, 79))
    pixels = x + 1j * y
    expected, actual = traced(pixels), fit.inverse(pixels)
    hit = np.isfinite(expected) & np.isfinite(actual)
    # a pixel on the border may be seen by one and not by the other
    assert hit.sum() > 1000 and (np.isfinite(expected) ^ np.isfinite(actual)).sum() < 0.03 * hit.sum()
    # where the surface is seen edge-on, a point of the picture is a long strip of the sheet
    assert np.quantile(np.abs(expected - actual)[hit], 0.98) < 3e-4 * abs(BOX[1] - BOX[0])
    assert np.nanmax(np.abs(fit.map(expected[hit]) - pixels[hit])) < 6e-4 * 120


@pytest.mark.parametrize(("turn", "pitch"), some_fast([(160, -35), (20, 0), (160, 23.5), (40, 90)], 1))
def test_a_globe_is_covered_whole_with_its_poles_and_where_its_ends_meet(turn, pitch):
    view = Projected(Ball(60), Camera.around(turn, pitch, 300))
    fit = solve(FlatView((0j, 360 + 180j)), view)
    disc = np.pi * (60 / np.sqrt(1 - 0.2**2)) ** 2  # of the cone of tangents, in the plane of the centre
    assert fit.certificate.certified
    assert fit.target.area == pytest.approx(disc, rel=2e-3)


def test_the_larger_part_is_shown_where_both_ends_of_a_label_are_visible():
    view = Projected(Revolved(45, 45, 100), Camera.around(170, 10, 400))
    fit = solve(FlatView((0j, 250 + 100j)), view)
    assert any("both ends" in note for note in fit.notes) and fit.certificate.certified


def test_a_cone_seen_from_above_is_visible_all_around():
    view = Projected(Revolved(5, 60, 20), Camera.around(30, 80, 400))
    fit = solve(FlatView((0j, 300 + 40j)), view)
    assert fit.certificate.certified and not fit.notes
    assert fit.target.contains(np.array([20 - 20j, -20 + 20j, 20 + 20j])).all()


@pytest.mark.parametrize(
    "view",
    [
        Projected(Ball(60), Camera.around(0, 0, 50)),
        Projected(Flat(30, 40), Camera.around(100, 0, 400)),
        Projected(Revolved(45, 45, 100), Camera.around(0, 90, 400)),
    ],
)
def test_unusable_views_are_refused(view):
    with pytest.raises(InputError):
        solve(FlatView(BOX), view)


def test_a_homography_is_that_of_scikit_image():
    transform = pytest.importorskip("skimage.transform")
    corners = np.array([155 - 15j, 360 - 95j, 260 - 130j, 65 - 40j])
    view = planar(corners, (-172j, 448 + 0j)).view
    fit = solve(view, FlatView((0j, 300 + 50j)))
    flat = np.array([[0, 50], [300, 50], [300, 0], [0, 0]])
    reference = transform.ProjectiveTransform.from_estimate(flat, np.c_[corners.real, corners.imag])
    x, y = np.meshgrid(np.linspace(1, 299, 60), np.linspace(1, 49, 20))
    expected = reference(np.c_[x.ravel(), y.ravel()])
    preimages = fit.inverse(x.ravel() + 1j * y.ravel())
    assert np.abs(preimages - (expected[:, 0] + 1j * expected[:, 1])).max() < 0.05  # pixels of 448


def photographed(surface, half_angle, focal, turn, pitch):
    """A label around an object as a camera off the axis sees it: six points of its edges, and its map."""
    camera = Camera.around(turn, pitch, 350)
    moved = camera.centre + camera.rotation.T @ np.array([30.0, -20.0, 0])
    camera = Camera(camera.rotation, moved, focal, 2000 - 1500j)
    angles = np.array([-1, 0.1, 1, 1, -0.15, -1]) * half_angle
    heights = np.array([1, 1, 1, -1, -1, -1]) * surface.size[1] / 2
    return camera.image(surface.place(surface.radius * angles + 1j * heights)), camera


@pytest.mark.parametrize(("top", "pitch"), [(41, 20), (41, -15), (50, 25)])
def test_a_label_is_found_from_six_points_on_a_photograph(top, pitch):
    surface, half = Revolved(top, 41, 95), 0.95
    points, camera = photographed(surface, half, 3400.0, 8, pitch)
    marks = points + np.random.default_rng(3).normal(size=(6, 2)) @ [1.5, 1.5j]
    estimate = revolved(2 * top, 82, 95, marks, (-3000j, 4000 + 0j))
    width = estimate.view.label[0]
    assert width == pytest.approx(2 * half * surface.radius, rel=0.02) and estimate.error < 8
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9))
    true = camera.image(surface.place(u * 2 * half * surface.radius + 1j * v * surface.size[1]))
    away = np.abs(estimate.view.image(u * width + 1j * v * estimate.view.label[1]) - true)
    assert away.max() < 15  # pixels of 4000, for marks that are 2 off


@pytest.mark.parametrize("order", [[5, 4, 3, 2, 1, 0], [2, 1, 0, 5, 4, 3]])
def test_points_of_a_label_in_mirrored_order_are_refused(order):
    points, _ = photographed(Revolved(30, 41, 95), 0.3, 3400.0, 8, 15)
    with pytest.raises(InputError, match=r"^name the points"):  # a view fits them within 6 pixels
        revolved(60, 82, 95, points[order], (-3000j, 4000 + 0j))


def test_proportions_of_a_sheet_follow_from_its_perspective():
    camera = Camera.around(35, 25, 700)
    camera = Camera(camera.rotation, camera.centre, 3000.0, 2000 - 1500j)
    corners = camera.image(
        Flat(210, 297).place(np.array([-105 + 148.5j, 105 + 148.5j, 105 - 148.5j, -105 - 148.5j]))
    )
    width, height = planar(corners, (-3000j, 4000 + 0j)).view.label
    assert width / height == pytest.approx(210 / 297, rel=1e-6)
    straight = planar(np.array([0, 40, 40 - 30j, -30j]), (-300j, 400 + 0j)).view.label
    assert straight == pytest.approx((40, 30))


@pytest.mark.parametrize("order", [[1, 0, 2, 3], [3, 2, 1, 0], [0, 0, 1, 2]])
def test_corners_in_another_order_are_refused(order):
    corners = np.array([155 - 15j, 360 - 95j, 260 - 130j, 65 - 40j])
    with pytest.raises(InputError, match="top left"):
        planar(corners[order], (-172j, 448 + 0j))


def test_points_that_are_not_of_such_a_label_are_refused():
    with pytest.raises(InputError, match="left to right"):
        revolved(
            82, 82, 95, [10 - 10j, 60 - 90j, 110 - 10j, 110 - 100j, 60 - 20j, 10 - 100j], (-300j, 400 + 0j)
        )

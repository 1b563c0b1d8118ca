"""Features of a picture that a map bends are found, and only these."""

import numpy as np
import pytest

from iccm.curve import Curve
from iccm.drawings.detail import Detail
from iccm.io.edit.bent import MOST_BEND, bent_places
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.run.job import make
from iccm.maps.triangulated.map import TriangulatedMap

SQUARE = Curve(np.array([0, 10, 10 + 10j, 10j]))
MOUTH = 6.5 + 3j  # off the square's centre
EYE = 3 + 7j


def face():
    """Return the edges of a smiling mouth and of an eye, and of a wavy line that reaches across the square."""
    along = np.linspace(-1, 1, 60)
    mouth = np.concatenate([MOUTH + along * 0.9 + 1j * (0.6 * along**2 + lip) for lip in (-0.1, 0.1)])
    around = np.concatenate([size * np.exp(2j * np.pi * np.arange(40) / 40) for size in (0.6, 0.4)])
    points = np.concatenate(
        [mouth, EYE + around, np.linspace(1, 9, 200) + 5j + 0.2j * np.sin(np.linspace(0, 20, 200))]
    )
    weights = np.full(points.size, 1 / points.size)
    return Detail(points, np.ones(points.size, complex), weights, (0j, 10 + 10j), is_full=True)


def mapped(function):
    """Return a map on a fine grid of the square."""
    side = np.linspace(0, 10, 61)
    z = (side + 1j * side[:, None]).ravel()
    first = (np.arange(60) + 61 * np.arange(60)[:, None]).ravel()
    faces = np.concatenate(
        [np.stack([first, first + 1, first + 62], 1), np.stack([first, first + 62, first + 61], 1)]
    )
    rim = np.concatenate(
        [np.arange(60), 60 + 61 * np.arange(60), 3720 - np.arange(60), 3660 - 61 * np.arange(60)]
    )
    return TriangulatedMap(z, function(z), faces, (rim,))


def frown(z):
    """Move points near the mouth so that its smile is turned over."""
    away = z - MOUTH
    near = np.exp(-((np.abs(away) / 1.6) ** 4))
    return z - 1.2j * near * away.real**2


def test_a_similarity_and_an_even_stretch_bend_nothing():
    for function in (lambda z: (2 + 1j) * z + 3, lambda z: 1.3 * z.real + 1j * z.imag):
        assert bent_places([mapped(function)], face(), SQUARE) == []


def test_a_smile_that_is_turned_over_is_found_where_it_is():
    map = mapped(frown)
    places = bent_places([map], face(), SQUARE)
    assert len(places) == 1 and abs(places[0].point - MOUTH) < 0.8 and places[0].bend > MOST_BEND
    assert abs(map(np.array([places[0].point]))[0] - places[0].image) < 1e-9


def twisted(degrees):
    """Rotate the eye within the picture, rigidly but for a ring around it."""
    return lambda z: (
        EYE + (z - EYE) * np.exp(1j * np.radians(degrees) * np.exp(-((np.abs(z - EYE) / 1.3) ** 6)))
    )


def test_an_eye_that_is_twisted_in_its_face_is_found_where_it_is():
    places = bent_places([mapped(twisted(35))], face(), SQUARE)
    assert len(places) == 1 and abs(places[0].point - EYE) < 0.8
    assert bent_places([mapped(twisted(10))], face(), SQUARE) == []


def test_what_only_follows_the_outline_is_not_bent():
    bulge = mapped(lambda z: z + 0.3 * np.exp(-z.real / 0.3) * (z.imag - 5))
    assert bent_places([bulge], face(), SQUARE) == []


@pytest.mark.parametrize("texture", ["checker", None])
def test_a_checkerboard_has_no_features(shapes, texture):
    edited = Session(make({"source": "square.svg", "target": "blob.svg", "texture": texture}))
    update = edited.solve(Scene())
    assert update.ok and edited.view.detail is None and update.bent == []

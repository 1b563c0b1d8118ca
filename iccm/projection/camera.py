"""Pinhole cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Complex, Real


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera with square pixels. It looks along its negative z axis.

    Attributes:
        rotation: (3, 3) from space to the axes of the camera: to the right, upwards, and backwards.
        centre: (3,) its place in space.
        focal: distance of the image plane, in units of the picture.
        principal: the point of the picture, y up, that it looks at.
    """

    rotation: Real
    centre: Real
    focal: float
    principal: complex = 0

    @classmethod
    def around(cls, turn: float, pitch: float, distance: float) -> Camera:
        """Return a camera that looks at an object in the origin.

        Pictures are in units of the object: at the origin's distance, they have true size.

        Args:
            turn: degrees by which the object is turned about its vertical axis; its front moves to the right.
            pitch: degrees by which the camera looks down.
            distance: of the camera from the origin.
        """
        cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        yaw = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
        cosine, sine = np.cos(np.radians(pitch)), np.sin(np.radians(pitch))
        pitched = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
        rotation = pitched @ yaw
        return cls(rotation, rotation.T @ np.array([0, 0, distance]), distance)

    def depth(self, points: Real) -> Real:
        """Return (…) the distances of points (…, 3) in front of the camera; negative behind it."""
        depths: Real = -((points - self.centre) @ self.rotation.T)[..., 2]
        return depths

    def image(self, points: Real) -> Complex:
        """Return (…) the images of points (…, 3); those of points behind the camera are meaningless."""
        in_camera = (points - self.centre) @ self.rotation.T
        image = (
            self.principal + self.focal * (in_camera[..., 0] + 1j * in_camera[..., 1]) / -in_camera[..., 2]
        )
        return np.asarray(image, np.complex128)

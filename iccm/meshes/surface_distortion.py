"""How a map between layouts distorts the surfaces that they stand for."""

from dataclasses import replace

import numpy as np

from ..arrays import Complex, Flags
from ..maps.distortion import Distortion
from .flatten import Flattening
from .locate import Locator
from .stretch import Linear, laid_flat, linear

NEAR = 1e-3  # as far as outlines may be apart, the default tolerance


def on_surfaces(flat: Distortion, layouts: tuple[Flattening | None, Flattening | None]) -> Distortion:
    """The distortion between surfaces, from samples of the map between their planes.

    Args:
        flat: in the planes, with the samples' places.
        layouts: of source and target; None for one that is a plane. Samples in their holes are left out.
    """
    on = np.ones(flat.z.size, bool)
    for layout, w in zip(layouts, (flat.z, flat.w)):
        if layout is not None:
            on &= _on_surface(layout, w)
    flat = replace(
        flat, area=flat.area[on], f_z=flat.f_z[on], f_zbar=flat.f_zbar[on], z=flat.z[on], w=flat.w[on]
    )
    jacobian, area = Linear(flat.f_z, flat.f_zbar), flat.area
    before = area / np.maximum(np.abs(jacobian.determinant), 1e-300)
    here, there = (
        None if each is None else _to_surface(each, w) for each, w in zip(layouts, (flat.z, flat.w))
    )
    if here is not None:
        jacobian, before = jacobian @ here.inverse(), before * here.determinant
    if there is not None:
        jacobian, area = there @ jacobian, area * there.determinant
    painted = np.abs(flat.f_z) + np.abs(flat.f_zbar) > 0
    scale = float(np.sqrt(area[painted].sum() / before[painted].sum()))
    return replace(flat, area=area, f_z=jacobian.a, f_zbar=jacobian.b, scale=scale)


def _on_surface(layout: Flattening, z: Complex) -> Flags:
    """(p,) which points are on the surface, and not in its holes, but for NEAR of its diagonal."""
    face, place = Locator(layout)(z, 1)
    found = np.einsum("pk,pk->p", place, layout.flat[layout.patch.faces[face]])
    return np.abs(found - z) <= NEAR * np.hypot(np.ptp(layout.flat.real), np.ptp(layout.flat.imag))


def _to_surface(layout: Flattening, z: Complex) -> Linear:
    """From the plane to the surface at points z (p,)."""
    faces = layout.patch.faces
    maps = linear(layout.flat[faces], laid_flat(layout.patch.points[faces]))
    triangle = Locator(layout)(z, 1)[0]
    return Linear(maps.a[triangle], maps.b[triangle])

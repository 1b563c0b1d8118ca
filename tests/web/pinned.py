"""The energy of maps with soft pins, of which demo and command choose radii and tolerances."""

from iccm.balanced.constraints.soft import patches_of
from iccm.balanced.constraints.validate import check
from iccm.balanced.model.energy import Energy
from iccm.balanced.model.unit_coordinates import unit_similarities
from iccm.pins import Softness

NO_HOLES = ((), ())


def pinned_energy(fit, z, u, faces, balance=1.0):
    """Compute the energy of a map z -> u with the pins of a fit."""
    given = check(fit.source, fit.target, fit.pins)
    softness = Softness.free(len(fit.pins))
    patches = patches_of(fit.source, fit.target, NO_HOLES, fit.pins, softness, given)
    frames = unit_similarities(fit.source, fit.target, 0.0, NO_HOLES)
    energy = Energy(balance=balance, pins=patches.unit(frames))
    return energy.between(frames[0](z), frames[1](u), faces)

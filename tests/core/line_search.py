"""The core's line search of Newton's method as a function, so that tests can pass any energy."""

from collections.abc import Callable

import numpy as np

from iccm.native import callback, function, record

ShareCallback = callback("double ShareCallback(double share)")
SearchedEnergyRecord = record("struct SearchedEnergy { ShareCallback energy_at; ShareCallback most; }")
_line_search = function(
    "double iccm_minimise_line_search(const SearchedEnergy *searched, double share, double *energy)"
)


def line_search(
    share: float, energy_at: Callable[[float], float], most: Callable[[float], float]
) -> tuple[float, float]:
    """Return the share of a step that the search accepts, 0 if it accepts none, and the energy there.

    Args:
        share: first share to try.
        energy_at: the energy after a share of the step, infinite if that is not allowed; its last call is that for
            the share that is returned. Neither function may raise.
        most: the largest energy accepted at a share.
    """
    energy = np.zeros(1)
    searched = SearchedEnergyRecord(ShareCallback(energy_at), ShareCallback(most))
    return float(_line_search(searched, share, energy)), float(energy[0])

"""The cost by which maps of a pair of drawings are compared, whatever their frames and their fit.

    cost = ((1 - lost) · E + lost · LOST_POINT_ENERGY) · turning

E is the mean balanced energy over the visible area: the part of the source's painted area whose image lies in the
target's painted area. `lost` is half the share of the source that is hidden, because it lands in gaps of the target or
is not mapped at all, plus half the share of the target that stays bare, because a gap that the texture does not cover
lands there, or nothing at all. `turning` is the cost of rotating the picture (`balanced.minimise.upright`).
"""

LOST_POINT_ENERGY = 5.05
"""Energy counted for a point without a partner: that of a map that stretches lengths ten times in one direction,
(10 + 1/10)/2. Pictures with K95 of 8 were judged usable, with 24 useless."""


def price(energy: float, lost_shares: tuple[float, float], turning: float) -> float:
    """Return the cost of a map.

    Parameters
    ----------
    energy
        Mean energy over the visible area, at least 1; it may be infinite where nothing is visible.
    lost_shares
        Share of the source that is hidden, and of the target that stays bare.
    turning
        The cost of rotating the picture, a factor of at least 1.
    """
    share = min(1.0, 0.5 * sum(lost_shares))
    visible_part = (1 - share) * energy if share < 1 else 0.0
    return float((visible_part + share * LOST_POINT_ENERGY) * turning)

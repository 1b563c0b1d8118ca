"""`--method paper`: Segall, Ben-Chen, *Iterative Closest Conformal Maps between Planar Domains*, SGP 2016.

| paper | where |
|---|---|
| §2.1, Appendix A: C_j(z), D_j(z), D2_j(z) | `maps.cauchy_green.coordinates`, `.derivatives`, `.second_derivatives` |
| §2.2: initial map by arclength | `initial.arclength` |
| Algorithm 1: local and global step | `algorithm1.iterate` |
| §3.1: β E_p, pins; start from them | `energies.points`; `initial.from_constraints` |
| §3.2, Eq. 8: f = C φ + conj(C) ψ | `maps.harmonic.HarmonicMap`, `energies.Basis` |
| Eq. 9: dilatation K; E_q | `maps.distortion.dilatation`; `energies.quasiconformal` |
| §3.3: γ strokes; α E_s; deformation | `energies.stroke`; `energies.smoothness`; `algorithm1.deform` |
| §3.4, Eq. 13: first-order distance | `least_squares.LeastSquares._first_order` |
| §4.1: consistency energy μ | `energies.consistency` |
| §4.1: one least squares system | `least_squares.LeastSquares`, `algorithm1.assemble` |

normalised     problems in coordinates in which both shapes have radius one
algorithm1     local and global steps until the energy converges; deformation
initial        initial maps
energies       the energies, each a matrix, a weight and a target
least_squares  one weighted system of all energies
"""

from .algorithm1 import assemble, deform, discretise, finish, iterate, solve
from .energies import Basis
from .initial import constraint_points
from .least_squares import LeastSquares
from .normalised import NormalisedProblem

__all__ = ["deform", "solve"]
# The conformal method continues with the paper's iteration from another start.
__all__ += [
    "Basis",
    "LeastSquares",
    "NormalisedProblem",
    "assemble",
    "constraint_points",
    "discretise",
    "finish",
    "iterate",
]

"""One weighted least squares system of all terms (paper §4.1): factorized once, solved for many targets."""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from ..arrays import Complex
from .energies import EnergyTerm, Target

RANK_CUT_SHARE = 1e-10  # relative to the largest singular value: smaller ones come from rounding


class LeastSquares:
    """The problem min_x Σ_terms E(x) for changing targets and fixed matrices.

    Terms whose target has normals N get the first-order distance of Eq. 13, ν |Re(conj(N)(M x - w))|² + λ |M x - w|².
    The paper uses ν = 1. With ν = 1 - λ, it has the value and gradient of |M x - w|² where M x - w is parallel to N, as
    at closest points, so that the balance with other terms is kept. With the singular value decomposition of the
    zeroth-order part, x = V S⁻¹ y, the remaining Gram matrix is I plus a positive semidefinite one, so that its
    Cholesky factorization is stable where that of C*C would not be.
    """

    def __init__(self, terms: Sequence[EnergyTerm], tangential: float = 1.0, normal: float | None = None):
        """Factorize the terms; `tangential` is λ, 1 for the zeroth order; `normal` is ν, by default 1 - λ."""
        self.terms = list(terms)
        self.tangential = tangential
        self.normal = 1 - tangential if normal is None else normal
        self.scales = [t.scale * (np.sqrt(tangential) if t.tangent else 1.0) for t in self.terms]
        stacked = np.vstack([s[:, None] * t.matrix for s, t in zip(self.scales, self.terms)])
        u, s, vh = scipy.linalg.svd(stacked, full_matrices=False, check_finite=False, lapack_driver="gesdd")
        rank = int(np.count_nonzero(s > RANK_CUT_SHARE * s[0]))
        self.left = np.split(u[:, :rank], np.cumsum([t.measure.size for t in self.terms])[:-1])
        self.back = vh[:rank].conj().T / s[:rank]

    def targets(self, x: Complex) -> list[Target]:
        """Return the local step: the target of each term for the image of x."""
        return [t.follow(t.matrix @ x) for t in self.terms]

    def energies(self, x: Complex, targets: Sequence[Target]) -> dict[str, float]:
        """Return the energy of each name for given targets, and their `total`."""
        out: dict[str, float] = {}
        for term, target in zip(self.terms, targets):
            out[term.name] = out.get(term.name, 0.0) + term.energy(x, target)
        out["total"] = sum(out.values())
        return out

    def solve(self, targets: Sequence[Target], x: Complex | None = None) -> Complex:
        """Return the global step: coefficients of least energy for given targets; if not unique, those closest to x."""
        if x is not None:
            remaining = [Target(t.points - m.matrix @ x, t.normals) for m, t in zip(self.terms, targets)]
            return x + self.solve(remaining)
        y = np.sum([u.conj().T @ (s * t.points) for u, s, t in zip(self.left, self.scales, targets)], axis=0)
        if any(t.normals is not None for t in targets):
            y = self._first_order(y, targets)
        return self.back @ y

    def _first_order(self, y: Complex, targets: Sequence[Target]) -> Complex:
        """Add |Re(conj(N)(M x - w))|² to the whitened zeroth-order system.

        It is only real-linear, and has 2k real unknowns.
        """
        rows, right = [], []
        for term, u, target in zip(self.terms, self.left, targets):
            if target.normals is None:
                continue
            rotated = (target.normals.conj() * np.sqrt(self.normal / self.tangential))[:, None] * u
            rows.append(np.hstack([rotated.real, -rotated.imag]))
            right.append((target.normals.conj() * target.points).real * term.scale * np.sqrt(self.normal))
        b = np.vstack(rows)
        gram = b.T @ b
        gram[np.diag_indices_from(gram)] += 1.0
        load = np.concatenate([y.real, y.imag]) + b.T @ np.concatenate(right)
        v = scipy.linalg.cho_solve(scipy.linalg.cho_factor(gram, overwrite_a=True, check_finite=False), load)
        return v[: y.size] + 1j * v[y.size :]

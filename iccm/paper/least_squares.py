"""One weighted least squares system of all terms (paper §4.1): factored once, solved for many targets."""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from ..arrays import Complex
from .energies import Target, Term

RANK_CUT_SHARE = 1e-10  # singular values below this share of the largest carry rounding only


class System:
    """min_x Σ_terms E(x) for targets that change and matrices that do not.

    Terms whose target has normals N get the first-order distance of Eq. 13, ν |Re(conj(N)(M x - w))|² + λ |M x - w|².
    In the paper ν is 1. With ν = 1 - λ it has the value and the gradient of |M x - w|² where M x - w lies along N, as
    it does at closest points, so that the balance with the other terms stays what it is. The singular value
    decomposition of everything of zeroth order, x = V S⁻¹ y, makes the remaining Gram matrix I plus a positive one, so
    that its Cholesky factorisation is safe where that of C*C would not be.
    """

    def __init__(self, terms: Sequence[Term], tangential: float = 1.0, normal: float | None = None):
        """Factor the terms; `tangential` is λ, 1 for the zeroth order, `normal` ν, by default 1 - λ."""
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
        """Return the local step: where each term pulls the image of x."""
        return [t.follow(t.matrix @ x) for t in self.terms]

    def energies(self, x: Complex, targets: Sequence[Target]) -> dict[str, float]:
        """Energy of each name at given targets, and their `total`."""
        out: dict[str, float] = {}
        for term, target in zip(self.terms, targets):
            out[term.name] = out.get(term.name, 0.0) + term.energy(x, target)
        out["total"] = sum(out.values())
        return out

    def solve(self, targets: Sequence[Target], x: Complex | None = None) -> Complex:
        """Return the global step: coefficients of least energy for given targets, those closest to x where several are
        as good.
        """
        if x is not None:
            rest = [Target(t.points - m.matrix @ x, t.normals) for m, t in zip(self.terms, targets)]
            return x + self.solve(rest)
        y = np.sum([u.conj().T @ (s * t.points) for u, s, t in zip(self.left, self.scales, targets)], axis=0)
        if any(t.normals is not None for t in targets):
            y = self._first_order(y, targets)
        return self.back @ y

    def _first_order(self, y: Complex, targets: Sequence[Target]) -> Complex:
        """Add |Re(conj(N)(M x - w))|² to the whitened zeroth-order system, which is real-linear only: 2k real
        unknowns."""
        rows, right = [], []
        for term, u, target in zip(self.terms, self.left, targets):
            if target.normals is None:
                continue
            turned = (target.normals.conj() * np.sqrt(self.normal / self.tangential))[:, None] * u
            rows.append(np.hstack([turned.real, -turned.imag]))
            right.append((target.normals.conj() * target.points).real * term.scale * np.sqrt(self.normal))
        b = np.vstack(rows)
        gram = b.T @ b
        gram[np.diag_indices_from(gram)] += 1.0
        load = np.concatenate([y.real, y.imag]) + b.T @ np.concatenate(right)
        v = scipy.linalg.cho_solve(scipy.linalg.cho_factor(gram, overwrite_a=True, check_finite=False), load)
        return v[: y.size] + 1j * v[y.size :]

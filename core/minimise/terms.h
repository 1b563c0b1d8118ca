// Additional terms of the energy, which the caller computes.
#pragma once

#include "iccm/core.h"

namespace iccm {

// Returns the sum of the terms for images u (n,).
typedef double (*TotalCallback)(const Complex *u);
// The same; adds the terms' gradient (n,), x + iy, and the blocks (e, 4) of the upper triangle of their Hessian, which
// must be positive semidefinite.
typedef double (*DerivativesCallback)(const Complex *u, double *matrix, Complex *gradient);

// The callbacks, null if there are no terms (iccm/balanced/minimise/terms.py).
struct Terms {
    TotalCallback total;
    DerivativesCallback derivatives;
};

}  // namespace iccm

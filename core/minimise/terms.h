// Further terms of the energy, which the caller computes.
#pragma once

#include "iccm/core.h"

namespace iccm {

// The sum of the terms for images u (n,).
typedef double (*TotalCallback)(const Complex *u);
// The same; adds the terms' gradient (n,), x + iy, and blocks (e, 4) of their Hessian's upper triangle, which is positive
// semidefinite.
typedef double (*DerivativesCallback)(const Complex *u, double *matrix, Complex *gradient);

// Null where there are none (iccm/balanced/minimise/terms.py).
struct Terms {
    TotalCallback total;
    DerivativesCallback derivatives;
};

}  // namespace iccm

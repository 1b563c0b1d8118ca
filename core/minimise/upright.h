// The cost of rotating the picture: a factor on the energy.
#pragma once

#include "iccm/core.h"

namespace iccm {

// The cost of a rotation (iccm/balanced/minimise/upright.py).
struct Upright {
    const Complex *moments;  // (n,) κ of the vertices, S = Σ κ u
    double weight;           // w of the cost; 0 where any rotation is as good
};

// What the energy of images u (n,) is multiplied by; infinite where they have no rotation.
double rotation_factor(const Upright &upright, const Complex *u, double q, Index n);

// Derivatives of the factor's logarithm by the angle; the second one where it is positive, else 0.
struct RotationSlopes {
    double first, second;
};

// The same; fills in the angle's gradient (n,), x + iy of each vertex.
RotationSlopes rotation_derivatives(const Upright &upright, const Complex *u, double q, Complex *turning, Index n);

// The step -H⁻¹ g (n,) made the one for H + c t tᵀ (Sherman and Morrison, Adjustment of an Inverse Matrix Corresponding to
// a Change in One Element of a Given Matrix, Annals of Mathematical Statistics 21, 1950).
//
//   turning    (n,) t
//   answer     (n,) -H⁻¹ t
//   curvature  c
//   step       (n,) changed
void sherman_morrison(const Complex *turning, const Complex *answer, double curvature, Complex *step, Index n);

}  // namespace iccm

// The cost of rotating the picture: a factor on the energy.
#pragma once

#include "iccm/core.h"

namespace iccm {

// The cost of a rotation (iccm/balanced/minimise/upright.py).
struct Upright {
    const Complex *moments;  // (n,) κ of the vertices in S = Σ κ u
    double weight;           // w of the cost; 0 if all rotations are equally good
};

// The factor of the energy of images u (n,); infinite if they have no rotation.
double rotation_factor(const Upright &upright, const Complex *u, double q, Index n);

// Derivatives of the factor's logarithm with respect to the angle; the second one is 0 where it would be negative.
struct RotationSlopes {
    double first, second;
};

// Returns these derivatives, and fills in the angle's gradient (n,), x + iy for each vertex.
RotationSlopes rotation_derivatives(const Upright &upright, const Complex *u, double q, Complex *turning, Index n);

// Changes the step -H⁻¹ g (n,) to that for H + c t tᵀ (Sherman and Morrison, Adjustment of an Inverse Matrix
// Corresponding to a Change in One Element of a Given Matrix, Annals of Mathematical Statistics 21, 1950).
//
//   turning    (n,) t
//   answer     (n,) -H⁻¹ t
//   curvature  c
//   step       (n,) changed
void sherman_morrison(const Complex *turning, const Complex *answer, double curvature, Complex *step, Index n);

}  // namespace iccm

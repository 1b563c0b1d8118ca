// The energy of a balanced map and its derivatives, triangle by triangle.
#pragma once

#include "iccm/density.h"

namespace iccm {

// An objective of Newton's method (iccm/balanced/minimise/energy.py).
struct Objective {
    double theta;    // weight of the area part
    double q;        // power of the density; large values lower the worst distortion
    double share;    // share of the image's area in the measure
    double epsilon;  // 0: a barrier against folds; else how far the smoothed determinant extends below zero
    bool forward;    // whether the images move, rather than the source's vertices
};

// Triangles in the rest shape, with which their images are compared.
struct RestShapes {
    const int64_t *corners;    // (m, 3) vertices, in the order of elimination if there are slots
    const int64_t *slots;      // (m, 6) the Hessian's blocks for the pairs 00, 01, 02, 11, 12, 22 of corners
    const Complex *gradients;  // (m, 3) Wirtinger gradients of the hat functions
    const double *weights;     // (m,) areas times weights; negative for virtual triangles, where only image area counts
    const Complex *aims;       // (m,) derivatives that rigid regions should have, 0 elsewhere; ignored if not aimed
    int64_t m;
    bool aimed;  // whether there are rigid regions
};

// The energy of the images u; infinite if a triangle is folded, unless epsilon > 0.
double total(const RestShapes &rest, const Complex *u, const Objective &objective);

// The energy at u; fills in its gradient (n,), x + iy, and its projected Hessian, blocks (e, 4) of the upper triangle.
double assemble(const RestShapes &rest, const Complex *u, const Objective &objective, double *matrix, Complex *gradient,
                Index n, Index e);

}  // namespace iccm

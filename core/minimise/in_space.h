// The energy of a map onto a surface in space, as a function of its vertices' places in the surface's layout.
#pragma once

#include "iccm/locate.h"
#include "minimise/energy.h"

namespace iccm {

// A surface in space and its layout, beside which it goes on linearly (iccm/balanced/minimise/in_space.py).
struct Ground {
    Places places;         // what finds the layout's triangle at a place
    const double *points;  // (p, 3) vertices in space
    const double *slopes;  // (k, 3, 2) derivatives of points in space by the place in the layout, for each triangle
};

// What the energy on a surface needs beside the triangles at rest, and arrays that it writes. The triangles at rest share
// no corners: t has 3t, 3t + 1 and 3t + 2, and six blocks of its own.
struct SurfaceMap {
    Ground ground;
    RestShapes layout;   // the triangles at rest for the energy in the layout, corners and slots being the mesh's
    Objective barrier;   // what is minimised of that
    const bool *open;    // (m,) triangles in holes of the source, whose images are those in the layout
    const double *turns; // (m,) 1 for corners that run counter-clockwise, else -1
    int64_t *on;         // (n,) the surface's triangle that each vertex is in
    double *points;      // (n, 3) vertices in space
    Complex *laid;       // (3m,) images of triangles laid flat
    double *axes;        // (m, 2, 3) directions in space that become x and y then
    Complex *slopes;     // (3m,) gradients at laid corners
    double *blocks;      // (6m, 4) of the Hessian
    int64_t n;
};

// The energy of images u (n,), without the curves'; infinite where a triangle is folded in the layout.
double total_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective);

// The same; fills in the gradient and the projected Hessian, second derivatives of the surface left out, so that it
// stays positive.
double assemble_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective,
                         double *matrix, Complex *gradient, Index n, Index e);

}  // namespace iccm

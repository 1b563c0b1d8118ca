// The energy of a map onto a surface in space, as a function of its vertices' positions in the surface's layout.
#pragma once

#include "iccm/locate.h"
#include "minimise/energy.h"

namespace iccm {

// A surface in space and its layout, beyond which it is extended linearly (iccm/balanced/minimise/in_space.py).
struct Ground {
    Places places;         // locates points in the layout's triangles
    const double *points;  // (p, 3) vertices in space
    const double *slopes;  // (k, 3, 2) slope of each triangle: d(point in space) / d(position in the layout)
};

// The inputs of the energy on a surface besides the rest triangles, and its work arrays. Here the rest triangles share
// no corners: t has corners 3t, 3t + 1 and 3t + 2, and its own six blocks.
struct SurfaceMap {
    Ground ground;
    RestShapes layout;   // the rest triangles for the energy in the layout, with the mesh's corners and slots
    Objective barrier;   // the objective for that energy
    const bool *open;    // (m,) triangles in holes of the source, whose images are those in the layout
    const double *orientations; // (m,) 1 for corners that run counter-clockwise, else -1
    int64_t *on;         // (n,) the surface's triangle that contains each vertex
    double *points;      // (n, 3) vertices in space
    Complex *laid;       // (3m,) flattened images of triangles
    double *axes;        // (m, 2, 3) directions in space that become their x and y axes
    Complex *slopes;     // (3m,) gradients at flattened corners
    double *blocks;      // (6m, 4) blocks of the Hessian
    int64_t n;
};

// The energy of images u (n,), without that of the curves; infinite if a triangle is folded in the layout.
double total_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective);

// The same; fills in the gradient and the projected Hessian, which omits second derivatives of the surface in order to
// stay positive.
double assemble_in_space(const RestShapes &rest, SurfaceMap &surface, const Complex *u, const Objective &objective,
                         double *matrix, Complex *gradient, Index n, Index e);

}  // namespace iccm

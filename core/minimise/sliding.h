// Vertices that slide along curves: their directions, the curves' energy, and the limits of steps.
#pragma once

#include "linalg/cholesky.h"

namespace iccm {

enum Kind : Index { HELD = 0, SLIDING = 1, FREE = 2 };  // of constrained vertices

// The closed polylines that constrained vertices slide on, one after the other (iccm/balanced/minimise/sliding.py).
struct Rails {
    const double *knots;      // arclengths of the vertices of all rails, from 0 to the length of each
    const Complex *vertices;  // of all rails
    const double *corners;    // arclengths of the corners of all rails, ascending on each, where a step ends
    const int64_t *starts;    // (r + 1, 3) where each rail begins in the three arrays
    const int64_t *own;       // (c,) index of the rail of each constrained vertex
    const double *ends;       // (r,) arclength at which each rail turns back along itself, infinite where it does not
};

// The constrained vertices as chains, whose edges have the energy ½ β Σ (Δτ²/Δs + Δs²/Δτ).
struct Border {
    const int64_t *following;  // (c,) the vertex after each one; itself at the end of a stroke and for a pin
    const double *spans;       // (c,) Δs, arclengths of the edges on the fixed side
    const double *stiffness;   // (c,) β of the edges, 0 where there is none
    const double *laps;        // (c,) jump of the arclength along the edge: a loop's length where it closes, else 0
    int64_t count;             // c
};

// Constraints of the first c vertices of a mesh.
struct Constraints {
    const int64_t *kinds;  // (c,) HELD, SLIDING or FREE
    const Complex *goals;  // (c,) goals of held vertices; ignored elsewhere
    Rails rails;
    Border border;
};

// One closed polyline.
struct Rail {
    const double *knots;
    const Complex *vertices;
    Index size;
    const double *corners;
    Index corner_count;

    double length() const { return knots[size]; }
};

// Work arrays of Newton's steps; (n,) for the vertices, (c,) for the constrained ones.
struct Workspace {
    double *matrix;       // (e, 4) the Hessian
    Factor factor;        // of the Hessian
    Complex *gradient;    // (n,) gradient of the energy
    Complex *step;        // (n,) step towards lower energy
    Complex *way;         // (n,) displacements of held vertices to their goals
    Complex *new_u;       // (n,) trial positions
    Complex *turning;     // (n,) gradient of the rotation
    Complex *answer;      // (n,) the rotation's gradient multiplied by -H⁻¹
    Complex *directions;  // (c,) directions of constrained vertices
    double *new_tau;      // (c,) trial arclengths
    double *slope;        // (c,) of the curves' energy
    double *curvature;    // (c,) of the curves' energy
    double *slide;        // (c,) steps along the curves
    double *low;          // (c,) lower limits of these steps
    double *high;         // (c,) upper limits of these steps
};

// The curves' energy; infinite if two vertices are out of order.
double border_energy(const Border &border, const double *tau);

// Rewrites the derivatives with respect to the positions of all vertices as derivatives with respect to the unknowns:
// positions of free vertices, and arclengths along curves. Returns whether held vertices still have to move to their
// goals.
//
//   u    (n,) positions
//   tau  (c,) arclengths
bool constrain(const BlockPattern &pattern, const Constraints &constraints, const Complex *u, const double *tau,
               Workspace &space);

// Projects the gradient of constrained vertices on their directions; 0 for held vertices.
void project_on_directions(const Constraints &constraints, const Complex *directions, Complex *gradient);

// Rewrites the step of constrained vertices as one in the plane, and fills in their steps along curves; vertices on a
// corner leave it only in their direction.
void release(const Constraints &constraints, Workspace &space);

// The largest share of the step, at most `most`, that keeps the curves' vertices well in order.
double gap_limit(const Border &border, const double *tau, const double *slide, double most);

// Fill in the positions after a share t of the step, new_u and new_tau; a whole step takes held vertices to their
// goals.
void move(const Constraints &constraints, const Complex *u, const double *tau, double t, Workspace &space, Index n);

}  // namespace iccm

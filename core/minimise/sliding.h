// Vertices that slide along a curve: their directions, the curve's own energy, and how far they may go.
#pragma once

#include "linalg/cholesky.h"

namespace iccm {

enum Kind : Index { HELD = 0, SLIDING = 1, FREE = 2 };  // of constrained vertices

// The closed polylines that constrained vertices slide on, one after the other (iccm/balanced/minimise/sliding.py).
struct Rails {
    const double *knots;      // arclengths of the vertices of all rails, each from 0 to its length
    const Complex *vertices;  // of all rails
    const double *corners;    // arclengths of the corners of all rails, ascending on each, where a step ends
    const int64_t *starts;    // (r + 1, 3) where each rail begins in the three
    const int64_t *own;       // (c,) the rail of each constrained vertex
    const double *ends;       // (r,) arclength at which each rail turns back along itself, infinite where it does not
};

// The constrained vertices as chains, with the energy ½ β Σ (Δτ²/Δs + Δs²/Δτ) of their edges.
struct Border {
    const int64_t *following;  // (c,) the next vertex of each one; itself at the end of a stroke and for a pin
    const double *spans;       // (c,) Δs, arclengths of the edges on the side that is kept
    const double *stiffness;   // (c,) β of the edges, 0 where there is none
    const double *laps;        // (c,) what the arclength jumps by along the edge: a loop's length where it closes, else 0
    int64_t count;             // c
};

// What holds the first c vertices of a mesh.
struct Constraints {
    const int64_t *kinds;  // (c,) HELD, SLIDING or FREE
    const Complex *goals;  // (c,) where held vertices are to be; elsewhere of no account
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

// What Newton's steps write; (n,) of the vertices, (c,) of the constrained ones.
struct Workspace {
    double *matrix;       // (e, 4) the Hessian
    Factor factor;        // of it
    Complex *gradient;    // (n,) of the energy
    Complex *step;        // (n,) towards lower energy
    Complex *way;         // (n,) of held vertices to their goals
    Complex *new_u;       // (n,) positions that are tried
    Complex *turning;     // (n,) the gradient of the rotation
    Complex *answer;      // (n,) to it, of the factor
    Complex *directions;  // (c,) of constrained vertices
    double *new_tau;      // (c,) arclengths that are tried
    double *slope;        // (c,) of the curves' energy
    double *curvature;    // (c,) of the curves' energy
    double *slide;        // (c,) steps along the curves
    double *low;          // (c,) the least of them
    double *high;         // (c,) the largest
};

// The curves' energy; infinite where two vertices have changed places.
double border_energy(const Border &border, const double *tau);

// Rewrites the derivatives with respect to all vertices' places as those by what may change: places of free vertices,
// and arclengths along curves. Whether held vertices have a way to go to their goals.
//
//   u    (n,) positions
//   tau  (c,) arclengths
bool constrain(const BlockPattern &pattern, const Constraints &constraints, const Complex *u, const double *tau,
               Workspace &space);

// Rewrites the gradient of constrained vertices along their directions, 0 where they are held.
void project_on_directions(const Constraints &constraints, const Complex *directions, Complex *gradient);

// Rewrites the step of constrained vertices as one in the plane, and fills in their steps along curves; those on a
// corner do not leave it to the wrong side.
void release(const Constraints &constraints, Workspace &space);

// The largest share of the step, at most `most`, that keeps the curves' vertices well in order.
double gap_limit(const Border &border, const double *tau, const double *slide, double most);

// Fills in where a share t of the step leads, new_u and new_tau; a whole step takes held vertices to their goals.
void move(const Constraints &constraints, const Complex *u, const double *tau, double t, Workspace &space, Index n);

}  // namespace iccm

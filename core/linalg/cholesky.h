// Sparse Cholesky factors of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.
#pragma once

#include "iccm/core.h"

namespace iccm {

// Dense blocks of the factor, in the order in which they are eliminated, children before parents (iccm/linalg/fronts.py).
struct Fronts {
    const int64_t *starts;         // (count + 1,) where each begins among the vertices in their order
    const int64_t *beyond_starts;  // (count + 1,) where each begins in `beyond`
    const int64_t *beyond;         // later vertices that each block is coupled to, ascending
    const int64_t *parents;        // (count,) the front to which each adds its update; `count`: none
    const int64_t *panels;         // (count + 1,) where the columns of each begin in the factor
    int64_t count;
};

// The pattern of the matrices of one mesh (iccm/linalg/cholesky.py).
struct BlockPattern {
    const int64_t *order;     // (n,) the vertex of each row
    const int64_t *starts;    // (n + 1,) where each row of the upper triangle begins in `columns`
    const int64_t *columns;   // (e,) its block columns, ascending: the diagonal comes first
    const int64_t *diagonal;  // (n,) the diagonal entry of each vertex
    const int64_t *ahead;     // (b,) the entry that couples each outline vertex to the next one
    int64_t n;
    int64_t e;
    Fronts fronts;
};

// A factor L of a matrix H = L Lᵀ, the vector L⁻¹ g, and work space for computing and applying them.
struct Factor {
    double *values;    // columns of the fronts, then the stack of updates
    int64_t *place;    // (n,) the position of each row in a front
    int64_t *waiting;  // (count,) fronts whose updates are on the stack
    int64_t *sources;  // (count + 1,) where each of these updates begins in `values`
    double *part;      // (2n + 1,) the rows of a front in a solution
    double *left;      // (2n,) what is left of a gradient while it is eliminated
};

// Factorise H, blocks xx, xy, yx, yy of the upper triangle (e, 4), and eliminate the gradient g (n,) with it; false
// if H is not positive definite.
bool factorise(const BlockPattern &pattern, const double *matrix, const Complex *gradient, Factor &factor);

// Replaces L⁻¹ g by that of another gradient g (n,).
void forward_substitute(const BlockPattern &pattern, const Complex *gradient, Factor &factor);

// Fill in the step -H⁻¹ g (n,) for the factor of H and g: the x with Lᵀ x + L⁻¹ g = 0.
void back_substitute(const BlockPattern &pattern, Factor &factor, Complex *step);

}  // namespace iccm

// Sparse Cholesky factors of symmetric matrices with a 2 × 2 block for every vertex and every edge of a mesh.
#pragma once

#include "iccm/core.h"

namespace iccm {

// Dense blocks of the factor, in the order in which they are eliminated, children before parents (iccm/linalg/fronts.py).
struct Fronts {
    const int64_t *starts;         // (count + 1,) where each begins among the vertices in their order
    const int64_t *beyond_starts;  // (count + 1,) where each begins in `beyond`
    const int64_t *beyond;         // later vertices that each is coupled to, ascending
    const int64_t *parents;        // (count,) the front that each adds to; `count`: none
    const int64_t *panels;         // (count + 1,) where the columns of each begin in the factor
    int64_t count;
};

// The pattern of the matrices of one mesh (iccm/linalg/cholesky.py).
struct BlockPattern {
    const int64_t *order;     // (n,) the vertex of each row
    const int64_t *starts;    // (n + 1,) where each row of the upper triangle begins in `columns`
    const int64_t *columns;   // (e,) its block columns, ascending: the diagonal comes first
    const int64_t *diagonal;  // (n,) the entry of each vertex with itself
    const int64_t *ahead;     // (b,) the entry of each outline vertex with the next one
    int64_t n;
    int64_t e;
    Fronts fronts;
};

// A factor L of a matrix H = L Lᵀ and L⁻¹ g, and room for what makes and applies them.
struct Factor {
    double *values;    // columns of the fronts, and updates that wait for their parents
    int64_t *place;    // (n,) where the rows of a front are in it
    int64_t *waiting;  // (count,) fronts whose parents have not come yet, a stack
    int64_t *sources;  // (count + 1,) where the update of each of them begins in `values`
    double *part;      // (2n + 1,) the rows of a front in a solution
    double *left;      // (2n,) of a gradient, while it is eliminated
};

// Factorises H, blocks xx, xy, yx, yy of the upper triangle (e, 4), and eliminates the gradient g (n,) with it; false
// where H is not positive definite.
bool factorise(const BlockPattern &pattern, const double *matrix, const Complex *gradient, Factor &factor);

// Puts L⁻¹ g of another gradient g (n,) in the place of the one that was factorised with H.
void forward_substitute(const BlockPattern &pattern, const Complex *gradient, Factor &factor);

// Fills in the step -H⁻¹ g (n,) for the factor of H and g: the x with Lᵀ x + L⁻¹ g = 0.
void back_substitute(const BlockPattern &pattern, Factor &factor, Complex *step);

}  // namespace iccm

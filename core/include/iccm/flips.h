// Editable triangulations: neighbours across edges, edge flips, and stacks of triangles to visit again.
//
// Corners are numbered 0, 1, 2, counter-clockwise; side k is the one opposite corner k.
#pragma once

#include "iccm/core.h"

namespace iccm {

// Corners (t, 3), counter-clockwise, and the triangles (t, 3) beyond the sides opposite them, -1 on the outline. Both
// arrays may be longer than the number of triangles.
struct Triangles {
    Index (*faces)[3];
    Index (*across)[3];
};

// The corner after corner k, and the one before it.
inline int after(int k) { return k == 2 ? 0 : k + 1; }
inline int before(int k) { return k == 0 ? 2 : k - 1; }

// A triangle and the triangles across its sides.
inline void write(Triangles mesh, Index t, Index a, Index b, Index c, Index beyond_a, Index beyond_b, Index beyond_c) {
    Index *corners = mesh.faces[t], *across = mesh.across[t];
    corners[0] = a, corners[1] = b, corners[2] = c;
    across[0] = beyond_a, across[1] = beyond_b, across[2] = beyond_c;
}

// Replace the neighbour `old` of triangle t by `replacement`; does nothing for t = -1, beyond the outline.
inline void relink(Triangles mesh, Index t, Index old, Index replacement) {
    if (t < 0) return;
    for (int k = 0; k < 3; k++)
        if (mesh.across[t][k] == old) {
            mesh.across[t][k] = replacement;
            return;
        }
}

// Call a function of a triangle's corners with the lowest number first, in the same orientation.
//
// Rounding may give thin triangles another value for each order of their corners, and flips that compare such values can
// alternate forever.
template <typename Function>
inline double of_triangle(Index a, Index b, Index c, Function function) {
    if (b < a && b < c) return function(b, c, a);
    if (c < a && c < b) return function(c, a, b);
    return function(a, b, c);
}

// The corner that is neither vertex b nor vertex c: of a triangle given by its corners, and of triangle t of a mesh.
inline int opposite(const Index *corners, Index b, Index c) {
    for (int k = 0; k < 3; k++)
        if (corners[k] != b && corners[k] != c) return k;
    return 0;
}

inline int opposite(Triangles mesh, Index t, Index b, Index c) { return opposite(mesh.faces[t], b, c); }

// Replace side k of triangle t by the other diagonal of the quadrilateral that it forms with its neighbour u: the
// triangles abc and dcb become abd (number t) and adc (number u).
inline void flip(Triangles mesh, Index t, int k) {
    Index u = mesh.across[t][k];
    Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)], c = mesh.faces[t][before(k)];
    int j = opposite(mesh, u, b, c);
    Index d = mesh.faces[u][j];
    Index beyond_ca = mesh.across[t][after(k)], beyond_ab = mesh.across[t][before(k)];
    Index beyond_bd = mesh.across[u][after(j)], beyond_dc = mesh.across[u][before(j)];
    write(mesh, t, a, b, d, beyond_bd, u, beyond_ab);
    write(mesh, u, a, d, c, beyond_dc, beyond_ca, t);
    relink(mesh, beyond_bd, u, t);
    relink(mesh, beyond_ca, t, u);
}

// Changed triangles that are to be visited; entry 0 is their number, as in the callers' arrays.
struct Stack {
    Index *entries;
    Index size;  // of the array

    // A full stack drops triangles: the mesh is then not optimal, but valid.
    void push(Index t) {
        if (entries[0] + 1 < size) entries[++entries[0]] = t;
    }
    bool empty() const { return entries[0] == 0; }
    Index pop() { return entries[entries[0]--]; }
};

// The quadrilateral of a triangle abc and its neighbour dcb across side bc, by their numbers t and u.
struct Quadrilateral {
    Index t, u;
    Index a, b, c, d;
};

// Flip edges, starting with the triangles on the stack, while `improves` prefers the diagonal ad of a quadrilateral to
// bc. Empties the stack, unless that takes more than `most` visits. Returns the number of flips.
//
// The flips are finite in number if `improves` compares sums of values that each triangle has in whatever order its
// corners are given (`of_triangle`), with a margin for rounding, since the sum then decreases with every flip.
template <typename Improves>
Index flip_edges(Triangles mesh, Stack stack, Improves improves, Index most = INT64_MAX) {
    Index flips = 0;
    for (Index visit = 0; visit < most && !stack.empty(); ++visit) {
        Index t = stack.pop();
        for (int k = 0; k < 3; k++) {
            Index u = mesh.across[t][k];
            if (u < 0) continue;
            Index a = mesh.faces[t][k], b = mesh.faces[t][after(k)], c = mesh.faces[t][before(k)];
            Index d = mesh.faces[u][opposite(mesh, u, b, c)];
            if (!improves(Quadrilateral{t, u, a, b, c, d})) continue;
            flip(mesh, t, k);
            // Both have new sides, which may now be worth a flip.
            stack.push(t);
            stack.push(u);
            flips++;
            break;
        }
    }
    return flips;
}

}  // namespace iccm

// Edge flips that keep an edited triangulation constrained Delaunay.
#pragma once

#include "iccm/flips.h"

namespace iccm {

// Twice the least area, in a domain of area one, that either triangle may have after a flip.
constexpr double MIN_FLIPPED_AREA = 1e-14;

// Edges that must stay: each of the first `count` vertices v is joined to vertex next[v], or to none (-1).
struct Links {
    const Index *next;
    Index count;

    bool join(Index a, Index b) const { return a < count && b < count && (next[a] == b || next[b] == a); }
};

// Whether vertex d lies inside the circumcircle of the counter-clockwise triangle a, b, c by more than rounding:
//
//     | u  |u|² |
//     | v  |v|² | > 0,   u = a - d, v = b - d, w = c - d (two columns each)
//     | w  |w|² |
//
// The determinant's error is at most 1e-15 of the sum of its terms' sizes (Shewchuk, Adaptive precision floating-point
// arithmetic and fast robust geometric predicates, 1997, §4.3); the margin of 1e-13 leaves room to spare. Cocircular
// vertices thus count as outside, so that flips between them cannot alternate.
inline bool in_circle(const Complex *z, Index a, Index b, Index c, Index d) {
    constexpr double MARGIN = 1e-13;
    Complex u = z[a] - z[d], v = z[b] - z[d], w = z[c] - z[d];
    double first = dot(u, u) * cross(v, w), second = dot(v, v) * cross(w, u), third = dot(w, w) * cross(u, v);
    return first + second + third > MARGIN * (fabs(first) + fabs(second) + fabs(third));
}

// Flip edges, starting with the triangles on the stack, until all edges but those that must stay are Delaunay (Lawson,
// Software for C¹ surface interpolation, 1977). Empties the stack. No flip joins two of the first `fixed` vertices.
inline void legalise(const Complex *z, Triangles mesh, Stack stack, Index fixed, Links links) {
    // In exact arithmetic the flips are finite in number; the bound, which no mesh comes near, ends them with rounding
    // too.
    constexpr Index MAX_VISITS = 2000000;
    auto improves = [&](const Quadrilateral &q) {
        if ((q.a < fixed && q.d < fixed) || links.join(q.b, q.c)) return false;
        return in_circle(z, q.a, q.b, q.c, q.d) && twice_area(z, q.a, q.b, q.d) > MIN_FLIPPED_AREA &&
               twice_area(z, q.a, q.d, q.c) > MIN_FLIPPED_AREA;
    };
    flip_edges(mesh, stack, improves, MAX_VISITS);
}

}  // namespace iccm

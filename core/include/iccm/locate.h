// Point location in a flat mesh: a walk from triangle to triangle, whose first triangle is looked up in a grid.
#pragma once

#include "iccm/core.h"

namespace iccm {

// A mesh and the grid from which walks begin (iccm/meshes/locate.py).
struct Places {
    const Complex *flat;    // (n,) vertices
    const int64_t *faces;   // (m, 3) triangles, counter-clockwise
    const int64_t *twin;    // (3m,) the half-edge beyond each one, negative on a border
    const int32_t *grid;    // (size, size) triangles to start from
    int64_t size;           // cells along each side
    double low_x;           // lower left corner of the grid
    double low_y;
    double scale;           // cells to the unit
};

// Barycentric coordinates of the point of triangle a, b, c nearest to z, given those of z.
inline void clamp_to_triangle(Complex a, Complex b, Complex c, Complex z, const double own[3], double *weights) {
    for (int k = 0; k < 3; k++) weights[k] = own[k];
    if (min(min(own[0], own[1]), own[2]) >= 0) return;
    const Complex corner[3] = {a, b, c};
    double least = INFINITY;
    for (int k = 0; k < 3; k++) {
        Complex u = corner[k], side = corner[(k + 1) % 3] - u;
        double length = size(side);
        double s = ((z - u) * conjugate(side)).re / max(length * length, 1e-300);
        s = min(max(s, 0.0), 1.0);
        double distance = size(u + s * side - z);
        if (distance < least) {
            least = distance;
            weights[k] = 1 - s;
            weights[(k + 1) % 3] = s;
            weights[(k + 2) % 3] = 0.0;
        }
    }
}

// The triangle that contains a point, reached from triangle t by crossing the edge that the point lies farthest beyond,
// until it lies beyond none or a border stops the walk. Fills in its barycentric coordinates (3,).
inline Index walk_to(const Complex *flat, const Index *faces, const Index *twin, Complex z, Index t, double *weights) {
    constexpr Index MOST_STEPS = 4096;  // rounding may make a walk cyclic
    auto twice = [](Complex o, Complex a, Complex b) {
        return (a.re - o.re) * (b.im - o.im) - (a.im - o.im) * (b.re - o.re);
    };
    for (Index steps = 0;; steps++) {
        Complex a = flat[faces[3 * t]], b = flat[faces[3 * t + 1]], c = flat[faces[3 * t + 2]];
        double area = twice(a, b, c);
        const double own[3] = {twice(b, c, z) / area, twice(c, a, z) / area, twice(a, b, z) / area};
        Index worst = -1;
        double beyond = 0.0;
        for (Index k = 0; k < 3; k++) {  // weight k belongs to the edge from corner k + 1 to k + 2
            if (own[k] < beyond && twin[3 * t + (k + 1) % 3] >= 0) {
                worst = k;
                beyond = own[k];
            }
        }
        if (worst < 0 || steps > MOST_STEPS) {
            clamp_to_triangle(a, b, c, z, own, weights);
            return t;
        }
        t = twin[3 * t + (worst + 1) % 3] / 3;
    }
}

// The triangle that contains a point. Fills in its barycentric coordinates (3,).
inline Index place_on(const Places &places, Complex z, double *weights) {
    double last = double(places.size - 1);
    double x = (z.re - places.low_x) * places.scale, y = (z.im - places.low_y) * places.scale;
    Index column = Index(min(max(x, 0.0), last)), row = Index(min(max(y, 0.0), last));
    return walk_to(places.flat, places.faces, places.twin, z, places.grid[row * places.size + column], weights);
}

}  // namespace iccm

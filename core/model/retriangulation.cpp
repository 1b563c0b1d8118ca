// Edge flips in a map's triangulation that lower its energy; vertices and their images stay.
//
// Dyn, Levin and Rippa, Data Dependent Triangulations for Piecewise Linear Interpolation, IMA Journal of Numerical
// Analysis 10, 1990: long triangles along the direction in which a map changes least approximate it better than round
// ones.
#include "iccm/delaunay.h"
#include "iccm/density.h"

namespace iccm {

namespace {

constexpr double GAIN = 1e-6;  // least relative gain of a flip, so that rounding decides nothing and flipping ends

struct Weights {
    double theta, q, share;  // of the density
};

// The energy of a triangle; infinite if it or its image is flipped or has almost no area.
double energy_of_corners(const Complex *z, const Complex *u, Index a, Index b, Index c, Weights weights) {
    double area = twice_area(z, a, b, c), image = twice_area(u, a, b, c);
    if (area <= MIN_FLIPPED_AREA || image <= MIN_FLIPPED_AREA) return INFINITY;
    // |f_z|² + |f_z̄|² is half the sum of the squared singular values of the affine map
    Complex ab = z[b] - z[a], ac = z[c] - z[a], first = u[b] - u[a], second = u[c] - u[a];
    double d = image / area;
    double e = dot(ab, ab), f = dot(ab, ac), g = dot(ac, ac);
    double p = (g * dot(first, first) - 2 * f * dot(first, second) + e * dot(second, second)) / (2 * area * area);
    // p is at least d, but for rounding in thin triangles: with less, energies could be negative
    return 0.5 * area * density(fmax(p, d), d, weights.theta, weights.q, weights.share);
}

double energy(const Complex *z, const Complex *u, Index a, Index b, Index c, Weights weights) {
    return of_triangle(a, b, c, [&](Index first, Index second, Index third) {
        return energy_of_corners(z, u, first, second, third, weights);
    });
}

}  // namespace

}  // namespace iccm

using namespace iccm;

// Flip edges, starting with the triangles on the stack, while that lowers the energy.
//
//   z           (n,) vertices
//   u           (n,) their images
//   faces       (t, 3) triangles, changed
//   across      (t, 3) their neighbours, changed
//   stack       (stack_size,) triangles to visit, after their number; emptied
//   fixed       (t,) triangles that stay
//   border      number of vertices on outlines: no flip joins two of them
//   links       (link_count,) the vertex to which each of the first vertices is joined by an edge that must stay, -1
//               for none
//   theta, q, share  parameters of the density
ICCM_EXPORT int64_t iccm_model_flip_to_lower_energy(const Complex *z, const Complex *u, int64_t *faces, int64_t *across,
                                                    int64_t *stack, int64_t stack_size, const bool *fixed,
                                                    int64_t border, const int64_t *links, int64_t link_count,
                                                    double theta, double q, double share) {
    Triangles mesh{reinterpret_cast<Index(*)[3]>(faces), reinterpret_cast<Index(*)[3]>(across)};
    Links stay{links, link_count};
    Weights weights{theta, q, share};
    auto improves = [&](const Quadrilateral &quad) {
        auto [t, v, a, b, c, d] = quad;
        if (fixed[t] || fixed[v] || (a < border && d < border) || stay.join(b, c)) return false;
        double now = energy(z, u, a, b, c, weights) + energy(z, u, d, c, b, weights);
        double then = energy(z, u, a, b, d, weights) + energy(z, u, a, d, c, weights);
        return then < (1 - GAIN) * now;
    };
    return flip_edges(mesh, {stack, stack_size}, improves);
}

// Bounds of harmonic maps between samples; the formulas are derived in iccm/maps/enclosure.py.

#include "iccm/core.h"

namespace iccm {
namespace {

constexpr double TWO_PI = 2 * 3.14159265358979323846;

// A polygon (n,), its edges z_{j+1} - z_j, and the increments φ_{j+1} - φ_j (densities, n) of one or two densities, Φ
// and Ψ̄.
struct Densities {
    const Complex *polygon, *edge;
    Index n;
    const Complex *rise;
    Index count;
};

// Bounds on one piece: `second` is |Φ″| + |Ψ″| in the middle, `rest` the sum of R for Φ and for Ψ (R: see below),
// `terms` the sum of the absolute terms of f_z and f_z̄, for bounds on rounding errors. If a vertex may lie on the
// piece (`vertex`), the numbers are meaningless.
struct Bounds {
    double second, rest, terms;
    bool vertex;
};

// Bounds on a piece with middle m and half its length r. With the second derivative
//
//     Φ″(z) = 1/(2πi) Σ_j ρ_j / ((z_j - z) (z_{j+1} - z)),   ρ_j = φ_{j+1} - φ_j - Φ'(m) (z_{j+1} - z_j),
//
// and D_j = |z_j - m| - r, Φ″ varies by at most r R, R = 1/(2π) Σ_j |ρ_j| (D_j + D_{j+1}) / (D_j D_{j+1})². `slope`:
// the derivatives Φ'(m) of the densities' maps.
Bounds bounds_on(const Densities &f, Complex m, double r, const Complex slope[2]) {
    const Complex one = {1, 0};
    Complex second[2] = {{0, 0}, {0, 0}};
    double rest = 0.0, terms = 0.0;
    bool vertex = false;
    Complex a = f.polygon[0] - m;
    double far_a = size(a);
    for (Index j = 0; j < f.n; j++) {
        Complex b = f.polygon[j + 1 == f.n ? 0 : j + 1] - m;
        double far_b = size(b);
        if (!(min(far_a, far_b) > r)) {
            vertex = true;
            break;
        }
        Complex inverse = one / (a * b);
        double sizes = 0.0, rises = 0.0;
        for (Index d = 0; d < f.count; d++) {
            Complex rise = f.rise[d * f.n + j], rho = rise - slope[d] * f.edge[j];
            second[d] += rho * inverse;
            sizes += size(rho);
            rises += size(rise);
        }
        double product = (far_a - r) * (far_b - r);
        rest += sizes * (far_a + far_b - 2 * r) / (product * product);
        terms += rises * min(4.0 / size(f.edge[j]), 1.0 / max(far_a, far_b));
        a = b, far_a = far_b;
    }
    return {(size(second[0]) + size(second[1])) / TWO_PI, rest / TWO_PI, terms / TWO_PI, vertex};
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute bounds on pieces of a curve. Returns 0.
//
//   polygon    (n,) vertices
//   edge       (n,) vectors from each vertex to the next
//   n          number of vertices
//   rise       (densities, n) increment of each density along the edges
//   densities  number of densities, 1 or 2
//   middle     (p,) middles of the pieces
//   half       (p,) half their lengths
//   slope      (2, p) derivatives of the densities' maps in the middles
//   start      first piece to compute
//   stop       end of the pieces to compute, exclusive
//   p          number of pieces
//   out        (4, p) written from start to stop: |Φ″| + |Ψ″| in the middle, R, the terms added up in f_z and f_z̄, and
//   1
//              where a vertex may lie on the piece, else 0
ICCM_EXPORT int64_t iccm_maps_enclosure(const Complex *polygon, const Complex *edge, int64_t n, const Complex *rise,
                                        int64_t densities, const Complex *middle, const double *half,
                                        const Complex *slope, int64_t start, int64_t stop, int64_t p, double *out) {
    const Densities f = {polygon, edge, n, rise, densities};
    for (Index i = start; i < stop; i++) {
        const Complex slopes[2] = {slope[i], slope[p + i]};
        Bounds bounds = bounds_on(f, middle[i], half[i], slopes);
        out[i] = bounds.second, out[p + i] = bounds.rest, out[2 * p + i] = bounds.terms, out[3 * p + i] = bounds.vertex;
    }
    return 0;
}

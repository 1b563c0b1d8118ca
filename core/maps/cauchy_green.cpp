// Cauchy-Green coordinates of a polygon, their derivatives, and integrals of densities that are linear on its edges.
//
// Weber, Ben-Chen, Gotsman, Complex barycentric coordinates with applications to planar shape deformation, Computer
// Graphics Forum 28(2), 2009; Segall, Ben-Chen, Iterative closest conformal maps between planar domains, Computer
// Graphics Forum 35(5), 2016, Appendix A.
//
// For a counter-clockwise polygon z_0 .. z_{n-1} with A_e = z_{e+1} - z_e and B_j = z_j - z, edge e contributes
//
//     C :  B_{e+1}/A_e · L_e  to column e,   -B_e/A_e · L_e  to column e+1,     L_e = log(B_{e+1} / B_e)
//     D :  -L_e/A_e           to column e,    L_e/A_e        to column e+1
//
// each divided by 2πi, so one logarithm per point and edge serves both.

#include "iccm/core.h"

namespace iccm {
namespace {

constexpr double PI = 3.14159265358979323846;

struct Polygon {
    const Complex *vertices;
    Index count;

    Index next(Index j) const { return j + 1 == count ? 0 : j + 1; }
    Index previous(Index j) const { return j == 0 ? count - 1 : j - 1; }
    Complex edge(Index e) const { return vertices[next(e)] - vertices[e]; }
};

// log(b / a), accurate when the edge b - a is short against a.
Complex edge_log(Complex a, Complex b, Complex edge) {
    double a2 = max(dot(a, a), 1e-300);
    double re = dot(edge, a) / a2, im = cross(a, edge) / a2;  // edge / a
    double s = 2 * re + re * re + im * im;                    // |1 + edge / a|² - 1
    if (-0.5 < s && s < 1.0) return {0.5 * log1p(s), atan2(im, 1 + re)};
    double b2 = max(dot(b, b), 1e-300);
    return {0.5 * log(b2 / a2), atan2(cross(a, b), dot(b, a))};
}

// L_e of a point z: on the edge the limit from inside, of imaginary part +π, and 0 at its ends.
Complex inner_log(const Polygon &polygon, Complex z, Index e) {
    constexpr double ON_EDGE = 1e-9;  // radians: the point lies on an edge that it sees under an angle this close to -π
    // Rounding error of a coordinate: divided by the distance to an end of the edge it is an error of the angle; and
    // the most, in radians, that this error and ON_EDGE may add up to.
    constexpr double ROUNDING = 4e-16, MAX_SLACK = 0.5;
    Complex start = polygon.vertices[e] - z, end = polygon.vertices[polygon.next(e)] - z;
    const Complex zero = {0, 0};
    if (start == zero || end == zero) return zero;
    Complex log = edge_log(start, end, polygon.edge(e));
    if (log.im < MAX_SLACK - PI) {
        double slack = ON_EDGE + ROUNDING * (1 + size(z)) / min(size(start), size(end));
        if (log.im < min(slack, MAX_SLACK) - PI) log.im += 2 * PI;
    }
    return log;
}

// The sum of the logarithms of edges j - 1 and j at vertex j: log(A_j / -A_{j-1}) with imaginary part in (0, 2π); the
// principal value is wrong at convex vertices.
Complex vertex_log(const Polygon &polygon, Index j) {
    Complex vertex = polygon.vertices[j];
    Complex ratio = (polygon.vertices[polygon.next(j)] - vertex) / (polygon.vertices[polygon.previous(j)] - vertex);
    double angle = atan2(ratio.im, ratio.re);
    return {log(size(ratio)), angle > 0 ? angle : angle + 2 * PI};
}

// L_e / (2πi A_e) of one point for all edges, of which both the coordinates and their derivatives are made. At vertex j
// the pair of edges (j - 1, j) has 0 and the sum of both.
void edge_weights(const Polygon &polygon, Complex z, Complex *weights) {
    Index at = -1;
    for (Index e = 0; e < polygon.count; e++) {
        weights[e] = inner_log(polygon, z, e);
        if (polygon.vertices[e] == z) at = e;
    }
    if (at >= 0) weights[at] = vertex_log(polygon, at);
    for (Index e = 0; e < polygon.count; e++) {
        Complex edge = polygon.edge(e);
        weights[e] = weights[e] / Complex{-2 * PI * edge.im, 2 * PI * edge.re};
    }
}

// --- Integrals ---

// Several points at a time, as many as fit in a wide register. Sums run over edges, in the same order for each point,
// so that they do not depend on the width of registers.
#if defined(__AVX__)
constexpr int LANES = 4;
#else
constexpr int LANES = 2;
#endif
typedef double Lanes __attribute__((vector_size(LANES * sizeof(double)), aligned(16)));  // as malloc aligns

struct ComplexLanes {
    Lanes re, im;
};

// An edge in the form that the series below needs.
struct Edge {
    double x, y;  // sum of its ends
    double dx, dy;
    double far;  // squared length of the sum of the vectors to its ends from which on the series is accurate
};

// Largest ratio of an edge to the sum of the vectors to its ends for which the series is exact: the truncation error is
// 1e-16 of the value.
constexpr double FAR = 0.05;

// L_e of points from which an edge is short, log((1 + w) / (1 - w)) = 2 (w + w³/3 + …): a fraction of the work of a
// logarithm. w is the edge divided by the sum of the vectors to its ends; Horner's rule in w². `near` becomes zero or
// less where the edge is too long for the series.
inline ComplexLanes far_logs(const Edge &edge, const Lanes &zx, const Lanes &zy, Lanes &near) {
    Lanes a = edge.x - 2 * zx, b = edge.y - 2 * zy;
    Lanes size = a * a + b * b;
    Lanes margin = size - edge.far;
    near = margin < near ? margin : near;
    Lanes inverse = 1 / size;
    Lanes u = (edge.dx * a + edge.dy * b) * inverse, v = (edge.dy * a - edge.dx * b) * inverse;
    // x = w², x² = t x - s; b_k is the coefficient a_k + t b_{k+1} - s b_{k+2}, and the sum a_0 - s b_2 + x b_1.
    Lanes x = u * u - v * v, y = 2 * u * v, t = 2 * x, s = x * x + y * y;
    Lanes b4 = 1.0 / 9 + t * (1.0 / 11);
    Lanes b3 = 1.0 / 7 + t * b4 - s * (1.0 / 11);
    Lanes b2 = 1.0 / 5 + t * b3 - s * b4;
    Lanes b1 = 1.0 / 3 + t * b2 - s * b3;
    Lanes c = 1.0 - s * b2 + x * b1, d = y * b1;
    return {2 * (u * c - v * d), 2 * (u * d + v * c)};
}

// Densities that are linear on every edge: values at its start and slopes, (m, n).
struct Densities {
    const Complex *values, *slopes;
    Index count, edges;
};

// Integrals and their derivatives at LANES points z, summed over the edges of a tile.
struct Sums {
    ComplexLanes total, rate;
};

// Add the terms of edges first to last: Σ (φ_e + σ_e (z - z_e)) L_e and Σ σ_e L_e.
inline void accumulate(const Polygon &polygon, const Complex *values, const Complex *slopes, const ComplexLanes *logs,
                       Index first, Index last, const Lanes &zx, const Lanes &zy, Sums &sums) {
    Sums sum = sums;
    for (Index e = first; e < last; e++) {
        Complex start = polygon.vertices[e], value = values[e], slope = slopes[e];
        ComplexLanes log = logs[e - first];
        Lanes a = zx - start.re, b = zy - start.im;
        Lanes c = value.re + (slope.re * a - slope.im * b), d = value.im + (slope.re * b + slope.im * a);
        sum.total.re += c * log.re - d * log.im;
        sum.total.im += c * log.im + d * log.re;
        sum.rate.re += slope.re * log.re - slope.im * log.im;
        sum.rate.im += slope.re * log.im + slope.im * log.re;
    }
    sums = sum;
}

constexpr Index TILE = 64;  // edges whose logarithms are kept: with 8 points, 8 KiB of the first-level cache's 32

// Replace the logarithms of the edges close to the point in a given lane: by the exact logarithm, or on an edge by its
// limit from inside. Returns whether the point is a vertex.
bool replace_near_logs(const Polygon &polygon, const Edge *edges, Complex z, Index first, Index last,
                       ComplexLanes *logs, int lane) {
    bool at_vertex = false;
    for (Index e = first; e < last; e++) {
        double a = edges[e].x - 2 * z.re, b = edges[e].y - 2 * z.im;
        if (a * a + b * b - edges[e].far > 0) continue;
        bool vertex = polygon.vertices[e] == z;
        Complex log = vertex ? vertex_log(polygon, e) : inner_log(polygon, z, e);
        logs[e - first].re[lane] = log.re, logs[e - first].im[lane] = log.im;
        at_vertex = at_vertex || vertex;
    }
    return at_vertex;
}

// Integrals for LANES points; `edges` (n,) in the form for `far_logs`, `sums` (m,) written. Returns a bit for each
// point that is a vertex.
unsigned integrate(const Polygon &polygon, const Densities &densities, const Edge *edges, const Lanes &zx,
                   const Lanes &zy, Sums *sums) {
    ComplexLanes logs[TILE];
    unsigned vertices = 0;
    const Lanes zero = {};
    for (Index k = 0; k < densities.count; k++) sums[k] = {{zero, zero}, {zero, zero}};
    for (Index first = 0; first < polygon.count; first += TILE) {
        Index last = min(first + TILE, polygon.count);
        Lanes near = zero + INFINITY;
        for (Index e = first; e < last; e++) logs[e - first] = far_logs(edges[e], zx, zy, near);
        for (int lane = 0; lane < LANES; lane++)
            if (!(near[lane] > 0) && replace_near_logs(polygon, edges, {zx[lane], zy[lane]}, first, last, logs, lane))
                vertices |= 1u << lane;
        for (Index k = 0; k < densities.count; k++)
            accumulate(polygon, densities.values + k * densities.edges, densities.slopes + k * densities.edges, logs,
                       first, last, zx, zy, sums[k]);
    }
    return vertices;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute Cauchy-Green coordinates. Returns 0.
//
//   vertices  (n,) polygon, counter-clockwise
//   n         number of vertices
//   z         (p,) points inside, on edges, or on vertices (there: the limit from inside)
//   start     first point to compute
//   stop      end of the points to compute, exclusive
//   out       (p, n) rows start to stop written
ICCM_EXPORT int64_t iccm_maps_coordinates(const Complex *vertices, int64_t n, const Complex *z, int64_t start,
                                          int64_t stop, Complex *out) {
    const Polygon polygon = {vertices, n};
    Buffer<Complex> weights(n);
    if (!weights) return OUT_OF_MEMORY;
    for (Index p = start; p < stop; p++) {
        Complex *row = out + p * n;
        edge_weights(polygon, z[p], weights.data);
        for (Index e = 0; e < n; e++) row[e] = {0, 0};
        for (Index e = 0; e < n; e++) {
            Index f = polygon.next(e);
            row[e] += (vertices[f] - z[p]) * weights[e];
            row[f] -= (vertices[e] - z[p]) * weights[e];
        }
    }
    return 0;
}

// Compute the derivatives of Cauchy-Green coordinates with respect to z. Returns 0.
//
//   vertices  (n,) polygon, counter-clockwise
//   n         number of vertices
//   z         (p,) points off the vertices
//   start     first point to compute
//   stop      end of the points to compute, exclusive
//   out       (p, n) rows start to stop written
ICCM_EXPORT int64_t iccm_maps_derivatives(const Complex *vertices, int64_t n, const Complex *z, int64_t start,
                                          int64_t stop, Complex *out) {
    const Polygon polygon = {vertices, n};
    Buffer<Complex> weights(n);
    if (!weights) return OUT_OF_MEMORY;
    for (Index p = start; p < stop; p++) {
        Complex *row = out + p * n;
        edge_weights(polygon, z[p], weights.data);
        for (Index e = 0; e < n; e++) row[e] = {0, 0};
        for (Index e = 0; e < n; e++) {
            row[e] -= weights[e];
            row[polygon.next(e)] += weights[e];
        }
    }
    return 0;
}

// Compute 2πi times the integrals of densities that are linear on every edge, and 2πi times their derivatives with
// respect to z. Returns 0.
//
//   vertices  (n,) polygon, counter-clockwise
//   n         number of vertices
//   values    (m, n) densities at the vertices
//   slopes    (m, n) slopes of the densities on the edges
//   m         number of densities
//   z         (p,) points inside, on edges, or on vertices, where there is no derivative
//   start     first point to compute
//   stop      end of the points to compute, exclusive
//   p         number of points
//   out       (2, m, p) integrals and derivatives, written from start to stop
ICCM_EXPORT int64_t iccm_maps_jets(const Complex *vertices, int64_t n, const Complex *values, const Complex *slopes,
                                   int64_t m, const Complex *z, int64_t start, int64_t stop, int64_t p, Complex *out) {
    const Polygon polygon = {vertices, n};
    const Densities densities = {values, slopes, m, n};
    Buffer<Edge> edges(n);
    Buffer<Sums> sums(m);
    if (!edges || !sums) return OUT_OF_MEMORY;
    for (Index e = 0; e < n; e++) {
        Complex edge = polygon.edge(e);
        edges[e] = {2 * vertices[e].re + edge.re, 2 * vertices[e].im + edge.im, edge.re, edge.im,
                    dot(edge, edge) / (FAR * FAR)};
    }
    const Complex unknown = {NAN, NAN};
    for (Index first = start; first < stop; first += LANES) {
        Lanes x, y;
        for (int lane = 0; lane < LANES; lane++) {
            Complex point = z[min(first + lane, stop - 1)];  // past the end, repeat the last point
            x[lane] = point.re, y[lane] = point.im;
        }
        unsigned at_vertex = integrate(polygon, densities, edges.data, x, y, sums.data);
        for (Index k = 0; k < m; k++)
            for (Index i = first; i < min(first + LANES, stop); i++) {
                int lane = static_cast<int>(i - first);
                out[k * p + i] = {sums[k].total.re[lane], sums[k].total.im[lane]};
                out[(m + k) * p + i] = {sums[k].rate.re[lane], sums[k].rate.im[lane]};
                if (at_vertex >> lane & 1) out[(m + k) * p + i] = unknown;
            }
    }
    return 0;
}

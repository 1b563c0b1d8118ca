// Coarsening of a surface's triangulation by half-edge collapses, and the inverse, vertex insertion: Hormann, Greiner,
// Campagna, Hierarchical parametrization of triangulated surfaces, Vision, Modeling and Visualization 1999.

#include "iccm/core.h"
#include "iccm/density.h"
#include "iccm/flips.h"

namespace iccm {
namespace {

constexpr double PI = 3.14159265358979323846;
constexpr Index MAX_DEGREE = 12;  // most triangles around a removed vertex: twice the usual number

// Points of space.
typedef const double (*Points)[3];

// Roundness of a triangle in space: its area over the sum of its squared sides, scaled to 1 for an equilateral one.
double roundness(Points points, Index a, Index b, Index c) {
    double sum = 0.0, x[3], y[3];
    for (int k = 0; k < 3; k++) {
        x[k] = points[b][k] - points[a][k], y[k] = points[c][k] - points[a][k];
        sum += x[k] * x[k] + y[k] * y[k] + (y[k] - x[k]) * (y[k] - x[k]);
    }
    double s = x[1] * y[2] - x[2] * y[1], t = x[2] * y[0] - x[0] * y[2], r = x[0] * y[1] - x[1] * y[0];
    return 2 * sqrt(3.0) * sqrt(s * s + t * t + r * r) / sum;
}

// The neighbours of a vertex in order, counter-clockwise. On the boundary the ring is open and has one more neighbour
// than triangles. Its size is 0 if the triangles do not form a ring.
struct Ring {
    Index neighbours[MAX_DEGREE + 1];
    Index size;
    bool open;
};

// The ring of vertex v, given the triangles around it.
Ring ring_of(const Index (*faces)[3], const Index *around, Index degree, Index v) {
    Ring ring;
    ring.size = 0, ring.open = false;
    Index ends[MAX_DEGREE][2];  // the side opposite v of each triangle
    for (Index i = 0; i < degree; i++) {
        const Index *corners = faces[around[i]];
        int k = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
        ends[i][0] = corners[after(k)], ends[i][1] = corners[before(k)];
    }
    // On the boundary one side begins where no other ends; if there are several such sides, the triangles touch in v
    // alone.
    Index begin = -1;
    for (Index i = 0; i < degree; i++) {
        bool first = true;
        for (Index j = 0; j < degree; j++) first = first && ends[j][1] != ends[i][0];
        if (first && begin >= 0) return ring;
        if (first) begin = i;
    }
    Index at = max(begin, Index{0});
    for (Index i = 0; i < degree; i++) {
        ring.neighbours[i] = ends[at][0];
        Index next = -1;
        for (Index j = 0; j < degree; j++)
            if (ends[j][0] == ends[at][1]) next = j;
        if (next < 0) {
            ring.neighbours[i + 1] = ends[at][1];
            if (i == degree - 1) ring.size = degree + 1, ring.open = true;
            return ring;
        }
        at = next;
    }
    if (begin < 0 && at == 0) ring.size = degree;
    return ring;
}

// Records of the removed vertices, in the order of removal: `Removed` of iccm.flattening.coarsening.
struct Removed {
    Index *vertex, *into;
    Index (*triangle)[3];
    double (*weights)[3];
    Index *starts;
    Index (*edges)[2];
};

// Positions in the plane of a vertex and of its ring.
struct Chart {
    Complex middle, ring[MAX_DEGREE + 1];
};

// The positions in a layout z.
Chart chart_of(const Complex *z, const Ring &ring, Index v) {
    Chart chart;
    chart.middle = z[v];
    for (Index i = 0; i < ring.size; i++) chart.ring[i] = z[ring.neighbours[i]];
    return chart;
}

// The geodesic polar map of the triangles around vertex v (Floater, Parametrization and smooth approximation of surface
// triangulations, 1997): lengths of edges at v are kept, and angles are scaled to a full turn in all, or on the boundary
// to at most half a turn.
Chart polar_chart(Points points, const Ring &ring, Index degree, Index v) {
    double x[MAX_DEGREE + 1][3], length[MAX_DEGREE + 1], angle[MAX_DEGREE + 1];
    for (Index i = 0; i < ring.size; i++) {
        double square = 0.0;
        for (int k = 0; k < 3; k++) {
            x[i][k] = points[ring.neighbours[i]][k] - points[v][k];
            square += x[i][k] * x[i][k];
        }
        length[i] = sqrt(square);
    }
    angle[0] = 0.0;
    double sum = 0.0;
    for (Index j = 0; j < degree; j++) {
        Index next = j + 1 == ring.size ? 0 : j + 1;
        double product = x[j][0] * x[next][0] + x[j][1] * x[next][1] + x[j][2] * x[next][2];
        sum += acos(max(-1.0, min(1.0, product / (length[j] * length[next]))));
        if (next > 0) angle[next] = sum;
    }
    double scale = ring.open ? min(1.0, PI / sum) : 2 * PI / sum;
    Chart chart;
    chart.middle = {0, 0};
    for (Index i = 0; i < ring.size; i++)
        chart.ring[i] = length[i] * Complex{cos(scale * angle[i]), sin(scale * angle[i])};
    return chart;
}

// Triangles with those around each vertex.
struct Stars {
    Index (*faces)[3];
    const Index *starts, *around;

    // Whether a triangle around vertex v has vertex w. New triangles of v since the stars were computed are not seen.
    bool joins(Index v, Index w) const {
        for (Index i = starts[v]; i < starts[v + 1]; i++) {
            const Index *corners = faces[around[i]];
            if (corners[0] >= 0 && (corners[0] == w || corners[1] == w || corners[2] == w)) return true;
        }
        return false;
    }
};

// Whether vertex i of a ring may take the place of its middle: it must not be joined to others of the ring than its
// neighbours there already. Of two vertices joined since the stars were computed, one has triangles that were its own.
bool may_collapse(const Stars &stars, const Ring &ring, Index i) {
    Index w = ring.neighbours[i], previous = i > 0 ? i - 1 : ring.open ? -1 : ring.size - 1;
    Index next = i + 1 < ring.size ? i + 1 : ring.open ? -1 : 0;
    for (Index k = 0; k < ring.size; k++) {
        Index x = ring.neighbours[k];
        if (k != i && k != previous && k != next && (stars.joins(w, x) || stars.joins(x, w))) return false;
    }
    return true;
}

// The vertex of a ring onto which the middle can move so that the remaining triangles are roundest in space and none is
// folded in the plane; -1 if every one would leave a thin triangle, or an edge twice: without a fold in a layout, that
// still happens at holes of three edges. In an open ring only the two ends are considered, so that the boundary stays.
Index best_neighbour(Points points, const Chart &chart, const Ring &ring, Index degree, const Stars &stars) {
    constexpr double MIN_ROUNDNESS = 0.2;  // no collapse makes a thinner triangle
    double best = MIN_ROUNDNESS;
    Index into = -1;
    // if v moves onto w, the triangles (v, x, y) that do not contain w become (w, x, y)
    for (Index i = 0; i < ring.size; i += ring.open ? ring.size - 1 : 1) {
        double worst = 1.0;
        for (Index j = 0; j < degree; j++) {
            Index next = j + 1 == ring.size ? 0 : j + 1;
            if (j == i || next == i) continue;
            bool folds = !(twice_area(chart.ring, i, j, next) > 0);
            Index w = ring.neighbours[i], x = ring.neighbours[j], y = ring.neighbours[next];
            worst = folds ? 0.0 : min(worst, roundness(points, w, x, y));
        }
        if (worst > best && may_collapse(stars, ring, i)) best = worst, into = i;
    }
    return into;
}

// Record the collapse of vertex v onto vertex i of its ring: the edges of its hole, and the barycentric coordinates of v
// in the remaining triangle that it is farthest inside.
void record(const Chart &chart, const Ring &ring, Index degree, Index v, Index i, Removed removed, Index number) {
    double inside = -INFINITY;
    Index end = removed.starts[number];
    removed.vertex[number] = v, removed.into[number] = ring.neighbours[i];
    Complex w = chart.ring[i];
    for (Index j = 0; j < degree; j++) {
        Index next = j + 1 == ring.size ? 0 : j + 1;
        removed.edges[end + j][0] = ring.neighbours[j], removed.edges[end + j][1] = ring.neighbours[next];
        if (j == i || next == i) continue;
        Complex x = chart.ring[j], y = chart.ring[next];
        double area = cross(x - w, y - w);
        double p = cross(y - chart.middle, w - chart.middle) / area, q = cross(w - chart.middle, x - chart.middle) / area;
        double least = min(min(p, q), 1 - p - q);
        if (least > inside) {
            inside = least;
            Index *corners = removed.triangle[number];
            double *weights = removed.weights[number];
            corners[0] = ring.neighbours[i], corners[1] = ring.neighbours[j], corners[2] = ring.neighbours[next];
            weights[0] = 1 - p - q, weights[1] = p, weights[2] = q;
        }
    }
    removed.starts[number + 1] = end + degree;
}

// Move vertex v onto its neighbour w; the triangles that contain both get a first corner of -1.
void collapse(Index (*faces)[3], const Index *around, Index degree, Index v, Index w) {
    for (Index i = 0; i < degree; i++) {
        Index *corners = faces[around[i]];
        bool vanishes = corners[0] == w || corners[1] == w || corners[2] == w;
        for (int k = 0; k < 3; k++)
            if (corners[k] == v) corners[k] = w;
        if (vanishes) corners[0] = -1;
    }
}

// --- Insertion ---

// The sides (e, 2) opposite an inserted vertex, counter-clockwise.
struct Hole {
    const Index (*edges)[2];
    Index count;
};

// The bisector, at vertex w on a hole's rim, of the directions to the first and the last of the rim's other vertices.
Complex bisector(Hole hole, Index w, const Complex *u) {
    Index first = hole.edges[0][0];
    double angle = 0.0;
    for (Index e = 0; e < hole.count; e++)
        if (hole.edges[e][0] == w) first = hole.edges[e][1];
    for (Index e = 0; e < hole.count; e++) {
        const Index *edge = hole.edges[e];
        Complex x = u[edge[0]] - u[w], y = u[edge[1]] - u[w];
        if (edge[0] != w && edge[1] != w) angle += atan2(cross(x, y), dot(x, y));
    }
    return (u[first] - u[w]) * Complex{cos(0.5 * angle), sin(0.5 * angle)};
}

// The largest share of a step from a up to which the point stays to the left of all edges of a hole; 0 if it does not
// start there.
double visible_share(Hole hole, const Complex *u, Complex a, Complex step) {
    double share = INFINITY;
    // Twice the area of the point and an edge changes linearly with the share t: it is left + t · change.
    for (Index e = 0; e < hole.count; e++) {
        Complex x = u[hole.edges[e][0]] - a, y = u[hole.edges[e][1]] - a;
        double left = cross(x, y), change = cross(step, x - y);
        const Complex zero = {0, 0};
        if (x == zero || y == zero) left = 0.0;  // the point is an end of the edge, exactly
        if (change < 0)
            share = min(share, max(left, 0.0) / -change);
        else if (left == 0 && change == 0)  // it moves along the edge
            share = 0.0;
    }
    return share;
}

// The energy of triangles, with its gradient and Hessian with respect to the position of one vertex; infinite if a
// triangle is folded.
struct Energy {
    double value;
    Complex slope;
    double xx, yy, xy;
};

// The parameters of the density, see density.h.
struct Parameters {
    double theta, q, share;
};

// The Wirtinger gradients of the hat functions of a triangle in space at its corners, f_z = Σ α u and f_z̄ = Σ ᾱ u, and
// its area. As in `laid_flat` of iccm.meshes.stretch, a sliver is made a little higher, since rounding decides its shape.
struct Shape {
    Complex alpha[3];
    double area;
};

Shape shape_of(Points points, const Index (&corners)[3]) {
    constexpr double SLIVER_HEIGHT_SHARE = 1e-4;
    double squares[3];  // of the side opposite each corner
    for (int k = 0; k < 3; k++) {
        squares[k] = 0.0;
        for (int c = 0; c < 3; c++) {
            double x = points[corners[before(k)]][c] - points[corners[after(k)]][c];
            squares[k] += x * x;
        }
    }
    // in its plane: the longest side on the real axis, and the corner opposite it, the apex, above
    int apex = squares[0] >= squares[1] ? (squares[0] >= squares[2] ? 0 : 2) : (squares[1] >= squares[2] ? 1 : 2);
    const double *a = points[corners[after(apex)]], *b = points[corners[before(apex)]], *c = points[corners[apex]];
    double x[3], y[3], along = 0.0;
    for (int k = 0; k < 3; k++) {
        x[k] = b[k] - a[k], y[k] = c[k] - a[k];
        along += x[k] * y[k];
    }
    double s = x[1] * y[2] - x[2] * y[1], t = x[2] * y[0] - x[0] * y[2], r = x[0] * y[1] - x[1] * y[0];
    double length = sqrt(squares[apex]);
    double height = max(sqrt(s * s + t * t + r * r) / length, SLIVER_HEIGHT_SHARE * length);
    Complex tip = {along / length, height}, scale = {0.0, -0.5 / (length * height)};
    Shape shape;
    shape.area = 0.5 * length * height;
    shape.alpha[after(apex)] = scale * conjugate(tip - Complex{length, 0.0});
    shape.alpha[before(apex)] = -scale * conjugate(tip);
    shape.alpha[apex] = scale * length;
    return shape;
}

// The energy of the triangles between v and a hole's edges, relative to their shapes in space.
Energy energy_around(Points points, Hole hole, Index v, const Complex *u, Parameters how) {
    Energy sum = {0.0, {0, 0}, 0.0, 0.0, 0.0};
    for (Index e = 0; e < hole.count; e++) {
        Index b = hole.edges[e][0], c = hole.edges[e][1];
        Shape shape = shape_of(points, {v, b, c});
        Complex alpha = shape.alpha[0], beta = shape.alpha[1], gamma = shape.alpha[2];
        Complex x = u[b] - u[v], y = u[c] - u[v];
        Complex f = beta * x + gamma * y, g = conjugate(beta) * x + conjugate(gamma) * y;
        double ff = dot(f, f), gg = dot(g, g), area = shape.area;
        if (!(ff > gg)) {
            sum.value = INFINITY;
            return sum;
        }
        Density w = density_derivatives(ff + gg, ff - gg, how.theta, how.q, how.share);
        // The chain rule: gradients of p = |f|² + |g|² and d = |f|² - |g|² with respect to the position of v. The Hessian
        // of d vanishes, as d is twice an area, and that of p is 4 |α|² times the identity.
        Complex of_f = 2 * conjugate(alpha) * f, of_g = 2 * alpha * g, of_p = of_f + of_g, of_d = of_f - of_g;
        double same = 4 * w.p * dot(alpha, alpha);
        sum.value += area * w.value;
        sum.slope += area * (w.p * of_p + w.d * of_d);
        sum.xx += area * (same + w.pp * (of_p.re * of_p.re) + 2 * w.pd * of_p.re * of_d.re + w.dd * (of_d.re * of_d.re));
        sum.yy += area * (same + w.pp * (of_p.im * of_p.im) + 2 * w.pd * of_p.im * of_d.im + w.dd * (of_d.im * of_d.im));
        sum.xy += area * (w.pp * of_p.re * of_p.im + w.pd * (of_p.re * of_d.im + of_p.im * of_d.re) + w.dd * of_d.re * of_d.im);
    }
    return sum;
}

// Minimise the energy of the triangles around v, less the work of a force on v, by Newton's method, until a step lowers
// it by less than a share `min_gain`.
void settle(Points points, Hole hole, Index v, Complex *u, Parameters how, double min_gain, Complex force = {0, 0}) {
    Energy energy = energy_around(points, hole, v, u, how);
    for (;;) {
        double determinant = energy.xx * energy.yy - energy.xy * energy.xy;
        if (!(determinant > 0 && energy.xx > 0)) return;
        Complex g = energy.slope - force;
        Complex step = -Complex{energy.yy * g.re - energy.xy * g.im, energy.xx * g.im - energy.xy * g.re} / determinant;
        Complex from = u[v];
        // At most half of the way to where a triangle would fold: the energy is infinite there.
        u[v] = from + min(1.0, 0.5 * visible_share(hole, u, from, step)) * step;
        Energy next = energy_around(points, hole, v, u, how);
        double gain = energy.value - next.value + dot(force, u[v] - from);
        if (!(gain > 0)) {
            u[v] = from;
            return;
        }
        if (gain < min_gain * energy.value) return;
        energy = next;
    }
}

// Whether the triangles between a vertex and the edges of a hole are counter-clockwise.
bool is_proper(Hole hole, Index v, const Complex *u) {
    for (Index e = 0; e < hole.count; e++)
        if (!(cross(u[hole.edges[e][0]] - u[v], u[hole.edges[e][1]] - u[v]) > 0)) return false;
    return true;
}

// Give vertex v a position in its hole. Returns false if a triangle folds.
//
// The whole hole is visible from the neighbour w onto which v was moved. Therefore valid positions exist near w:
// towards v's recorded position in a triangle, or else along the bisector. From there the energy of the triangles
// around v is minimised.
bool put_back(Points points, Hole hole, Index v, Index w, const Index *triangle, const double *weights, Parameters how,
              double min_gain, Complex *u) {
    Complex a = u[w], step = -a;
    for (int k = 0; k < 3; k++) step += weights[k] * u[triangle[k]];
    double share = visible_share(hole, u, a, step);
    u[v] = a + (share > 1 ? step : 0.5 * share * step);
    if (!is_proper(hole, v, u)) {
        step = bisector(hole, w, u);
        share = visible_share(hole, u, a, step);
        u[v] = a + (share > 1 ? step : 0.5 * share * step);
    }
    settle(points, hole, v, u, how, min_gain);
    return is_proper(hole, v, u);
}

// The largest number of triangles around a vertex; those of vertex v begin at starts[v].
Index largest_degree(const Index *starts, Index n) {
    Index most = 0;
    for (Index v = 0; v < n; v++) most = max(most, starts[v + 1] - starts[v]);
    return most;
}

// The sides opposite v of `count` triangles around it, written to `edges`.
Hole around_vertex(const Index *faces, const Index *around, Index count, Index v, Index *edges) {
    for (Index i = 0; i < count; i++) {
        const Index *corners = faces + 3 * around[i];
        const int k = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
        edges[2 * i] = corners[after(k)], edges[2 * i + 1] = corners[before(k)];
    }
    return {rows<2>(edges), count};
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Remove vertices of which no two are neighbours, each by a half-edge collapse. Returns their number.
//
//   faces     (m, 3) triangles, changed; those that vanish get a first corner of -1
//   points    (n, 3) vertices in space
//   polar     whether triangles must not fold in the polar map around the vertex, rather than in the layout
//   z         (n,) a layout without folds; not read if `polar`
//   n         number of vertices
//   starts    (n + 1,) where the triangles of each vertex begin in `around`
//   around    (3m,) triangles of the vertices
//   blocked   (n,) vertices that stay, changed
//   most      most vertices to remove: the length of the arrays below
//   vertex    (most,) written: the removed vertices
//   into      (most,) written: the neighbour onto which each moves
//   triangle  (most, 3) written: corners of the remaining triangle in which each lies
//   weights   (most, 3) written: its barycentric coordinates there
//   ends      (most + 1,) written: where the sides around each begin in `edges`
//   edges     (3m, 2) written: the sides opposite it, counter-clockwise
ICCM_EXPORT int64_t iccm_flattening_remove(int64_t *faces, const double *points, bool polar, const Complex *z, int64_t n,
                                           const int64_t *starts, const int64_t *around, bool *blocked, int64_t most,
                                           int64_t *vertex, int64_t *into, int64_t *triangle, double *weights,
                                           int64_t *ends, int64_t *edges) {
    const Removed removed = {vertex, into, rows<3>(triangle), rows<3>(weights), ends, rows<2>(edges)};
    const Stars stars = {rows<3>(faces), starts, around};
    Index number = 0;
    ends[0] = 0;
    for (Index v = 0; v < n && number < most; v++) {
        Index degree = starts[v + 1] - starts[v];
        if (blocked[v] || degree < 2 || degree > MAX_DEGREE) continue;
        const Index *star = around + starts[v];
        Ring ring = ring_of(rows<3>(faces), star, degree, v);
        if (!ring.size) continue;
        const Chart chart = polar ? polar_chart(rows<3>(points), ring, degree, v) : chart_of(z, ring, v);
        Index i = best_neighbour(rows<3>(points), chart, ring, degree, stars);
        if (i < 0) continue;
        record(chart, ring, degree, v, i, removed, number++);
        for (Index k = 0; k < ring.size; k++) blocked[ring.neighbours[k]] = true;
        collapse(rows<3>(faces), star, degree, v, ring.neighbours[i]);
    }
    return number;
}

// Give positions to the removed vertices, the last one first. Returns 1, or 0 if a triangle folds.
//
//   vertex, into, triangle, weights, starts, edges: as `iccm_flattening_remove` writes them
//   count     number of removed vertices
//   points    (n, 3) vertices in space
//   theta, q, share: parameters of the energy's density, see density.h
//   min_gain  Newton's method for a vertex ends when a step lowers the energy of the triangles around it by less than
//             this share
//   u         (n,) positions, written for the removed vertices
ICCM_EXPORT int64_t iccm_flattening_put_back(const int64_t *vertex, const int64_t *into, const int64_t *triangle,
                                             const double *weights, const int64_t *starts, const int64_t *edges,
                                             int64_t count, const double *points, double theta, double q, double share,
                                             double min_gain, Complex *u) {
    for (Index i = count - 1; i >= 0; i--) {
        const Hole hole = {rows<2>(edges) + starts[i], starts[i + 1] - starts[i]};
        if (!put_back(rows<3>(points), hole, vertex[i], into[i], triangle + 3 * i, weights + 3 * i,
                      {theta, q, share}, min_gain, u))
            return 0;
    }
    return 1;
}

// Move the vertices one after the other to where the triangles around them have the least energy (nonlinear Gauss-Seidel
// iteration), without folds. It removes what differs between neighbouring vertices, and hardly changes what is smooth.
//
//   faces     (m, 3) triangles
//   points    (n, 3) vertices in space
//   n         number of vertices
//   starts    (n + 1,) where the triangles of each vertex begin in `around`
//   around    (3m,) triangles of the vertices
//   held      (n,) vertices that stay
//   forces    (n,) on the vertices; their work is subtracted from the energy
//   sweeps    number of times that each vertex is moved
//   theta, q, share, min_gain: as above
//   u         (n,) positions without folds, changed
ICCM_EXPORT int64_t iccm_flattening_smooth(const int64_t *faces, const double *points, int64_t n, const int64_t *starts,
                                           const int64_t *around, const bool *held, const Complex *forces,
                                           int64_t sweeps, double theta, double q, double share, double min_gain,
                                           Complex *u) {
    Buffer<Index> edges(2 * largest_degree(starts, n));
    if (!edges) return OUT_OF_MEMORY;
    for (Index sweep = 0; sweep < sweeps; sweep++)
        for (Index v = 0; v < n; v++) {
            if (held[v]) continue;
            Hole hole = around_vertex(faces, around + starts[v], starts[v + 1] - starts[v], v, edges.data);
            settle(rows<3>(points), hole, v, u, {theta, q, share}, min_gain, forces[v]);
        }
    return 0;
}

// The energy of positions u (n,), and its gradient with respect to each (n,), written to `slopes`; infinite with folds.
// Arguments as above.
ICCM_EXPORT double iccm_flattening_gradient(const int64_t *faces, const double *points, int64_t n, int64_t m,
                                          double theta, double q, double share, const Complex *u, Complex *slopes) {
    double sum = 0.0;
    for (Index v = 0; v < n; v++) slopes[v] = {0, 0};
    for (Index t = 0; t < m; t++) {
        const Index *corners = faces + 3 * t;
        Shape shape = shape_of(rows<3>(points), {corners[0], corners[1], corners[2]});
        Complex f = {0, 0}, g = {0, 0};
        for (int k = 0; k < 3; k++) {
            f += shape.alpha[k] * u[corners[k]];
            g += conjugate(shape.alpha[k]) * u[corners[k]];
        }
        double ff = dot(f, f), gg = dot(g, g);
        if (!(ff > gg)) return INFINITY;
        Density w = density_derivatives(ff + gg, ff - gg, theta, q, share);
        sum += shape.area * w.value;
        // the chain rule: the gradients of |f|² and |g|² with respect to a corner are 2 ᾱ f and 2 α g
        Complex of_f = (2 * shape.area * (w.p + w.d)) * f, of_g = (2 * shape.area * (w.p - w.d)) * g;
        for (int k = 0; k < 3; k++) slopes[corners[k]] += conjugate(shape.alpha[k]) * of_f + shape.alpha[k] * of_g;
    }
    return sum;
}

// Interpolate displacements of the vertices that are left linearly at the removed ones, the last one first.
//
//   vertex, triangle, weights, count: as in `iccm_flattening_put_back`
//   step      (n,) displacements, written for the removed vertices
ICCM_EXPORT int64_t iccm_flattening_interpolate(const int64_t *vertex, const int64_t *triangle, const double *weights,
                                                int64_t count, Complex *step) {
    for (Index i = count - 1; i >= 0; i--) {
        Complex sum = {0, 0};
        for (int k = 0; k < 3; k++) sum += weights[3 * i + k] * step[triangle[3 * i + k]];
        step[vertex[i]] = sum;
    }
    return 0;
}

// The transpose of the interpolation: move the forces on removed vertices to the corners of their triangles, the first
// one first.
//
//   forces    (n,) changed; those on removed vertices are then meaningless
ICCM_EXPORT int64_t iccm_flattening_restrict(const int64_t *vertex, const int64_t *triangle, const double *weights,
                                             int64_t count, Complex *forces) {
    for (Index i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) forces[triangle[3 * i + k]] += weights[3 * i + k] * forces[vertex[i]];
    return 0;
}

// Quadratic patches of a triangulated map's inverse: the patch that contains a point, values and derivatives, and
// bulges.
//
// With barycentric coordinates L of a triangle of the image, whose corners are the images of z_k in the source,
//
//     g(L) = Σ L_k z_k + 2 (L_1 L_2 d_0 + L_2 L_0 d_1 + L_0 L_1 d_2),
//
// d_k being the bulge of the side opposite corner k: how far its middle control point lies from its middle (Farin,
// Triangular Bernstein-Bézier patches, CAGD 3, 1986, §1). A patch is stored as c = (z_0, z_1, z_2, d_0, d_1, d_2).

#include "iccm/buckets.h"
#include "iccm/core.h"

namespace iccm {
namespace {

// The part of g that is quadratic, at L = (l0, l1, l2).
Complex bulge_at(const Complex *c, double l0, double l1, double l2) {
    return 2 * (l1 * l2 * c[3] + l2 * l0 * c[4] + l0 * l1 * c[5]);
}

// ∂g/∂L_1 and ∂g/∂L_2, L_0 = 1 - L_1 - L_2; u and v are those of the straight triangle, z_1 - z_0 and z_2 - z_0.
struct Tangents {
    Complex first, second;
};

Tangents tangents(const Complex *c, Complex u, Complex v, double l0, double l1, double l2) {
    return {u + 2 * ((l0 - l1) * c[5] + l2 * (c[3] - c[4])), v + 2 * ((l0 - l2) * c[4] + l1 * (c[3] - c[5]))};
}

// Parameters on a patch, and how far outside it they lie, in units of the plane; at most 0 inside.
struct Place {
    double l1, l2, away;
};

// Parameters on a patch, from which a step of Newton's method starts.
struct Start {
    double l1, l2;
};

// The start with each parameter at least -OUTSIDE, rescaled to the sum 1.
Start clamped(double l1, double l2) {
    constexpr double OUTSIDE = 0.05;  // barycentric: how far outside a step may start
    double l0 = max(1 - l1 - l2, -OUTSIDE);
    l1 = max(l1, -OUTSIDE), l2 = max(l2, -OUTSIDE);
    double sum = l0 + l1 + l2;
    return {l1 / sum, l2 / sum};
}

// The start whose point on the straight triangle, with sides u and v from its first corner, is closest.
//
// On a triangle that is much longer than wide, this moves a point across and keeps its place along, where clamping
// moves it along as well.
Start projected(const Complex &u, const Complex &v, double l1, double l2) {
    if (l1 >= 0 && l2 >= 0 && l1 + l2 <= 1) return {l1, l2};
    const Complex z = l1 * u + l2 * v, side = v - u;
    auto share = [](Complex from, Complex along) { return min(max(dot(from, along) / dot(along, along), 0.0), 1.0); };
    double first = share(z, u), second = share(z, v), third = share(z - u, side);
    const Start starts[3] = {{first, 0}, {0, second}, {1 - third, third}};
    Start best = starts[0];
    double least = INFINITY;
    for (const Start &start : starts) {
        double distance = size(z - (start.l1 * u + start.l2 * v));
        if (distance < least) best = start, least = distance;
    }
    return best;
}

// Newton's method for the parameters of point z on a bent patch, from `place`, with steps that begin at `start_at`.
// Returns whether it converged.
template <class StartAt>
bool descend(const Complex *c, Complex z, Place &place, StartAt start_at) {
    constexpr int MAX_STEPS = 12;        // 3 to 5 are usual
    constexpr double SMALL_STEP = 1e-8;  // the error after a step is about its square
    Complex u = c[1] - c[0], v = c[2] - c[0], r0 = z - c[0];
    for (int step = 0; step < MAX_STEPS; ++step) {
        Start start = start_at(place.l1, place.l2);
        double l1 = start.l1, l2 = start.l2, l0 = 1 - l1 - l2;
        Complex r = r0 - (l1 * u + l2 * v + bulge_at(c, l0, l1, l2));
        Tangents to = tangents(c, u, v, l0, l1, l2);
        double jacobian = cross(to.first, to.second);
        double h1 = cross(r, to.second) / jacobian, h2 = cross(to.first, r) / jacobian;
        place.l1 = l1 + h1, place.l2 = l2 + h2;
        if (fabs(h1) + fabs(h2) < SMALL_STEP) return true;
    }
    return false;
}

// Whether a patch bulges by more than the width of its triangle, which has the sides u and v and twice the given area.
bool is_bent_by_its_width(const Complex *c, Complex u, Complex v, double area) {
    auto squared = [](Complex a) { return dot(a, a); };
    double longest = max(max(squared(u), squared(v)), squared(v - u));
    double bulge = max(max(squared(c[3]), squared(c[4])), squared(c[5]));
    return bulge * longest > area * area;
}

// The parameters of point z on a patch: Newton's method from the solution for the straight triangle, which is the
// result if the patch is straight.
//
// Steps start close to the triangle, because the quadratic can have a second solution outside. If the patch is bent by
// more than its width, clamping can miss a point inside, and the method is repeated with projected starts. If it does
// not converge, the point is outside, and its distance is infinite.
Place locate(const Complex *c, Complex z) {
    Complex u = c[1] - c[0], v = c[2] - c[0], r0 = z - c[0];
    double area = cross(u, v);
    const Place straight = {cross(r0, v) / area, cross(u, r0) / area, INFINITY};
    Place place = straight;
    const Complex zero = {0, 0};
    if (c[3] != zero || c[4] != zero || c[5] != zero) {
        bool found = descend(c, z, place, [](double l1, double l2) { return clamped(l1, l2); });
        if (!found && is_bent_by_its_width(c, u, v, area)) {
            place = straight;
            found = descend(c, z, place, [&](double l1, double l2) { return projected(u, v, l1, l2); });
        }
        if (!found) return {place.l1, place.l2, INFINITY};
    }
    double l1 = place.l1, l2 = place.l2;
    place.away = max(max(-(1 - l1 - l2) / size(v - u), -l1 / size(v)), -l2 / size(u)) * fabs(area);
    return place;
}

// The largest relative deviation of a patch's derivative from that of its triangle, which is attained at a corner,
// since the derivative is linear.
//
// With du and dv the deviations of the two tangents, the linear map that takes u to du and v to dv has the Wirtinger
// derivatives p / (2i area) and q / (2i area), and the norm |p| + |q| over twice the area.
double deviation(const Complex *corners, Complex d0, Complex d1, Complex d2) {
    Complex u = corners[1] - corners[0], v = corners[2] - corners[0];
    const Complex du[3] = {2 * d2, -2 * d2, 2 * (d0 - d1)}, dv[3] = {2 * d1, 2 * (d0 - d2), -2 * d1};
    double worst = 0.0;
    for (int k = 0; k < 3; k++) {
        Complex p = du[k] * conjugate(v) - dv[k] * conjugate(u), q = dv[k] * u - du[k] * v;
        worst = max(worst, size(p) + size(q));
    }
    return worst / (2 * fabs(cross(u, v)));
}

// The patches of a plane. They neither overlap nor leave gaps, but for rounding.
struct Patches {
    const Complex (*control)[6];
    const double (*boxes)[4];  // least x and y, greatest x and y
    BucketGrid grid;           // of the boxes

    bool may_contain(Index t, Complex z) const {
        const double *box = boxes[t];
        return box[0] <= z.re && z.re <= box[2] && box[1] <= z.im && z.im <= box[3];
    }
};

// The patch that contains a point to within `rounding`, the best of several; -1 for none. The patch `near` (-1 for none)
// is tried first: if the point is clearly inside, no other contains it.
Index patch_at(const Patches &patches, Complex z, double rounding, Index near, Place &place) {
    if (near >= 0 && patches.may_contain(near, z)) {
        place = locate(patches.control[near], z);
        if (place.away < -rounding) return near;
    }
    Index bucket = patches.grid.bucket_at(z), patch = -1;
    if (bucket < 0) return -1;
    place.away = rounding;
    for (Index k = patches.grid.begin[bucket]; k < patches.grid.begin[bucket + 1]; k++) {
        Index t = patches.grid.boxes[k];
        if (!patches.may_contain(t, z)) continue;
        Place found = locate(patches.control[t], z);
        if (!(found.away <= place.away)) continue;
        patch = t, place = found;
        if (found.away <= 0) break;
    }
    return patch;
}

// Shrink bulges until every patch's derivative deviates from that of its triangle by at most `most` (m,). In each round
// all bulges of triangles that deviate too much shrink by the same factor, each once. Returns the number of rounds.
Index shrink(const Complex (*corners)[3], const double *most, const bool *flat, const Index (*sides)[3], Index m,
             Complex *bulge, Index edges) {
    constexpr double SHRINK = 0.7;
    // Bulges that still shrink after this many rounds become 0: 0.7^40 = 6e-7 is as good as linear.
    constexpr Index MAX_ROUNDS = 40;
    Buffer<bool> changed(edges, true), shrinks(edges, false);
    if (!changed || !shrinks) return OUT_OF_MEMORY;
    Index rounds = 0;
    for (bool again = true; again;) {
        again = false, rounds++;
        for (Index t = 0; t < m; t++) {
            Index a = sides[t][0], b = sides[t][1], c = sides[t][2];
            if (flat[t] || !(changed[a] || changed[b] || changed[c])) continue;
            if (!(deviation(corners[t], bulge[a], bulge[b], bulge[c]) <= most[t]))
                shrinks[a] = shrinks[b] = shrinks[c] = again = true;
        }
        double factor = rounds % MAX_ROUNDS ? SHRINK : 0.0;
        for (Index e = 0; e < edges; e++) {
            if (shrinks[e]) bulge[e] = factor * bulge[e];
            changed[e] = shrinks[e], shrinks[e] = false;
        }
    }
    return rounds;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute the parameters of a point on a patch. Returns 0.
//
//   patch  (6,) corners and bulges
//   x      coordinate of the point
//   y      coordinate of the point
//   place  (3,) written: L_1, L_2, and how far outside the patch they lie, in units of the plane
ICCM_EXPORT int64_t iccm_maps_solve_patch(const Complex *patch, double x, double y, double *place) {
    Place found = locate(patch, {x, y});
    place[0] = found.l1, place[1] = found.l2, place[2] = found.away;
    return 0;
}

// Find the patches that contain points, and the parameters there. Returns 0.
//
// Points in a row are often on the same patch, as along a curve or a row of pixels, so the last patch is tried first.
//
//   control     (m, 6) corners and bulges of the patches
//   boxes       (m, 4) least x and y, greatest x and y of each
//   low_x       x of the lower left corner of the bucket grid of these boxes
//   low_y       y of that corner
//   size        side of a bucket
//   columns     number of bucket columns
//   rows_count  number of bucket rows
//   begin       (columns · rows_count + 1,) where each bucket begins in `touching`, row by row
//   touching    patches that touch each bucket
//   points      (p,) points
//   p           number of points
//   rounding    how far outside its patch a point may lie
//   patch       (p,) the patch of each point, written where there is one
//   place       (p, 3) barycentric coordinates, written where there is a patch
ICCM_EXPORT int64_t iccm_maps_locate(const Complex *control, const double *boxes, double low_x, double low_y,
                                     double size, int64_t columns, int64_t rows_count, const int64_t *begin,
                                     const int64_t *touching, const Complex *points, int64_t p, double rounding,
                                     int64_t *patch, double *place) {
    const Patches patches = {
        rows<6>(control), rows<4>(boxes), {{low_x, low_y}, size, columns, rows_count, begin, touching}};
    Index near = -1;
    for (Index i = 0; i < p; i++) {
        Place found;
        Index t = patch_at(patches, points[i], rounding, near, found);
        if (t < 0) continue;
        near = t;
        double *l = place + 3 * i;
        patch[i] = t, l[0] = 1 - found.l1 - found.l2, l[1] = found.l1, l[2] = found.l2;
    }
    return 0;
}

// Compute values and derivatives of patches at points that were located before. Returns 0.
//
// The linear map that takes the sides u, v of the image's triangle to the tangents a, b of the patch has the Wirtinger
// derivatives (a v̄ - b ū) and (b u - a v), both times i / (2 u × v).
//
//   control   (m, 6) corners and bulges of the patches
//   corners   (m, 3) corners in the image
//   triangle  (p,) patch of each point, -1 for none
//   place     (p, 3) barycentric coordinates
//   start     first point to compute
//   stop      end of the points to compute, exclusive
//   p         number of points
//   out       (4, p) the value z, its argument w, z_w and z_w̄, written from start to stop
ICCM_EXPORT int64_t iccm_maps_evaluate(const Complex *control, const Complex *corners, const int64_t *triangle,
                                       const double *place, int64_t start, int64_t stop, int64_t p, Complex *out) {
    for (Index i = start; i < stop; i++) {
        Index t = triangle[i];
        if (t < 0) continue;
        double l0 = place[3 * i], l1 = place[3 * i + 1], l2 = place[3 * i + 2];
        const Complex *c = control + 6 * t, *w = corners + 3 * t;
        Complex u = w[1] - w[0], v = w[2] - w[0], e1 = c[1] - c[0], e2 = c[2] - c[0];
        out[i] = c[0] + (l1 * e1 + l2 * e2 + bulge_at(c, l0, l1, l2));
        out[p + i] = w[0] + (l1 * u + l2 * v);
        Tangents to = tangents(c, e1, e2, l0, l1, l2);
        double half = 0.5 / cross(u, v);
        Complex first = to.first * conjugate(v) - to.second * conjugate(u), second = to.second * u - to.first * v;
        out[2 * p + i] = {-half * first.im, half * first.re};
        out[3 * p + i] = {-half * second.im, half * second.re};
    }
    return 0;
}

// Shrink bulges until no patch's derivative deviates too much from that of its triangle. Returns the number of rounds.
//
//   corners  (m, 3) corners of the triangles
//   most     (m,) largest deviation of each, relative to the derivative
//   flat     (m,) triangles to leave out
//   sides    (m, 3) edge opposite each corner
//   m        number of triangles
//   bulge    (edges,) bulges of the edges, changed
//   edges    number of edges
ICCM_EXPORT int64_t iccm_maps_shrink_bulges(const Complex *corners, const double *most, const bool *flat,
                                            const int64_t *sides, int64_t m, Complex *bulge, int64_t edges) {
    return shrink(rows<3>(corners), most, flat, rows<3>(sides), m, bulge, edges);
}

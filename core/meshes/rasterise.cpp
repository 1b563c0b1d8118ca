// Rasterisation of triangles in texels by edge functions (Pineda, A parallel algorithm for polygon rasterization, 1988)
// in double precision.
#include "iccm/core.h"

namespace iccm {
namespace {

// A corner in texels, x right, y down; texel centres are at half-integers.
struct Point {
    double at[2];
};

// The edge function a x + b y + c, zero on an edge and positive on the triangle's side of it.
struct Edge {
    double a, b, c;
    bool kept;  // whether points on the edge belong to the triangle, as for left and top edges

    double operator()(double x, double y) const { return a * x + b * y + c; }
    bool holds(double x, double y) const {
        const double e = (*this)(x, y);
        return e > 0 || (e == 0 && kept);
    }
};

// Texels first .. last - 1 along an axis.
struct Range {
    Index first, last;
};

// A triangle prepared for rasterisation: its edges, and the range of texels to test.
struct Setup {
    Edge edges[3];
    Range columns, rows;
};

bool before(const Point &p, const Point &q) { return p.at[0] < q.at[0] || (p.at[0] == q.at[0] && p.at[1] < q.at[1]); }

Edge edge(const Point &p, const Point &q) {
    const double a = p.at[1] - q.at[1], b = q.at[0] - p.at[0];
    // anchored at the same end for both triangles of an edge, so that they compute the same number with opposite signs
    const Point &anchor = before(p, q) ? p : q;
    return {a, b, -(a * anchor.at[0] + b * anchor.at[1]), a > 0 || (a == 0 && b > 0)};
}

// The range of texels along an axis whose centres can lie in the triangle, grown by `margin`; limited to start .. stop
// - 1 unless triangles wrap around the grid.
Range range(const Point *t, int axis, Index start, Index stop, double margin, bool wrap) {
    const double low = min(min(t[0].at[axis], t[1].at[axis]), t[2].at[axis]);
    const double high = max(max(t[0].at[axis], t[1].at[axis]), t[2].at[axis]);
    // far outside the grid integers would overflow
    const double far = 1e15, first = ceil(low - 0.5 - margin), last = floor(high - 0.5 + margin) + 1;
    if (!(fabs(first) < far && fabs(last) < far)) return {0, 0};
    if (wrap) return {Index(first), Index(last)};
    return {max(Index(first), start), min(Index(last), stop)};
}

// Whether there is anything to rasterise in rows top .. bottom - 1.
bool set_up(const Point *t, Index width, Index top, Index bottom, double margin, bool wrap, Setup &out) {
    out.rows = range(t, 1, top, bottom, margin, wrap);
    if (out.rows.first >= out.rows.last) return false;
    const double area = (t[1].at[0] - t[0].at[0]) * (t[2].at[1] - t[0].at[1]) -
                        (t[1].at[1] - t[0].at[1]) * (t[2].at[0] - t[0].at[0]);
    if (!(area > 0 || area < 0)) return false;
    for (int k = 0; k < 3; k++) {
        const Point &p = t[k], &q = t[(k + 1) % 3];
        out.edges[k] = area > 0 ? edge(p, q) : edge(q, p);
    }
    out.columns = range(t, 0, 0, width, margin, wrap);
    return out.columns.first < out.columns.last;
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Assign the texels of some rows to the triangles that contain their centres, to the first one if there are several.
//
//   corners      (m, 3, 2) corners in texels, in either orientation; triangles without area are skipped
//   owner        (height, width) triangle of each texel, negative where free; changed in rows top .. bottom - 1
//   wrap         whether parts of triangles outside the grid wrap around to the other side
//
// Returns how often a texel lies in a further triangle.
ICCM_EXPORT int64_t iccm_meshes_fill(const double *corners, int64_t m, int32_t *owner, int64_t height, int64_t width,
                                     int64_t top, int64_t bottom, bool wrap) {
    const Point *points = reinterpret_cast<const Point *>(corners);
    Index overlaps = 0;
    for (Index t = 0; t < m; t++) {
        Setup setup;
        if (!set_up(points + 3 * t, width, top, bottom, 0, wrap, setup)) continue;
        for (Index y = setup.rows.first; y < setup.rows.last; y++) {
            const Index row = wrap ? floor_remainder(y, height) : y;
            if (row < top || row >= bottom) continue;
            for (Index x = setup.columns.first; x < setup.columns.last; x++) {
                const double u = double(x) + 0.5, v = double(y) + 0.5;
                if (!(setup.edges[0].holds(u, v) && setup.edges[1].holds(u, v) && setup.edges[2].holds(u, v))) continue;
                int32_t &texel = owner[row * width + (wrap ? floor_remainder(x, width) : x)];
                if (texel < 0)
                    texel = int32_t(t);
                else
                    overlaps++;
            }
        }
    }
    return overlaps;
}

// Assign texels whose centre is in no triangle to the triangle that reaches farthest into their square.
//
//   corners       (m, 3, 2) as for iccm_meshes_fill
//   chosen        (count,) the candidate triangles
//   owner         (height, width) triangle of each texel; changed
//   centre        (height, width) whether a texel's centre lies in its triangle; such texels keep it
//   nearest       (height, width) distance of a texel's centre from its triangle's edges, infinite before; changed
//   wrap          as for iccm_meshes_fill
ICCM_EXPORT int64_t iccm_meshes_touch(const double *corners, const int64_t *chosen, int64_t count, int32_t *owner,
                                      const bool *centre, float *nearest, int64_t height, int64_t width, bool wrap) {
    const Point *points = reinterpret_cast<const Point *>(corners);
    for (Index n = 0; n < count; n++) {
        Setup setup;
        if (!set_up(points + 3 * chosen[n], width, 0, height, 0.5, wrap, setup)) continue;
        for (Index y = setup.rows.first; y < setup.rows.last; y++)
            for (Index x = setup.columns.first; x < setup.columns.last; x++) {
                const Index texel = floor_remainder(y, height) * width + floor_remainder(x, width);
                if (centre[texel]) continue;
                double away = 0;
                for (const Edge &edge : setup.edges) {
                    const double e = edge(double(x) + 0.5, double(y) + 0.5);
                    if (e <= -0.5 * (fabs(edge.a) + fabs(edge.b))) {  // the whole square lies beyond
                        away = INFINITY;
                        break;
                    }
                    away = max(away, -e / sqrt(edge.a * edge.a + edge.b * edge.b));
                }
                if (away < double(nearest[texel])) {
                    nearest[texel] = float(away);
                    owner[texel] = int32_t(chosen[n]);
                }
            }
    }
    return 0;
}

// Compute the affine functions c0 + cx x + cy y with given values at the corners of triangles; constant on triangles
// without area.
//
//   corners  (m, 3, 2) corners of triangles
//   values   (m, 3, parts) values at the corners
//   out      (m, 3, parts) written: c0, cx and cy
ICCM_EXPORT int64_t iccm_meshes_affine(const double *corners, const double *values, int64_t m, int64_t parts,
                                       double *out) {
    const Point *points = reinterpret_cast<const Point *>(corners);
    for (Index t = 0; t < m; t++, points += 3, values += 3 * parts, out += 3 * parts) {
        const double ax = points[1].at[0] - points[0].at[0], ay = points[1].at[1] - points[0].at[1];
        const double bx = points[2].at[0] - points[0].at[0], by = points[2].at[1] - points[0].at[1];
        const double area = ax * by - ay * bx, inverse = area != 0 ? 1 / area : 0;
        for (Index k = 0; k < parts; k++) {
            const double d1 = values[parts + k] - values[k], d2 = values[2 * parts + k] - values[k];
            const double across = (d1 * by - d2 * ay) * inverse, down = (d2 * ax - d1 * bx) * inverse;
            out[k] = values[k] - across * points[0].at[0] - down * points[0].at[1];
            out[parts + k] = across, out[2 * parts + k] = down;
        }
    }
    return 0;
}

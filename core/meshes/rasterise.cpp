// Triangles and the texels that they cover: edge functions (Pineda, A parallel algorithm for polygon rasterization,
// 1988) in double precision.
#include "iccm/core.h"

namespace iccm {
namespace {

// A corner in texels, x right, y down; texel centres are at + 0.5.
struct Point {
    double at[2];
};

// a x + b y + c, which is zero on an edge and positive on the triangle's side of it.
struct Edge {
    double a, b, c;
    bool kept;  // points on the edge belong to the triangle: it is a left or a top one

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

// A triangle ready to be rasterised: its edges, and the texels to look at.
struct Setup {
    Edge edges[3];
    Range columns, rows;
};

bool before(const Point &p, const Point &q) { return p.at[0] < q.at[0] || (p.at[0] == q.at[0] && p.at[1] < q.at[1]); }

Edge edge(const Point &p, const Point &q) {
    const double a = p.at[1] - q.at[1], b = q.at[0] - p.at[0];
    // anchored on the same end for both triangles of an edge: they compute the same number, opposite in sign
    const Point &anchor = before(p, q) ? p : q;
    return {a, b, -(a * anchor.at[0] + b * anchor.at[1]), a > 0 || (a == 0 && b > 0)};
}

// The texels whose centres can lie in the triangle along an axis, grown by `margin`; unless triangles wrap around the
// grid, those among start .. stop - 1.
Range range(const Point *t, int axis, Index start, Index stop, double margin, bool wrap) {
    const double low = min(min(t[0].at[axis], t[1].at[axis]), t[2].at[axis]);
    const double high = max(max(t[0].at[axis], t[1].at[axis]), t[2].at[axis]);
    // far outside the grid, where nothing is, whole numbers would overflow
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

// Give the texels of some rows to the triangles that hold their centres, the first one winning.
//
//   corners      (m, 3, 2) in texels; either orientation; without area: skipped
//   owner        (height, width) negative where free; written in rows top .. bottom - 1
//   wrap         whether what lies outside the grid comes in on the other side
//
// Returns how many times a texel lies in a further triangle.
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

// Give texels without a centre in any triangle to the triangle that enters their square the most.
//
//   corners       (m, 3, 2) as for iccm_meshes_fill
//   chosen        (count,) the triangles that may have them
//   owner         (height, width) written
//   centre        (height, width) whether a texel's centre lies in its triangle: those stay
//   nearest       (height, width) written: the distance of its centre from its triangle's edges, infinite before
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

// The affine functions c0 + cx x + cy y that take the corners of triangles to values; flat where there is no area.
//
//   corners  (m, 3, 2)
//   values   (m, 3, parts)
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

// Folded maps: sheets of triangles whose images overlap, and estimates of how much the inverse bends.

#include "iccm/core.h"

namespace iccm {
namespace {

// Sheets of triangles, as linked lists that can be merged.
struct Sheets {
    Index *sheet;  // sheet of each triangle, named by its first triangle; -1 for none yet
    Index *next;   // next triangle of the same sheet, -1 at the end
    Index *last;   // last triangle of each sheet
    Index *size;   // of each sheet

    void begin(Index t) { sheet[t] = t, next[t] = -1, last[t] = t, size[t] = 1; }
};

// The width of the widest path from the triangle with the largest clearance to each of the others, where a path's width
// is its least clearance.
//
// As in Kruskal's algorithm, triangles are added in the order of decreasing clearance, and sheets that touch are
// merged. Triangles whose sheet is merged with that of the first triangle are reached through the triangle that joins
// both, whose clearance is the least so far.
void flood(const Index *widest, Index count, const Index (*across)[3], const double *clearance, Sheets sheets,
           double *reached) {
    for (Index i = 0; i < count; i++) {
        Index t = widest[i], first = widest[0];
        sheets.begin(t);
        if (t == first) reached[t] = clearance[t];
        for (int k = 0; k < 3; k++) {
            Index u = across[t][k];
            if (u < 0 || sheets.sheet[u] < 0 || sheets.sheet[u] == sheets.sheet[t]) continue;
            // The smaller sheet is relabelled, so that each triangle is relabelled at most log₂ m times; the first
            // sheet keeps its name.
            Index a = sheets.sheet[t], b = sheets.sheet[u];
            if (b == first || (a != first && sheets.size[b] > sheets.size[a])) swap(a, b);
            sheets.next[sheets.last[a]] = b, sheets.last[a] = sheets.last[b], sheets.size[a] += sheets.size[b];
            for (Index v = b; v >= 0; v = sheets.next[v]) {
                sheets.sheet[v] = a;
                if (a == first) reached[v] = clearance[t];
            }
        }
    }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Compute the width of the widest path to each triangle from the one with the largest clearance. Returns 0.
//
//   widest     (k,) triangles that are not folded, by decreasing clearance
//   k          number of unfolded triangles
//   across     (m, 3) neighbours of all triangles, -1 for none
//   clearance  (m,) distance of each triangle's image from that of the boundary
//   m          number of triangles
//   reached    (m,) written where there is a path: the least clearance on the widest one
ICCM_EXPORT int64_t iccm_maps_flood(const int64_t *widest, int64_t k, const int64_t *across, const double *clearance,
                                    int64_t m, double *reached) {
    Buffer<Index> sheet(m, -1), next(m), last(m), size(m);
    if (!sheet || !next || !last || !size) return OUT_OF_MEMORY;
    flood(widest, k, rows<3>(across), clearance, {sheet.data, next.data, last.data, size.data}, reached);
    return 0;
}

// Estimate how far the inverse of a map deviates from its linear interpolation in each triangle. Returns 0.
//
// Along an edge e a smooth function differs from its chord by about |slope(b) e - slope(a) e| / 8.
//
//   faces   (m, 3) triangles
//   m       number of triangles
//   w       (n,) vertices
//   z_w     (n,) Wirtinger derivatives of the inverse at the vertices; NaN where unknown, where the estimate is
//           infinite
//   z_wbar  (n,) the same with respect to the conjugate
//   out     (m,) written
ICCM_EXPORT int64_t iccm_maps_bends(const int64_t *faces, int64_t m, const Complex *w, const Complex *z_w,
                                    const Complex *z_wbar, double *out) {
    for (Index t = 0; t < m; t++) {
        double worst = 0.0;
        for (int k = 0; k < 3; k++) {
            Index a = faces[3 * t + k], b = faces[3 * t + (k == 2 ? 0 : k + 1)];
            Complex e = w[b] - w[a];
            double off = size((z_w[b] - z_w[a]) * e + (z_wbar[b] - z_wbar[a]) * conjugate(e)) / 8;
            worst = off == off ? max(worst, off) : INFINITY;
        }
        out[t] = worst;
    }
    return 0;
}

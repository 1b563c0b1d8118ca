// Edges of triangulations and their adjacent triangles.

#include "iccm/core.h"
#include "iccm/flips.h"

namespace iccm {
namespace {

// A stable counting sort: `sorted` gets `order` sorted by key[order]. `place` (bound + 1,) is work space.
void sort_by_counting(const Index *key, const Index *order, Index count, Index bound, Index *place, Index *sorted) {
    for (Index k = 0; k <= bound; k++) place[k] = 0;
    for (Index i = 0; i < count; i++) place[key[i] + 1]++;
    for (Index k = 0; k < bound; k++) place[k + 1] += place[k];
    for (Index i = 0; i < count; i++) sorted[place[key[order[i]]]++] = order[i];
}

// The neighbours of triangles across their sides, -1 for none.
Index join(const Index (*faces)[3], Index count, Index vertices, Index (*across)[3]) {
    // Linked lists of the sides that begin at each vertex: the last one, and the previous one of each. Side k of t is 3
    // t + k.
    Buffer<Index> last(vertices, -1), previous(3 * count);
    if (!last || !previous) return OUT_OF_MEMORY;
    for (Index t = 0; t < count; t++)
        for (int k = 0; k < 3; k++) {
            Index start = faces[t][after(k)], end = faces[t][before(k)];
            across[t][k] = -1;
            previous[3 * t + k] = last[start];
            last[start] = 3 * t + k;
            // The neighbour has the same side in the opposite direction.
            for (Index side = last[end]; side >= 0; side = previous[side]) {
                Index u = side / 3;
                int j = static_cast<int>(side % 3);
                if (faces[u][before(j)] == start) {
                    across[t][k] = u, across[u][j] = t;
                    break;
                }
            }
        }
    return 0;
}

// Edges, numbered in the order of their first occurrence in the triangles.
struct Edges {
    Index (*ends)[2];                // vertices, with the edge's first triangle on the left
    Index (*sides)[3];               // the edge on each side of the triangles
    Index *rim, *beside, *opposite;  // edges with one triangle, that triangle, and the corner opposite
    Index count, rim_count;
};

void number(const Index (*faces)[3], const Index (*across)[3], Index m, Edges &edges) {
    edges.count = edges.rim_count = 0;
    for (Index t = 0; t < m; t++)
        for (int k = 0; k < 3; k++) {
            Index u = across[t][k], start = faces[t][after(k)], end = faces[t][before(k)];
            if (u >= 0 && u < t) {
                edges.sides[t][k] = edges.sides[u][opposite(faces[u], start, end)];
                continue;
            }
            if (u < 0) {
                Index at = edges.rim_count++;
                edges.rim[at] = edges.count, edges.beside[at] = t, edges.opposite[at] = k;
            }
            Index *ends = edges.ends[edges.count];
            ends[0] = start, ends[1] = end;
            edges.sides[t][k] = edges.count++;
        }
}

}  // namespace
}  // namespace iccm

using namespace iccm;

// Find the neighbours of triangles across their sides. Returns 0.
//
//   faces     (m, 3) triangles
//   m         number of triangles
//   vertices  a number above all vertex indices
//   across    (m, 3) written: the triangle beyond the side opposite each corner, -1 for none
ICCM_EXPORT int64_t iccm_maps_neighbours(const int64_t *faces, int64_t m, int64_t vertices, int64_t *across) {
    return join(rows<3>(faces), m, vertices, rows<3>(across));
}

// List the edges of triangles, in the order of their first occurrence. Returns their number.
//
//   faces     (m, 3) triangles
//   across    (m, 3) their neighbours
//   m         number of triangles
//   ends      (3m, 2) written: the vertices of each edge
//   sides     (m, 3) written: the edge of each side
//   rim       (3m,) written: edges with one triangle
//   beside    (3m,) written: that triangle
//   opposite  (3m,) written: its corner opposite the edge
//   rim_count (1,) written: number of edges with one triangle
ICCM_EXPORT int64_t iccm_maps_number_edges(const int64_t *faces, const int64_t *across, int64_t m, int64_t *ends, int64_t *sides,
                                           int64_t *rim, int64_t *beside, int64_t *opposite, int64_t *rim_count) {
    Edges edges = {rows<2>(ends), rows<3>(sides), rim, beside, opposite, 0, 0};
    number(rows<3>(faces), rows<3>(across), m, edges);
    *rim_count = edges.rim_count;
    return edges.count;
}

// Sort pairs of numbers by the first, then by the second one; equal pairs stay in order. Returns 0.
//
//   first   (n,) numbers
//   second  (n,) numbers
//   n       number of pairs
//   bound   a number above all of them; none is negative
//   order   (n,) written: indices into `first` and `second`
ICCM_EXPORT int64_t iccm_maps_order_pairs(const int64_t *first, const int64_t *second, int64_t n, int64_t bound,
                                          int64_t *order) {
    Buffer<Index> place(bound + 1), by_second(n);
    if (!place || !by_second) return OUT_OF_MEMORY;
    for (Index i = 0; i < n; i++) order[i] = i;
    sort_by_counting(second, order, n, bound, place.data, by_second.data);
    sort_by_counting(first, by_second.data, n, bound, place.data, order);
    return 0;
}

// Sort numbers; equal ones stay in order. Returns 0.
//
//   keys   (n,) numbers
//   n      their number
//   bound  a number above all of them; none is negative
//   order  (n,) written: indices into `keys`
ICCM_EXPORT int64_t iccm_maps_order(const int64_t *keys, int64_t n, int64_t bound, int64_t *order) {
    Buffer<Index> place(bound + 1), given(n);
    if (!place || !given) return OUT_OF_MEMORY;
    for (Index i = 0; i < n; i++) given[i] = i;
    sort_by_counting(keys, given.data, n, bound, place.data, order);
    return 0;
}

// Minimum degree ordering of a mesh's vertices, and the pattern of the Cholesky factor of its matrices.
#include "iccm/core.h"

using namespace iccm;

namespace {

// Rings of the vertices of equal degree: circular doubly linked lists, each with a head that is not a vertex.
struct Rings {
    Index *after, *before;

    void enter(Index v, Index head) {
        Index first = after[head];
        before[first] = v;
        after[v] = first;
        before[v] = head;
        after[head] = v;
    }

    void leave(Index v) {
        after[before[v]] = after[v];
        before[after[v]] = before[v];
    }
};

}  // namespace

// The minimum degree ordering on the quotient graph (George and Liu, The Evolution of the Minimum Degree Ordering
// Algorithm, SIAM Review 31, 1989). The graph of a mesh's matrices is a union of cliques, the triangles, so that every
// edge lies in an element from the start. Eliminating a vertex merges the elements around it into one, whose vertices
// are its column of the factor.
//
//   starts   (n + 1,) where the elements of each vertex begin in `around`
//   around   (3m,) elements of the vertices, at first the triangles; changed
//   count    (n,) number of elements of each vertex; changed
//   degree   (n,) degrees of the vertices, at first the numbers of triangles, at most n; changed
//   after    (2n + 1,) the next entry in the ring of the vertices of degree d, whose head is n + d; at first itself;
//            changed
//   before   (2n + 1,) the previous entry in the ring; changed
//   members  (room,) vertices of the elements, at first of the triangles; the columns of the factor are appended
//   first    (m + n + 1,) where each element begins in `members`; changed
//   size     (m + n,) sizes of the elements; 0: part of a later one; changed
//   marked   (n,) zeros; changed
//   order    (n,) the order, written
//
// Returns 1, or 0 if `members` is too small.
ICCM_EXPORT int64_t iccm_linalg_minimum_degree(const int64_t *starts, int64_t *around, int64_t *count, int64_t *degree,
                                               int64_t *after, int64_t *before, int64_t *members, int64_t room,
                                               int64_t *first, int64_t *size, int64_t *marked, int64_t *order,
                                               int64_t n, int64_t m) {
    Rings rings{after, before};
    Index least = 0, stamp = 0;
    for (Index v = n - 1; v >= 0; v--) rings.enter(v, n + degree[v]);
    for (Index made = m; made < m + n; made++) {
        while (after[n + least] == n + least) least++;
        Index pivot = after[n + least], end = first[made];
        if (end + n > room) return 0;
        rings.leave(pivot);
        order[made - m] = pivot;
        marked[pivot] = ++stamp;
        // the elements of the pivot are merged into one
        for (Index p = starts[pivot]; p < starts[pivot] + count[pivot]; p++) {
            Index e = around[p];
            for (Index j = first[e]; j < first[e] + size[e]; j++) {
                Index v = members[j];
                if (marked[v] == stamp) continue;
                marked[v] = stamp;
                members[end++] = v;
            }
            size[e] = 0;
        }
        first[made + 1] = end;
        size[made] = end - first[made];
        for (Index c = first[made]; c < end; c++) {
            Index v = members[c];
            rings.leave(v);
            // its elements are the remaining ones and the new one; its degree is the number of their vertices
            Index left = starts[v], wide = 0;
            stamp++;
            for (Index p = starts[v]; p < starts[v] + count[v]; p++)
                if (size[around[p]] > 0) around[left++] = around[p];
            around[left] = made;
            count[v] = left + 1 - starts[v];
            for (Index p = starts[v]; p <= left; p++) {
                Index e = around[p];
                for (Index j = first[e]; j < first[e] + size[e]; j++) {
                    if (marked[members[j]] == stamp) continue;
                    marked[members[j]] = stamp;
                    wide++;
                }
            }
            degree[v] = wide;
            least = min(least, wide);
            rings.enter(v, n + wide);
        }
    }
    return 1;
}

// The columns of the factor for a given order: each is the union of its vertex's neighbours and the columns of its
// children in the elimination tree (Liu, The Role of Elimination Trees in Sparse Factorization, SIAM Journal on Matrix
// Analysis 11, 1990).
//
//   starts   (n + 1,) where the triangles of each vertex begin in `around`
//   around   (3m,) triangles of the vertices
//   corners  (3m,) corners of the triangles
//   order    (n,) vertices in the order of elimination
//   ends     (n + 1,) where each column begins in `members`; all written but the first, which is 0
//   members  (room,) vertices of the columns, written
//   work     (4n,) written
//
// Returns 1, or 0 if `members` is too small.
ICCM_EXPORT int64_t iccm_linalg_fill(const int64_t *starts, const int64_t *around, const int64_t *corners,
                                     const int64_t *order, int64_t *ends, int64_t *members, int64_t room,
                                     int64_t *work, int64_t n) {
    Index *rank = work, *marked = work + n, *child = work + 2 * n, *sibling = work + 3 * n;
    for (Index c = 0; c < n; c++) {
        rank[order[c]] = c;
        marked[c] = child[c] = sibling[c] = -1;
    }
    for (Index c = 0; c < n; c++) {
        Index end = ends[c], least = n;
        if (end + n > room) return 0;
        auto add = [&](Index v) {
            if (rank[v] <= c || marked[v] == c) return;
            marked[v] = c;
            members[end++] = v;
            least = min(least, rank[v]);
        };
        for (Index p = starts[order[c]]; p < starts[order[c] + 1]; p++)
            for (Index k = 0; k < 3; k++) add(corners[3 * around[p] + k]);
        for (Index below = child[c]; below >= 0; below = sibling[below])
            for (Index p = ends[below]; p < ends[below + 1]; p++) add(members[p]);
        ends[c + 1] = end;
        if (least < n) {  // the parent is the column's first row, whose column contains the rest
            sibling[c] = child[least];
            child[least] = c;
        }
    }
    return 1;
}

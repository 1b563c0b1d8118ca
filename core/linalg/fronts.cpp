// Grouping of a sparse Cholesky factor's columns into dense blocks, the fronts.
#include "iccm/core.h"

using namespace iccm;

// Relaxed supernodes (Ashcraft and Grimes, The Influence of Relaxed Supernode Partitions on the Multifrontal Method,
// ACM Transactions on Mathematical Software 15, 1989): an order in which children come right before their parents, and
// fronts of consecutive columns.
//
//   parents  (n,) parents of the columns in the elimination tree; n: none
//   counts   (n,) rows of each column below the diagonal
//   size     (n + 1,) ones; changed: the number of columns of each subtree
//   free     (n + 1,) all n; changed: the end of the free places of each subtree
//   old      (n,) written: the columns in their new order
//   zeros    (n,) written: the number of zeros that each front stores
//   place    (n,) the new place of each column, written
//   starts   (n + 1,) where each front begins, written
//   last     (n,) the old place of the last column of each front, written
//   few      least number of columns of a front that has an adjacent child to join with
//   share    largest share of a front that may be zeros
//
// Returns the number of fronts.
ICCM_EXPORT int64_t iccm_linalg_supernodes(const int64_t *parents, const int64_t *counts, int64_t *size,
                                           int64_t *free, int64_t *old, int64_t *zeros, int64_t *place,
                                           int64_t *starts, int64_t *last, int64_t n, int64_t few, double share) {
    for (Index c = 0; c < n; c++) size[parents[c]] += size[c];
    // postorder: each column takes the last free place of its parent's subtree, its own subtree the places before
    for (Index c = n - 1; c >= 0; c--) {
        free[c] = free[parents[c]] - 1;
        place[c] = free[c];
        old[free[c]] = c;
        free[parents[c]] -= size[c];
    }
    Index number = 0;
    for (Index at = 0; at < n; at++) {
        Index c = old[at];
        starts[number] = at;
        last[number] = c;
        zeros[number] = 0;
        number++;
        while (number > 1 && parents[last[number - 2]] == last[number - 1]) {
            Index above = number - 1, below = number - 2;
            // joined with its child's front right before it, a front stores `empty` zeros but saves an update
            Index more = at + 1 - starts[above], fewer = starts[above] - starts[below];
            Index empty = zeros[above] + zeros[below] + fewer * (more + counts[c] - counts[last[below]]);
            Index whole = (fewer + more) * (fewer + more + 2 * counts[c]) / 2;
            if (fewer + more > few && double(empty) > share * double(whole)) break;
            last[below] = c;
            zeros[below] = empty;
            number--;
        }
    }
    starts[number] = n;
    return number;
}

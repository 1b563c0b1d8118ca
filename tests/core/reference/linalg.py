"""Elimination order and fronts."""

import numpy as np

LEAST_FRONT_VERTICES, MOST_ZEROS_SHARE = 4, 0.2


def fill(starts, around, corners, order, ends, members):
    """Compute the columns of the factor for an order; return False if there is not enough room.

    Args:
        starts: (n + 1,) where the triangles of each vertex begin in `around`.
        around: (3m,) triangles at the vertices.
        corners: (3m,) vertices of the triangles.
        order: (n,) vertices in order of elimination.
        ends: (n + 1,) where each column begins in `members`, written.
        members: vertices of the columns, written.
    """
    n = order.size
    rank, marked = np.empty(n, np.int64), np.full(n, -1)
    child, sibling = np.full(n, -1), np.full(n, -1)  # of columns: each is contained in that of its first row
    for c in range(n):
        rank[order[c]] = c
    for c in range(n):
        end, least = ends[c], n
        if end + n > members.size:
            return False
        for p in range(starts[order[c]], starts[order[c] + 1]):
            for v in corners[3 * around[p] : 3 * around[p] + 3]:
                if rank[v] > c and marked[v] != c:
                    marked[v], members[end], least = c, v, min(least, rank[v])
                    end += 1
        below = child[c]
        while below >= 0:
            for v in members[ends[below] : ends[below + 1]]:
                if rank[v] > c and marked[v] != c:
                    marked[v], members[end], least = c, v, min(least, rank[v])
                    end += 1
            below = sibling[below]
        ends[c + 1] = end
        if least < n:
            sibling[c], child[least] = child[least], c
    return True


def _enter(v, ring, after, before):
    """Insert a vertex at the front of a ring."""
    first = after[ring]
    before[first], after[v], before[v], after[ring] = v, first, ring, v


def _leave(v, after, before):
    """Remove a vertex from its ring."""
    after[before[v]], before[after[v]] = after[v], before[v]


def minimum_degree(starts, around, count, degree, after, before, members, first, size, marked, order):
    """Eliminate the vertices one by one; return False if there is not enough room.

    Args:
        starts: (n + 1,) where the elements of each vertex begin in `around`.
        around: (3m,) elements at the vertices, initially the triangles.
        count: (n,) number of elements at each vertex.
        degree: (n,) of the vertices, initially the number of triangles, at most n.
        after: (2n + 1,) successor in a ring of vertices with the same degree d, or of the head n + d; initially itself.
        before: the predecessor.
        members: vertices of the elements, initially of the triangles; the columns of the factor are appended.
        first: (m + n + 1,) where each element begins in `members`.
        size: (m + n,) of the elements; 0 if part of a later one.
        marked: (n,) zeros.
        order: (n,) the order, written.
    """
    n = order.size
    m = size.size - n
    least = stamp = 0
    for v in range(n - 1, -1, -1):
        _enter(v, n + degree[v], after, before)
    for new in range(m, m + n):
        while after[n + least] == n + least:
            least += 1
        pivot, end = after[n + least], first[new]
        if end + n > members.size:
            return False
        _leave(pivot, after, before)
        order[new - m] = pivot
        stamp += 1
        marked[pivot] = stamp
        # the elements of the pivot are merged into one with all their vertices
        for p in range(starts[pivot], starts[pivot] + count[pivot]):
            e = around[p]
            for j in range(first[e], first[e] + size[e]):
                v = members[j]
                if marked[v] != stamp:
                    marked[v], members[end] = stamp, v
                    end += 1
            size[e] = 0
        first[new + 1], size[new] = end, end - first[new]
        for c in range(first[new], end):
            v = members[c]
            _leave(v, after, before)
            # its elements are those that remain and the new one; the number of their vertices is its degree
            kept, wide = starts[v], 0
            stamp += 1
            for p in range(starts[v], starts[v] + count[v]):
                e = around[p]
                if size[e] > 0:
                    around[kept] = e
                    kept += 1
            around[kept], count[v] = new, kept + 1 - starts[v]
            for p in range(starts[v], kept + 1):
                e = around[p]
                for j in range(first[e], first[e] + size[e]):
                    if marked[members[j]] != stamp:
                        marked[members[j]] = stamp
                        wide += 1
            degree[v] = wide
            least = min(least, degree[v])
            _enter(v, n + degree[v], after, before)
    return True


def supernodes(parents, counts, size, free, old, zeros, place, starts, last):
    """Compute an order in which children come right before their parents, and its fronts; return their number.

    Args:
        parents: (n,) of the columns in the elimination tree; n for none.
        counts: (n,) rows of each column below the diagonal.
        size: (n + 1,) ones, written: the columns of each subtree.
        free: (n + 1,) initially n, written: end of the places that each subtree still has.
        old, zeros: (n,) written: the columns in their new order, and the number of zeros in each front.
        place: (n,) the new place of each column, written.
        starts: (n + 1,) where each front begins, written.
        last: (n,) the old place of the last column of each front, written.
    """
    n = parents.size
    for c in range(n):
        size[parents[c]] += size[c]
    # postorder: each column takes the last free place of its parent's subtree, and its own subtree those before
    for c in range(n - 1, -1, -1):
        free[c] = free[parents[c]] - 1
        place[c], old[free[c]] = free[c], c
        free[parents[c]] -= size[c]
    number = 0
    for position in range(n):
        c = old[position]
        starts[number], last[number] = position, c
        number += 1
        zeros[number - 1] = 0
        while number > 1 and parents[last[number - 2]] == last[number - 1]:
            above, below = number - 1, number - 2
            # merged with the child's front right before it, a front would store `empty` zeros, and save an update
            more = position + 1 - starts[above]
            fewer = starts[above] - starts[below]
            empty = zeros[above] + zeros[below] + fewer * (more + counts[c] - counts[last[below]])
            whole = (fewer + more) * (fewer + more + 2 * counts[c]) // 2
            if fewer + more > LEAST_FRONT_VERTICES and empty > MOST_ZEROS_SHARE * whole:
                break
            last[below], zeros[below] = c, empty
            number -= 1
    starts[number] = n
    return number

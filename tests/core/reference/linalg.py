"""Ordering and fronts."""

import numpy as np

LEAST_FRONT_VERTICES, MOST_ZEROS_SHARE = 4, 0.2


def fill(starts, around, corners, order, ends, members):
    """Fills in the columns of the factor for an order; False where there is too little room.

    Args:
        starts: (n + 1,) where the triangles of each vertex begin in `around`.
        around: (3m,) triangles of the vertices.
        corners: (3m,) of the triangles.
        order: (n,) vertices as they are eliminated.
        ends: (n + 1,) where each column begins in `members`, written.
        members: vertices of the columns, written.
    """
    n = order.size
    rank, marked = np.empty(n, np.int64), np.full(n, -1)
    child, sibling = np.full(n, -1), np.full(n, -1)  # of columns: each is part of that of its first row
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
    """Puts a vertex first into a ring."""
    first = after[ring]
    before[first], after[v], before[v], after[ring] = v, first, ring, v


def _leave(v, after, before):
    """Takes it out."""
    after[before[v]], before[after[v]] = after[v], before[v]


def minimum_degree(starts, around, count, degree, after, before, members, first, size, marked, order):
    """Eliminates the vertices one by one; False where there is too little room.

    Args:
        starts: (n + 1,) where the elements of each vertex begin in `around`.
        around: (3m,) elements of the vertices, at first the triangles.
        count: (n,) how many elements each vertex has.
        degree: (n,) of the vertices, at first the number of triangles, n at most.
        after: (2n + 1,) the next in a ring of vertices of one degree d and of n + d; at first itself.
        before: the one before.
        members: vertices of the elements, at first of the triangles; the columns of the factor are appended.
        first: (m + n + 1,) where each element begins in `members`.
        size: (m + n,) of the elements; 0: part of a later one.
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
        # the elements of the pivot become one, of all their vertices
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
            # its elements are those that are left and the new one; how many vertices these have is its degree
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
    """Fills in an order in which children come right before their parents, and its fronts; how many there are.

    Args:
        parents: (n,) of the columns in the elimination tree; n: none.
        counts: (n,) rows of each column below the diagonal.
        size: (n + 1,) ones, written: the columns of each subtree.
        free: (n + 1,) of n, written: the place after the last one that each subtree has left.
        old, zeros: (n,) written: the columns in their new order, and the zeros of each front.
        place: (n,) the new place of each column, written.
        starts: (n + 1,) where each front begins, written.
        last: (n,) the old place of the last column of each front, written.
    """
    n = parents.size
    for c in range(n):
        size[parents[c]] += size[c]
    # postorder: each column takes the last place that its parent's subtree has left, its own subtree the ones before
    for c in range(n - 1, -1, -1):
        free[c] = free[parents[c]] - 1
        place[c], old[free[c]] = free[c], c
        free[parents[c]] -= size[c]
    number = 0
    for at in range(n):
        c = old[at]
        starts[number], last[number] = at, c
        number += 1
        zeros[number - 1] = 0
        while number > 1 and parents[last[number - 2]] == last[number - 1]:
            above, below = number - 1, number - 2
            # joined with the child's front right before it, a front would store `empty` zeros, and save an update
            more = at + 1 - starts[above]
            fewer = starts[above] - starts[below]
            empty = zeros[above] + zeros[below] + fewer * (more + counts[c] - counts[last[below]])
            whole = (fewer + more) * (fewer + more + 2 * counts[c]) // 2
            if fewer + more > LEAST_FRONT_VERTICES and empty > MOST_ZEROS_SHARE * whole:
                break
            last[below], zeros[below] = c, empty
            number -= 1
    starts[number] = n
    return number

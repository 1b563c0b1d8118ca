"""The kernels of iccm.pixels in plain Python."""

import math

import numpy as np

NOTHING = 1e-6
FILLED, TOUCHED = 1, 2


def cover(low, high, sign, area, turns, out, inside):
    """Compute both row by row, so that the sums stay in the processor's cache.

    Args:
        low, high: (s,) lower and upper ends of the segments, *y down*.
        sign: (s,) 1, or -1 where a segment runs from its upper end to the lower.
        area: (width + 2,) zeros; differences of the signed area along a row.
        turns: (width + 1,) zeros; the same for the winding number of the pixels' centres.
        out, inside: (rows, width), written; `inside` may have no rows.
    """
    width, whether = out.shape[1], inside.shape[0] > 0
    for i in range(out.shape[0]):
        for s in range(low.size):
            if high[s].imag >= i and low[s].imag < i + 1:
                add(low[s], high[s], sign[s], i, area, turns, width)
        total, turn, value = 0.0, 0, 0.0
        for j in range(width):
            if area[j] != 0 or turns[j] != 0:
                total += area[j]
                turn += turns[j]
                area[j], turns[j] = 0.0, 0
                value = abs(total)  # values that are 0 or 1 up to rounding become exact
                value = 0.0 if value < NOTHING else (1.0 if value > 1 - NOTHING else value)
            out[i, j] = value
            if whether:
                inside[i, j] = turn != 0
        area[width], area[width + 1], turns[width] = 0.0, 0.0, 0


def add(a, b, sign, i, area, turns, width):
    """Add the contribution of the segment from a up to b to row i."""
    slope = (b.real - a.real) / (b.imag - a.imag)
    y0, y1 = max(a.imag, float(i)), min(b.imag, i + 1.0)
    if a.imag <= i + 0.5 < b.imag:
        x = a.real + (i + 0.5 - a.imag) * slope
        turns[min(max(math.ceil(x - 0.5), 0), width)] += int(sign)
    if y1 > y0:
        x0 = a.real + (y0 - a.imag) * slope
        x1 = a.real + (y1 - a.imag) * slope
        spread(area, min(x0, x1), max(x0, x1), sign * (y1 - y0), width)


def spread(out, x0, x1, height, width):
    """Distribute `height` over the pixels that a piece of a segment within one row passes, x0 <= x1.

    A pixel left of the piece gets nothing, one right of it all of `height`: the running sum of `out` is the area.
    """
    if x1 <= 0:
        out[0] += height
        return
    if x0 >= width:
        return
    lo, hi = max(x0, 0.0), min(x1, float(width))
    if x1 - x0 < 1e-12:
        j = min(int(lo), width - 1)
        part = height * (j + 1 - lo)
        out[j] += part
        out[j + 1] += height - part
        return
    density = height / (x1 - x0)
    out[0] += density * (lo - x0)
    before = 0.0  # total of this piece in the pixels so far
    for j in range(int(lo), min(math.ceil(hi), width)):
        l0, l1 = max(lo, j), min(hi, j + 1)
        done = density * (l1 - lo)
        part = density * (l1 - l0) * (j + 1 - 0.5 * (l0 + l1)) + density * (l0 - lo)
        out[j] += part - before
        before = part
        if j + 1 >= hi:
            out[j + 1] += done - before
            before = done


def fill(corners, powers, chosen, reach, row, covered, z, right, down, state):
    """Write the pixels whose centres lie in the chosen triangles; NaN elsewhere.

    Corners are given with pixel centres at whole numbers. Works row by row, since a band of the output exceeds the
    processor's cache.

    Args:
        corners: (m, 3) of all triangles.
        powers: (m, 6) coefficients of the patches.
        chosen: (t,) the triangles that may touch the band.
        reach: (t, 2) their least and greatest y.
        row: first row of the band.
        covered: (rows, width) area of each pixel.
        z, right, down: (rows, width), written; the last two may have no rows.
        state: (rows, width), EMPTY; written: FILLED, or TOUCHED for a pixel that is partly covered but whose centre is
            not.

    Returns:
        The number of FILLED pixels.
    """
    rows, width = z.shape
    slopes = right.shape[0] > 0
    nothing = complex(np.nan, np.nan)
    count = 0
    for i in range(rows):
        line = float(i + row)
        for n in range(chosen.size):
            if not reach[n, 0] <= line < reach[n, 1]:
                continue
            c, k = corners[chosen[n]], powers[chosen[n]]
            first, last = span(c, line, width)
            if first >= last:
                continue
            # along a row, the quadratic patch is start + slope x + k[3] x², and its derivatives are linear
            y = line - c[0].imag
            x0 = first - c[0].real
            start = k[0] + y * (k[2] + y * k[5])
            slope = k[1] + y * k[4]
            fall = k[2] + 2 * y * k[5]
            a, s = z[i, first:last], state[i, first:last]
            sr, si, pr, pi, qr, qi = start.real, start.imag, slope.real, slope.imag, k[3].real, k[3].imag
            fr, fi, gr, gi = fall.real, fall.imag, k[4].real, k[4].imag
            for j in range(last - first):
                x = x0 + j
                a[j] = complex(sr + x * (pr + x * qr), si + x * (pi + x * qi))
                s[j] = FILLED
            if slopes:
                b, e = right[i, first:last], down[i, first:last]
                for j in range(last - first):
                    x = x0 + j
                    b[j] = complex(pr + 2 * x * qr, pi + 2 * x * qi)
                    e[j] = complex(fr + x * gr, fi + x * gi)
        for j in range(width):
            if state[i, j] == FILLED:
                count += 1
                continue
            z[i, j] = nothing
            if slopes:
                right[i, j] = down[i, j] = nothing
            if covered[i, j] > 0:
                state[i, j] = TOUCHED
    return count


def span(c, y, width):
    """Return the pixels first .. last - 1 of the line at y that lie in a triangle."""
    low, high = np.inf, -np.inf
    for k in range(3):
        p, q = c[k], c[(k + 1) % 3]
        if p.imag > q.imag:  # in the same direction for both triangles of a side
            p, q = q, p
        if p.imag <= y < q.imag:
            x = p.real + (y - p.imag) * ((q.real - p.real) / (q.imag - p.imag))
            low, high = min(low, x), max(high, x)
    if not low <= high:
        return 0, 0
    return int(np.ceil(max(low, 0.0))), int(np.ceil(min(high, float(width))))

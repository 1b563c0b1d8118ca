"""The passes over an OBJ file; `data` is an array of int64, whose sums do not overflow like those of bytes."""

import numpy as np

LF, CR, TAB, SPACE, HASH, PLUS, MINUS, DOT, SLASH, BACKSLASH = 10, 13, 9, 32, 35, 43, 45, 46, 47, 92
OTHER, VERTEX, TEXTURE, NORMAL, FACE, STATEMENT = range(6)
FEW_CORNERS, BAD_INDEX, FEW_NUMBERS = 1, 2, 3
ABSENT = -1
OUTSIDE = -2  # an index that reaches before the first vertex
POWERS = 10.0 ** np.arange(23)


def _skip_blanks(data, k):
    """Return the next byte that is not blank; the end of a continued line counts as blank."""
    n = data.size
    while k < n:
        c = data[k]
        if c in (SPACE, TAB):
            k += 1
        elif c == BACKSLASH and k + 1 < n and data[k + 1] == LF:
            k += 2
        elif c == BACKSLASH and k + 2 < n and data[k + 1] == CR and data[k + 2] == LF:
            k += 3
        else:
            break
    return k


def _token_end(data, k):
    while k < data.size and data[k] > SPACE and data[k] != BACKSLASH:
        k += 1
    return k


def _next_line(data, k):
    """Return the byte after the logical line that contains byte k."""
    n = data.size
    while k < n:
        if data[k] == BACKSLASH:
            after = _skip_blanks(data, k)
            k = after if after > k else k + 1
        elif data[k] == LF or data[k] == CR:
            return k + 1
        else:
            k += 1
    return n


def _at_end(data, k):
    return k >= data.size or data[k] == LF or data[k] == CR or data[k] == HASH


def _kind(data, k, end):
    """Return the kind of the line whose keyword is data[k:end]."""
    size = end - k
    first = data[k]
    if size == 1:
        if first == ord("v"):
            return VERTEX
        if first == ord("f"):
            return FACE
        if first == ord("o") or first == ord("g"):
            return STATEMENT
    elif size == 2 and first == ord("v"):
        if data[k + 1] == ord("t"):
            return TEXTURE
        if data[k + 1] == ord("n"):
            return NORMAL
    elif size == 6 and (first == ord("u") or first == ord("m")):  # usemtl, mtllib
        return STATEMENT
    return OTHER


def count(data):
    """Return the numbers of v, vt, vn and f lines, of statements (o, g, usemtl, mtllib) and of face corners."""
    lines = np.zeros(6, np.int64)
    corners, k = 0, 0
    while k < data.size:
        k = _skip_blanks(data, k)
        end = _token_end(data, k)
        if end > k:
            kind = _kind(data, k, end)
            lines[kind] += 1
            if kind == FACE:
                k = _skip_blanks(data, end)
                while not _at_end(data, k):
                    corners += 1
                    k = _skip_blanks(data, max(k + 1, _token_end(data, k)))
        k = _next_line(data, k)
    return lines, corners


def _number(data, k, end):
    """Return (value, exact) of the decimal number in data[k:end]; if not exact, it is left to the C library."""
    negative = data[k] == MINUS
    if negative or data[k] == PLUS:
        k += 1
    mantissa, digits, scale, point = np.int64(0), 0, 0, False
    start = k
    while k < end:
        c = data[k]
        if 48 <= c <= 57:
            mantissa = mantissa * 10 + (c - 48)
            digits += mantissa > 0
            scale -= point
        elif c == DOT and not point:
            point = True
        else:
            break
        if digits > 15:
            return 0.0, False
        k += 1
    if k == start or (k == start + 1 and point):
        return 0.0, False
    if k < end:
        if data[k] != 101 and data[k] != 69:  # e, E
            return 0.0, False
        shift, good = _integer(data, k + 1, end)
        if not good:
            return 0.0, False
        scale += shift
    if scale < -22 or scale > 22:
        return 0.0, False
    value = mantissa / POWERS[-scale] if scale < 0 else mantissa * POWERS[scale]
    return (-value if negative else value), True


def _integer(data, k, end):
    """Return (value, good) of the whole number in data[k:end]."""
    sign = 1
    if k < end and (data[k] == MINUS or data[k] == PLUS):
        sign = -1 if data[k] == MINUS else 1
        k += 1
    if k == end or end - k > 15:
        return 0, False
    value = 0
    while k < end:
        c = data[k]
        if c < 48 or c > 57:
            return 0, False
        value = value * 10 + (c - 48)
        k += 1
    return sign * value, True


def _numbers(data, k, row, least, slow, base, listed):
    """Fill `row` from the line at k. Returns the count of numbers read and of those listed in `slow` (place, byte)."""
    read = 0
    while read < row.size and not _at_end(data, k):
        end = _token_end(data, k)
        value, exact = _number(data, k, end)
        row[read] = value
        if not exact:
            slow[listed, 0], slow[listed, 1] = base + read, k
            listed += 1
        read += 1
        k = _skip_blanks(data, max(end, k + 1))
    return (read >= least), listed


def _resolve(data, k, end, seen):
    """Return the zero-based index written in data[k:end] when `seen` elements precede it; ABSENT if empty."""
    if k == end:
        return ABSENT, True
    index, good = _integer(data, k, end)
    if not good or index == 0:
        return 0, False
    if index > 0:
        return index - 1, True
    return (seen + index if seen + index >= 0 else OUTSIDE), True


def _slash(data, k, end):
    while k < end and data[k] != SLASH:
        k += 1
    return k


def fill(
    data,
    v,
    vt,
    vn,
    vt_at,
    face_at,
    starts,
    corner_at,
    corners,
    normals,
    relative,
    statement_at,
    slow_v,
    slow_vt,
    slow_vn,
):
    """Fill the arrays of one OBJ file (see `obj.Obj`).

    Returns:
        (code, byte, slow numbers of v, of vt, of vn): code 0, or what is wrong with the line at that byte.
    """
    n = np.zeros(6, np.int64)
    c, found_v, found_vt, found_vn, k = 0, 0, 0, 0, 0
    starts[0] = 0
    while k < data.size:
        line = k
        k = _skip_blanks(data, k)
        end = _token_end(data, k)
        kind = _kind(data, k, end) if end > k else OTHER
        i = n[kind]
        if kind == VERTEX:
            enough, found_v = _numbers(data, _skip_blanks(data, end), v[i], 3, slow_v, 3 * i, found_v)
            if not enough:
                return FEW_NUMBERS, line, 0, 0, 0
        elif kind == TEXTURE:
            vt_at[i] = line
            enough, found_vt = _numbers(data, _skip_blanks(data, end), vt[i], 1, slow_vt, 2 * i, found_vt)
            if not enough:
                return FEW_NUMBERS, line, 0, 0, 0
        elif kind == NORMAL:  # too few numbers: missing ones stay 0
            _, found_vn = _numbers(data, _skip_blanks(data, end), vn[i], 3, slow_vn, 3 * i, found_vn)
        elif kind == STATEMENT:
            statement_at[i] = line
        elif kind == FACE:
            face_at[i] = line
            k = _skip_blanks(data, end)
            while not _at_end(data, k):
                end = _token_end(data, k)
                first_slash = _slash(data, k, end)
                second_slash = _slash(data, min(first_slash + 1, end), end)
                corners[c, 0], good = _resolve(data, k, first_slash, n[VERTEX])
                corners[c, 1], fine = _resolve(data, min(first_slash + 1, end), second_slash, n[TEXTURE])
                normals[c], good_normal = _resolve(data, min(second_slash + 1, end), end, n[NORMAL])
                if not good_normal:
                    normals[c] = ABSENT
                if not (good and fine) or first_slash == k:
                    return BAD_INDEX, line, 0, 0, 0
                relative[c] = first_slash + 1 < end and data[first_slash + 1] == MINUS
                corner_at[c] = k
                c += 1
                k = _skip_blanks(data, max(end, k + 1))
            starts[i + 1] = c
            if c - starts[i] < 3:
                return FEW_CORNERS, line, 0, 0, 0
        n[kind] += 1
        k = _next_line(data, k)
    return 0, 0, found_v, found_vt, found_vn


def rewrite(data, start, stop, corner_at, new_vt, out):
    """Copy data[start:stop] to `out` with the texture index of the corners at bytes `corner_at` replaced.

    Args:
        corner_at: increasing bytes in [start, stop).
        new_vt: their new zero-based texture indices.

    Returns:
        Number of bytes written.
    """
    written, k = 0, start
    digits = np.empty(20, np.uint8)
    for c in range(corner_at.size):
        end = _token_end(data, corner_at[c])
        first_slash = _slash(data, corner_at[c], end)
        second_slash = _slash(data, min(first_slash + 1, end), end)
        while k < first_slash:
            out[written] = data[k]
            written += 1
            k += 1
        out[written] = SLASH
        written += 1
        value, used = new_vt[c] + 1, 0
        while value > 0:
            digits[used] = 48 + value % 10
            used += 1
            value //= 10
        for d in range(used):
            out[written + d] = digits[used - 1 - d]
        written += used
        k = second_slash
    while k < stop:
        out[written] = data[k]
        written += 1
        k += 1
    return written

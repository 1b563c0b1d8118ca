"""Triangulations that are being edited."""


def cross(a, b):
    """Return the determinant of two vectors of the plane, complex numbers."""
    return a.real * b.imag - a.imag * b.real


def dot(a, b):
    """Return the scalar product of two vectors of the plane, complex numbers."""
    return a.real * b.real + a.imag * b.imag


def twice_area(z, a, b, c):
    """Return twice the signed area of the triangle of vertices a, b, c of z."""
    return cross(z[b] - z[a], z[c] - z[a])


def set_row(table, row, first, second, third):
    """Write the three numbers of a row, without a tuple, whose assignment compiles slowly."""
    table[row, 0], table[row, 1], table[row, 2] = first, second, third


def relink(across, t, old, new):
    """Replace the neighbour `old` of triangle t by `new`, unless t is -1."""
    if t >= 0:
        for k in range(3):
            if across[t, k] == old:
                across[t, k] = new
                return


def opposite(faces, u, b, c):
    """Return the corner of triangle u that is neither b nor c."""
    for k in range(3):
        if faces[u, k] != b and faces[u, k] != c:
            return k
    return 0


def write(faces, across, t, a, b, c, beyond_a, beyond_b, beyond_c):
    """Write a triangle and its neighbours."""
    faces[t, 0], faces[t, 1], faces[t, 2] = a, b, c
    across[t, 0], across[t, 1], across[t, 2] = beyond_a, beyond_b, beyond_c


def flip(faces, across, t, k):
    """Replace the edge opposite corner k of t by the other diagonal of its two triangles."""
    u = across[t, k]
    a, b, c = faces[t, k], faces[t, (k + 1) % 3], faces[t, (k + 2) % 3]
    j = opposite(faces, u, b, c)
    d = faces[u, j]
    beyond_ca, beyond_ab = across[t, (k + 1) % 3], across[t, (k + 2) % 3]
    beyond_bd, beyond_dc = across[u, (j + 1) % 3], across[u, (j + 2) % 3]
    write(faces, across, t, a, b, d, beyond_bd, u, beyond_ab)
    write(faces, across, u, a, d, c, beyond_dc, beyond_ca, t)
    relink(across, beyond_bd, u, t)
    relink(across, beyond_ca, t, u)


def push(stack, t):
    """Push a triangle onto the stack, unless it is full; the first entry is its size."""
    if stack[0] + 1 < stack.size:
        stack[0] += 1
        stack[stack[0]] = t

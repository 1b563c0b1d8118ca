"""Surfaces by formula, for measurements and samples: a face, a sail, a wave."""

import numpy as np


def polar_grid(rings: int, spokes: int) -> tuple[np.ndarray, list[list[int]]]:
    """Return points of the unit disk (complex), the centre first, and its faces: triangles inside, quads around
    them.
    """
    angle = 2 * np.pi * np.arange(spokes) / spokes
    z = np.concatenate([[0], *(k / rings * np.exp(1j * angle) for k in range(1, rings + 1))])
    faces = [[0, 1 + k, 1 + (k + 1) % spokes] for k in range(spokes)]
    for ring in range(1, rings):
        a, b = 1 + (ring - 1) * spokes, 1 + ring * spokes
        faces += [[a + k, b + k, b + (k + 1) % spokes, a + (k + 1) % spokes] for k in range(spokes)]
    return z, faces


def square_grid(n: int) -> tuple[np.ndarray, list[list[int]]]:
    """Return (n + 1)² points of the square -1 .. 1 (complex) and its n² quads."""
    t = np.linspace(-1, 1, n + 1)
    z = (t[:, None] + 1j * t[None, :]).ravel()
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1)
    return z, quads.reshape(-1, 4).tolist()


def bump(z: np.ndarray, centre: complex, wide: float, high: float) -> np.ndarray:
    """Return a bell over the plane; `centre` and `wide` may be used with a stretched z."""
    return high * np.exp(-((np.abs(z - centre) / wide) ** 2))


def face(z: np.ndarray) -> np.ndarray:
    """Return (n, 3) points of a face over the unit disk: forehead and cheeks, brow, eyes, nose, lips, chin."""
    x, y = 0.8 * z.real, z.imag
    p = x + 1j * y
    depth = 0.75 * np.sqrt(np.maximum(1.12 - (x / 0.86) ** 2 - (y / 1.06) ** 2, 0.02))
    depth += bump(x + 0.45j * (y - 0.02), 0, 0.1, 0.2) + bump(
        p, -0.13j, 0.12, 0.14
    )  # ridge and tip of the nose
    for side in (-1, 1):
        depth -= bump(p, side * 0.3 + 0.2j, 0.16, 0.13)
        depth += bump(0.5 * x + 1j * y, side * 0.15 + 0.36j, 0.09, 0.05)
        depth += bump(p, side * 0.42 - 0.15j, 0.25, 0.07)
    depth += bump(0.45 * x + 1j * y, -0.43j, 0.075, 0.07) - bump(0.4 * x + 1j * y, -0.44j, 0.025, 0.05)
    depth += bump(p, -0.78j, 0.2, 0.09)
    return np.column_stack([x, y, depth])


def sail(z: np.ndarray) -> np.ndarray:
    """Return (n, 3) points of a billowing sail over a rounded quadrilateral."""
    x, y = z.real * (1 - 0.25 * z.imag), z.imag * 1.1 + 0.12 * z.real**2
    depth = 0.55 * np.cos(0.5 * np.pi * z.real) * np.cos(0.42 * np.pi * z.imag) + 0.1 * np.sin(3 * x + y)
    return np.column_stack([x, y, depth])


def wave(z: np.ndarray) -> np.ndarray:
    """Return (n, 3) points of a wavy sheet over the square."""
    return np.column_stack([z.real, z.imag, 0.3 * np.sin(3 * z.real) * np.cos(2 * z.imag)])


def write_obj(path, points: np.ndarray, faces: list[list[int]], name: str) -> None:
    """Write an OBJ file without texture coordinates."""
    lines = [f"# {name}, made by a formula for iccm", f"o {name}"]
    lines += ["v {:.5f} {:.5f} {:.5f}".format(*p) for p in points]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")

"""Faces as some files have them: triangle strips, and OFF files whose numbers ignore lines."""

import numpy as np

from ...arrays import Index, Real


def strip(vertices: Index) -> Index:
    """(m, 3) triangles of strips (k,), where -1 begins another; every second triangle is turned."""
    found = [np.zeros((0, 3), np.int64)]
    for part in np.split(vertices, np.flatnonzero(vertices < 0)):
        part = part[part >= 0]
        if part.size > 2:
            faces = np.stack([part[:-2], part[1:-1], part[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
            found.append(faces)
    return np.concatenate(found)


def free_off(text: str) -> tuple[Real, Index, Index] | None:
    """Points (n, 3), corners (c,) and starts (f + 1,) of an OFF file read number by number; None if they don't add up.

    Geomview's format says that numbers may stand on any lines. Colours cannot be told from faces then: there are none.
    """
    words = " ".join(line.split("#")[0] for line in text.splitlines()).split()
    try:
        vertices, faces, _ = map(int, words[1:4])
        numbers = np.array(words[4:], float)
    except ValueError:
        return None
    if words[0] != "OFF" or min(vertices, faces) < 0 or numbers.size < 3 * vertices:
        return None
    rest, at, sizes, corners = numbers[3 * vertices :].astype(np.int64), 0, [0], []
    for _ in range(faces):
        if at >= rest.size or rest[at] < 0:
            return None
        sizes.append(int(rest[at]))
        corners.append(rest[at + 1 : at + 1 + sizes[-1]])
        at += 1 + sizes[-1]
    if at != rest.size or not corners:
        return None
    return numbers[: 3 * vertices].reshape(-1, 3), np.concatenate(corners), np.cumsum(sizes)

"""Faces as some files have them: triangle strips, OFF files whose numbers ignore lines, and binary ones."""

import numpy as np

from ...arrays import Index, Real


def strip(vertices: Index) -> Index:
    """Return (m, 3) triangles of strips (k,), where -1 begins another; every second triangle is turned."""
    found = [np.zeros((0, 3), np.int64)]
    for part in np.split(vertices, np.flatnonzero(vertices < 0)):
        part = part[part >= 0]
        if part.size > 2:
            faces = np.stack([part[:-2], part[1:-1], part[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
            found.append(faces)
    return np.concatenate(found)


def free_off(text: str) -> tuple[Real, Index, Index] | None:
    """Return points (n, 3), corners (c,) and starts (f + 1,) of an OFF file read number by number; None if they don't
    add up.

    Geomview's format says that numbers may stand on any lines. Colours could not be
    distinguished from faces then, so there are none.
    """
    words = " ".join(line.split("#")[0] for line in text.splitlines()).split()
    try:
        vertices, faces, _ = map(int, words[1:4])
        numbers = np.array(words[4:], float)
    except ValueError:
        return None
    if words[0] != "OFF" or min(vertices, faces) < 0 or numbers.size < 3 * vertices:
        return None
    found = _faces(numbers[3 * vertices :].astype(np.int64), faces, coloured=False)
    return found and (numbers[: 3 * vertices].reshape(-1, 3), *found)


def is_binary_off(data: bytes) -> bool:
    """Return whether this is an OFF file whose numbers are binary."""
    return data[:80].split(b"\n")[0].split() == [b"OFF", b"BINARY"]


def binary_off(data: bytes) -> tuple[Real, Index, Index]:
    """Return points (n, 3), corners (c,) and starts (f + 1,) of a binary OFF file: integers and floats of 32 bits,
    big-endian with the number of a colour's components, and these, after each face's corners (Geomview's manual), or
    little-endian without (as PMP writes them).

    Raises:
        ValueError: the numbers don't add up.
    """
    rest = data.partition(b"\n")[2]
    for order, coloured in ((">", True), ("<", False)):
        words = np.frombuffer(rest[: len(rest) // 4 * 4], f"{order}i4")
        if words.size < 3 or min(words[:2]) < 0 or words.size < 3 + 3 * int(words[0]):
            wrong = "the file ends within its points"
            continue
        end = 3 + 3 * int(words[0])
        found = _faces(words[end:].astype(np.int64), int(words[1]), coloured=coloured)
        if found is not None:
            return words[3:end].view(f"{order}f4").reshape(-1, 3).astype(float), *found
        wrong = "the number of face indices differs from the header"
    raise ValueError(wrong)


def _faces(numbers: Index, count: int, *, coloured: bool) -> tuple[Index, Index] | None:
    """Corners and starts of faces that stand one after the other, each its size, corners and, if `coloured`, number of
    colour components and these; None if they don't add up."""
    at, sizes, corners = 0, [0], []
    for _ in range(count):
        if at >= numbers.size or numbers[at] < 0:
            return None
        sizes.append(int(numbers[at]))
        corners.append(numbers[at + 1 : at + 1 + sizes[-1]])
        at += 1 + sizes[-1]
        if coloured:
            if at >= numbers.size or numbers[at] < 0:
                return None
            at += 1 + int(numbers[at])
    if at != numbers.size or not corners:
        return None
    return np.concatenate(corners), np.cumsum(sizes)


def is_binary_stl(data: bytes) -> bool:
    """Return whether this is an STL file whose length is as its number of faces says."""
    return len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")

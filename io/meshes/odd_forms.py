"""Less common encodings of faces: triangle strips, OFF files that ignore line breaks, and binary OFF and STL."""

import numpy as np

from ...arrays import Index, Real


def strip(vertices: Index) -> Index:
    """Return the triangles (m, 3) of strips (k,) separated by -1; every second triangle is reversed."""
    triangles = [np.zeros((0, 3), np.int64)]
    for part in np.split(vertices, np.flatnonzero(vertices < 0)):
        part = part[part >= 0]
        if part.size > 2:
            faces = np.stack([part[:-2], part[1:-1], part[2:]], axis=1)
            faces[1::2] = faces[1::2, ::-1]
            triangles.append(faces)
    return np.concatenate(triangles)


def free_off(text: str) -> tuple[Real, Index, Index] | None:
    """Parse an OFF file number by number; return points (n, 3), corners (c,) and starts (f + 1,).

    Geomview's format allows line breaks anywhere. Colours could not be distinguished from faces then, so they are not
    supported. Returns None if the counts do not match.
    """
    words = " ".join(line.split("#")[0] for line in text.splitlines()).split()
    try:
        vertices, faces, _ = map(int, words[1:4])
        numbers = np.array(words[4:], float)
    except ValueError:
        return None
    if words[0] != "OFF" or min(vertices, faces) < 0 or numbers.size < 3 * vertices:
        return None
    polygons = _faces(numbers[3 * vertices :].astype(np.int64), faces, coloured=False)
    return polygons and (numbers[: 3 * vertices].reshape(-1, 3), *polygons)


def is_binary_off(data: bytes) -> bool:
    """Return whether this is an OFF file with binary numbers."""
    return data[:80].split(b"\n")[0].split() == [b"OFF", b"BINARY"]


def binary_off(data: bytes) -> tuple[Real, Index, Index]:
    """Parse a binary OFF file; return points (n, 3), corners (c,) and starts (f + 1,).

    Integers and floats have 32 bits. They are big-endian, with the number of color components and these after each
    face's corners (Geomview's manual), or little-endian without colors (as PMP writes them).

    Raises:
        ValueError: the counts do not match.
    """
    body = data.partition(b"\n")[2]
    for order, coloured in ((">", True), ("<", False)):
        words = np.frombuffer(body[: len(body) // 4 * 4], f"{order}i4")
        if words.size < 3 or min(words[:2]) < 0 or words.size < 3 + 3 * int(words[0]):
            wrong = "the file ends within its points"
            continue
        end = 3 + 3 * int(words[0])
        polygons = _faces(words[end:].astype(np.int64), int(words[1]), coloured=coloured)
        if polygons is not None:
            return words[3:end].view(f"{order}f4").reshape(-1, 3).astype(float), *polygons
        wrong = "the number of face indices differs from the header"
    raise ValueError(wrong)


def _faces(numbers: Index, count: int, *, coloured: bool) -> tuple[Index, Index] | None:
    """Return corners and starts of consecutive faces, or None if the counts do not match.

    Each face is stored as its size and corners and, if `coloured`, the number of color components and these.
    """
    position, sizes, corners = 0, [0], []
    for _ in range(count):
        if position >= numbers.size or numbers[position] < 0:
            return None
        sizes.append(int(numbers[position]))
        corners.append(numbers[position + 1 : position + 1 + sizes[-1]])
        position += 1 + sizes[-1]
        if coloured:
            if position >= numbers.size or numbers[position] < 0:
                return None
            position += 1 + int(numbers[position])
    if position != numbers.size or not corners:
        return None
    return np.concatenate(corners), np.cumsum(sizes)


def is_binary_stl(data: bytes) -> bool:
    """Return whether this is an STL file whose length matches its binary face count."""
    return len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")

"""Archives that are damaged at one place or cut there, for formats of iccm and of extensions."""

from pathlib import Path

DAMAGED_AT = (0.03, 0.3, 0.5, 0.7, 0.97)
"""Where to damage an archive, relative to its length."""


def check_damaged_archive(iccm, archive, where):
    """Check that commands end properly on a damaged archive in the current folder, and refuse it when it is cut."""
    data = bytearray(archive.read_bytes())
    start = int(where * len(data))
    data[start : start + 12] = bytes(value ^ 0x5A for value in data[start : start + 12])
    bad, cut = f"bad{archive.suffix}", f"cut{archive.suffix}"
    Path(bad).write_bytes(data)
    for arguments in (["info", bad], ["map", bad, "square.svg", "-o", "o.png"]):
        typed = iccm(*arguments)
        assert typed.code in (0, 1, 2), typed.err
    Path(cut).write_bytes(data[:start])
    typed = iccm("info", cut)
    assert typed.code == 2 and len(typed.lines) == 1 and cut in typed.err

"""What is compiled ahead is what a common job needs."""

import os

from iccm import ahead


def test_what_is_in_the_cache_is_not_missing(tmp_path):
    class Kernel:
        """As much of a kernel as is asked."""

        entry = type("Entry", (), {"stats": type("Stats", (), {"cache_path": str(tmp_path)})})
        py_func = type("f", (), {"__code__": type("Code", (), {"co_filename": str(tmp_path / "m.py")})})

    (tmp_path / "m.py").write_text("")
    assert not ahead._cached(Kernel())
    index = tmp_path / "m.f-1.py311.nbi"
    index.write_text("")
    assert ahead._cached(Kernel())
    os.utime(index, (0, 0))
    assert not ahead._cached(Kernel())


def test_parts_that_are_there_start_no_process(monkeypatch):
    monkeypatch.setattr(ahead, "missing", list)
    monkeypatch.setattr(ahead, "_process", None)
    ahead.compile_ahead()


def test_a_process_that_cannot_start_is_no_failure(monkeypatch):
    def refused(*_, **__):
        raise OSError("no more processes")

    done = []
    parts = {name: ahead.Part(lambda name=name: done.append(name), "", "", k) for k, name in enumerate("ab")}
    monkeypatch.setattr(ahead, "missing", lambda: ["a", "b"])
    monkeypatch.setattr(ahead, "PARTS", parts)
    monkeypatch.setattr(ahead.subprocess, "Popen", refused)
    ahead.compile_ahead(2)
    assert done == ["b"]


def test_shares_take_about_as_long_as_each_other():
    parts = list(ahead.PARTS)
    for count in range(1, len(parts) + 1):
        shares = ahead._shares(parts, count)
        assert sorted(part for share in shares for part in share) == sorted(parts)
        assert all(shares)
        seconds = [ahead._seconds(share) for share in shares]
        assert seconds == sorted(seconds)
        assert seconds[-1] - seconds[0] <= max(part.seconds for part in ahead.PARTS.values())
    assert ahead._shares(parts, 1) == [parts]

"""The digest of a batch: which notes its jobs have in common, and whether its drawings differ in style."""

from types import SimpleNamespace

import pytest

from iccm.io.batch.digest import Digest


def digest_of(*results, fit=None, place="fill", texture=None, command="map"):
    """The lines for results of jobs that map a word onto different icons."""
    digest = Digest(
        {
            number: SimpleNamespace(
                job=SimpleNamespace(
                    source="word.svg",
                    target=f"{number}.svg",
                    fit=fit,
                    place=place,
                    texture=texture,
                    command=command,
                )
            )
            for number in range(len(results))
        }
    )
    for number, (status, notes, p95) in enumerate(results):
        figures = {} if p95 is None else {"dilatation": {"p95": p95}}
        digest.add({"job": number, "status": status, "notes": notes, "figures": figures})
    return digest.lines()


def test_notes_are_counted_without_the_names_of_files_and_not_those_of_failed_jobs():
    lines = digest_of(
        ("done", ["0.svg: is thin", "a thing"], None),
        ("poor", ["1.svg: is thin"], None),
        ("failed", ["2.svg: is thin"], None),
    )
    assert lines == ["2 of 2 jobs: is thin", "1 of 2 jobs: a thing"]


def test_the_most_frequent_notes_are_told_and_the_others_counted():
    notes = [f"note {k}" for k in range(8)]
    lines = digest_of(("done", notes, None), ("done", notes[2:7], None))
    assert [line[:11] for line in lines[:5]] == ["2 of 2 jobs"] * 5 and lines[5].startswith("3 other notes")


def test_drawings_of_two_styles_are_told_with_the_remedies():
    lines = digest_of(("done", [], 1.0), ("done", [], 1.3), ("done", [], 1.0), ("failed", [], 2.0))
    assert len(lines) == 1 and lines[0].startswith("2 of 3 drawings")
    assert "box" in lines[0] and "inside" in lines[0]


@pytest.mark.parametrize(
    "options", [{"fit": "box"}, {"place": "inside"}, {"texture": "a.png"}, {"command": "deform"}]
)
def test_one_style_or_a_chosen_one_is_not_told(options):
    results = ("done", [], 1.0), ("done", [], 1.3)
    assert not digest_of(*results, **options) and not digest_of(results[1], results[1])

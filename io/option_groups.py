"""The options of a command by what they are for, as help and the reference show them."""

from collections.abc import Iterable

GROUPS: dict[str, tuple[str, str]] = {
    "What to carry": (
        "--texture dots.png --edge repeat --texture-scale .1",
        "texture normal normal_down data texture_box texture_scale texture_offset texture_turn edge filter kind "
        "colorspace",
    ),
    "What to write": (
        "-o out.png --size 2048 --report out.json",
        "output size target_box padding fill stmap report plot junit diff html summary json uv dry_run watch open "
        "force",
    ),
    "Which shapes": (
        "--parts all --holes keep",
        "parts trace plane holes cut bake carry_maps subdivide_rim outside sequence",
    ),
    "What must meet": (
        "--pin 30,40:28,44 --pin 60,40:70,41",
        "pin rigid rigid_target rigid_size constraints pin_weight stroke_weight start",
    ),
    "Which map": (
        "--fit cover --balance 2 --turn 90",
        "method fit max_left_out max_uncovered balance importance size_map turn starts max_dilatation max_stretch "
        "quasi smoothness order "
        "vertices samples_per_edge literal",
    ),
    "When it is good enough": (
        "--tolerance 1e-4 --require-injective",
        "tolerance max_iterations require_injective limit tolerances",
    ),
    "Time and memory": (
        "--memory 2G --threads 4",
        "threads resume memory max_pixel_error max_pixels max_segments max_faces workers dask timeout retries",
    ),
    "Messages": ("-q --log-format json", "verbose quiet log_format debug help"),
}
"""An example, and the names of the options, for each heading."""
FEW = 12  # options that need no headings


def grouped(names: Iterable[str]) -> list[tuple[str, str, list[str]]]:
    """Heading, example and options for each group of some options; the others, or a few in all, as `Options`."""
    left = list(names)
    found = []
    if len(left) > FEW:
        for title, (example, members) in GROUPS.items():
            if own := [name for name in members.split() if name in left]:
                found.append((title, example, own))
    rest = [name for name in left if not any(name in own for _, _, own in found)]
    return [("Options", "", rest), *found] if rest else found

"""The options of a command by topic, for help and the reference."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Topic:
    """The contents of `--help TOPIC`.

    Attributes:
        title: the heading.
        example: options that show what the topic is about.
        members: the names of its options, in the order of help.
    """

    title: str
    example: str
    members: str

    @property
    def names(self) -> list[str]:
        """The names of its options."""
        return self.members.split()


TOPICS: dict[str, Topic] = {
    "texture": Topic(
        "The picture that is carried",
        "--texture dots.png --edge repeat --texture-scale .1",
        "texture gaps normal normal_down data texture_box texture_scale texture_offset texture_turn edge filter kind "
        "colorspace",
    ),
    "output": Topic(
        "What to write",
        "-o out.png --size 2048 --report out.json",
        "output size target_box padding padding_fill stmap report plot junit diff html summary json uv dry_run watch "
        "open force",
    ),
    "shapes": Topic(
        "Which shapes, and how they are fitted",
        "--parts all --holes keep --fit cover",
        "parts fit place holes max_left_out max_uncovered trace sequence",
    ),
    "constraints": Topic(
        "Pins, strokes and rigid regions",
        "--pin 30,40:28,44 --pin 60,40:70,41",
        "pin exact_pins rigid rigid_target rigid_size constraints source_landmarks target_landmarks importance "
        "size_map start",
    ),
    "method": Topic(
        "Which map",
        "--balance 2 --turn 90",
        "method balance turn effort max_dilatation max_stretch tolerance require_injective limit tolerances",
    ),
    "mesh": Topic(
        "Meshes",
        "--bake --cut-open",
        "plane cut_open no_cut bake carry_maps subdivide_rim allow_outside",
    ),
    "paper": Topic(
        "The methods `conformal` and `paper`",
        "--method paper --vertices 400",
        "quasi smoothness pin_weight stroke_weight order vertices samples_per_edge literal max_iterations",
    ),
    "limits": Topic(
        "Time and memory",
        "--memory 2G --threads 4",
        "threads time_limit resume memory max_pixel_error max_pixels max_segments max_faces workers dask timeout "
        "retries",
    ),
    "messages": Topic(
        "Messages",
        "-q --log-format json",
        "verbose quiet log_format debug version help",
    ),
}
"""Topics by the word that `--help` takes."""
MOST_SHORT_HELP_OPTIONS = 12
"""Number of options up to which no headings are shown."""


def grouped(names: Iterable[str]) -> list[tuple[str, str, list[str]]]:
    """Return heading, example and options of each topic.

    Options without a topic come first under `Options`, as do all options if there are few.
    """
    left = list(names)
    found: list[tuple[str, str, list[str]]] = []
    if len(left) > MOST_SHORT_HELP_OPTIONS:
        topics = [
            (topic.title, topic.example, [name for name in topic.names if name in left])
            for topic in TOPICS.values()
        ]
        found = [topic for topic in topics if topic[2]]
    rest = [name for name in left if not any(name in own for _, _, own in found)]
    return [("Options", "", rest), *found] if rest else found

"""The options of a command by topic, for help and the reference."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from .options import Option


@dataclass(frozen=True)
class Topic:
    """A group of options, shown by `--help TOPIC`. Each option names its topic, see `Option`.

    Attributes:
        title: the heading.
        example: options that show what the topic is about.
    """

    title: str
    example: str


TOPICS: dict[str, Topic] = {
    "texture": Topic("The picture that is carried", "--texture dots.png --edge repeat --texture-scale .1"),
    "output": Topic("What to write", "-o out.png --size 2048 --report out.json"),
    "shapes": Topic("Which shapes, and how they are fitted", "--parts all --holes keep --fit cover"),
    "constraints": Topic("Pins, strokes and rigid regions", "--pin 30,40:28,44 --pin 60,40:70,41"),
    "method": Topic("Which map", "--balance 2 --turn 90"),
    "mesh": Topic("Meshes", "--bake --cut-open"),
    "paper": Topic("The methods `conformal` and `paper`", "--method paper --vertices 400"),
    "limits": Topic("Time and memory", "--memory 2G --threads 4"),
    "messages": Topic("Messages", "-q --log-format json"),
}
"""Topics by the word that `--help` takes, in the order of help."""
OF_EVERY_COMMAND = "help", "version"
"""Options that have no row in the table; they belong to the messages."""
SHORT_NAMES = {"o": "output", "q": "quiet"}
"""Names of the options that examples have in short."""
MOST_SHORT_HELP_OPTIONS = 12
"""Number of options up to which no headings are shown."""


def of_topic(topic: str, names: Iterable[str], rows: Mapping[str, Option]) -> list[str]:
    """Return those of the named options that belong to a topic, in their order.

    Args:
        topic: a key of `TOPICS`.
        names: the names of options.
        rows: the options that are in the table, by name.
    """
    return [name for name in names if _topic_of(name, rows) == topic]


def _topic_of(name: str, rows: Mapping[str, Option]) -> str:
    """Return the topic of an option, or an empty string."""
    if name in rows:
        return rows[name].topic
    return "messages" if name in OF_EVERY_COMMAND else ""


def grouped(names: Iterable[str], rows: Mapping[str, Option]) -> list[tuple[str, str, list[str]]]:
    """Return heading, example and options of each topic; the example is empty unless the command has its options.

    Options without a topic come first under `Options`, as do all options if there are few.

    Args:
        names: the names of options.
        rows: the options that are in the table, by name.
    """
    names = list(names)
    if len(names) <= MOST_SHORT_HELP_OPTIONS:
        return [("Options", "", names)] if names else []
    sections = [("Options", "", of_topic("", names, rows))]
    for word, topic in TOPICS.items():
        used = {
            SHORT_NAMES.get(option, option)
            for option in re.findall(r"(?<!\S)--?([a-z][a-z-]*)", topic.example)
        }
        is_example = used <= {name.replace("_", "-") for name in names}
        sections.append((topic.title, topic.example if is_example else "", of_topic(word, names, rows)))
    return [section for section in sections if section[2]]

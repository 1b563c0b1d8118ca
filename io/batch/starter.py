"""The starter manifest that `iccm init` writes."""

STARTER = """\
# Jobs for iccm. Check them with `iccm batch {name} --dry-run`, run them with `iccm batch {name}`.
# Keys are the options of `iccm map` with _ for -; `iccm map --help all` lists them.
# Paths are relative to this file; --root names another folder for outputs.

[defaults]                                        # options of all jobs, unless a job sets its own
size = 512                                        # pixels of the longer side
output = "out/{{source.stem}}-{{target.stem}}.png"  # or .svg for the drawing itself
# texture = "petals.jpg"                          # without one: a numbered checkerboard
# report = "out/{{source.stem}}.json"             # figures of each job

[[job]]                                           # one job for each file that the pattern matches
source = "{source}"
target = "{target}"

# [[job]]                                         # as many as you like
# name = "with two pins"
# source = "icons/bell.svg"
# target = "shield.svg"
# pin = ["30,40:28,44", "60,40:70,41"]            # x,y in the source : x,y in the target
# output = "out/pinned.png"
# report = "out/pinned.json"

# Other commands: command = "flatten" or "relayout"; `iccm flatten --help all` lists the keys.
"""


def starter(name: str, source: str = "icons/*.svg", target: str = "shield.svg") -> str:
    """Return the text of a starter manifest with a name, sources and a target."""
    return STARTER.format(name=name, source=source, target=target)

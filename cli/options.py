"""Options that several commands share. Each is a field of `Job`; a test holds the two together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import click

Decorator = Callable[[Callable], Callable]


def together(*options: Decorator) -> Decorator:
    """One decorator that adds the options in the order in which help shows them."""

    def decorate(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def _choice(*names: str) -> click.Choice:
    return click.Choice(list(names))


OUTPUTS = together(
    click.option(
        "--texture", metavar="IMAGE", help="Picture to carry along.  [default: a numbered checkerboard]"
    ),
    click.option(
        "-o",
        "--output",
        multiple=True,
        metavar="FILE",
        help="What to write, by suffix: a picture (.png .jpg .tif .exr .webp .hdr), a mesh (.obj), artwork (.svg); "
        "- for a PNG on stdout. May be repeated.  [default, when nothing else is written: SOURCE-TARGET.png or "
        "SHAPE-deformed.png here]",
    ),
    click.option("--report", metavar="FILE.json", help="Figures of the run as JSON; - for stdout."),
    click.option("--plot", metavar="FILE.png", help="A figure: grids, energy, distortion (.png .svg .pdf)."),
    click.option("--stmap", metavar="FILE.exr", help="The map itself, for `iccm apply` and compositors."),
    click.option("--force", is_flag=True, help="Replace files that exist."),
)


def _bytes(ctx: click.Context, parameter: click.Parameter, value: str | None) -> int | None:
    if value is None:
        return None
    from ..io.run.job import memory

    try:
        return memory(value)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


MEMORY = click.option(
    "--memory",
    metavar="SIZE",
    callback=_bytes,
    help="Bound on the process, such as 2G: pictures that do not fit go through a scratch file.",
)

RASTER = together(
    click.option(
        "--size", metavar="WxH|N", help="Pixels of the picture, or its longer side.  [default: 1024]"
    ),
    click.option(
        "--texture-box",
        type=_choice("viewbox", "bbox"),
        default="viewbox",
        show_default=True,
        help="What of the source the texture covers: its canvas, or its outline's bounding box.",
    ),
    click.option(
        "--filter",
        type=_choice("auto", "nearest", "linear", "cubic", "lanczos", "spline"),
        default="auto",
        show_default=True,
        help="Sampling of the texture; nearest for label maps and masks.",
    ),
    click.option(
        "--kind",
        type=_choice("colour", "normal", "normal-down", "data"),
        default="colour",
        show_default=True,
        help="What the texture's channels are; normals (y up or down) turn with the map.",
    ),
    click.option(
        "--colorspace",
        metavar="NAME",
        help="The texture's, as OpenColorIO names it.  [default: what it says]",
    ),
    click.option(
        "--edge",
        type=_choice("clamp", "transparent"),
        default="clamp",
        show_default=True,
        help="What lies outside the texture.",
    ),
    click.option(
        "--padding", type=click.IntRange(-1), metavar="N", help="Pixels to spill past the outline; -1: all."
    ),
    click.option(
        "--fill",
        type=_choice("push-pull", "nearest"),
        default="push-pull",
        show_default=True,
        help="How padding is filled.",
    ),
    click.option(
        "--max-pixel-error",
        type=float,
        default=0.05,
        show_default=True,
        help="Error that fast evaluation may make, in texels.",
    ),
    click.option(
        "--max-pixels", type=int, default=1 << 28, show_default=True, help="Refuse larger pictures."
    ),
    MEMORY,
)

BAKE = click.option(
    "--bake", is_flag=True, help="Fill the texture layout that the target mesh has, not a new one."
)
MESH = together(
    click.option("--cut", is_flag=True, help="Cut a closed mesh, or one with handles, open."),
    click.option(
        "--threads", type=click.IntRange(1), help="For the pixels; never changes the result.  [default: all]"
    ),
    click.option("--max-faces", type=int, default=5_000_000, show_default=True, help="Refuse larger meshes."),
)

CONSTRAINTS = together(
    click.option(
        "--pin",
        multiple=True,
        metavar="SX,SY:TX,TY",
        help="A point of the source and where it goes, in the files' units. May be repeated.",
    ),
    click.option("--constraints", metavar="FILE.json", help="Pins and strokes from a file; - for stdin."),
    click.option(
        "--pin-weight", type=float, metavar="W", help="Pull of the pins against the outline's.  [default: 1]"
    ),
    click.option("--stroke-weight", type=float, metavar="W", help="Pull of the strokes.  [default: 1]"),
)


def _vertices(ctx: click.Context, parameter: click.Parameter, value: str | None) -> int | str | None:
    if value is None or value == "source":
        return value
    if not value.isdecimal() or int(value) < 3:
        raise click.BadParameter(f"{value!r} is neither a number of at least 3 nor `source`.")
    return int(value)


SOLVER = together(
    click.option(
        "--quasi", type=float, metavar="WEIGHT", help="Quasi-conformal, with this weight against shear."
    ),
    click.option(
        "--method",
        type=_choice("conformal", "paper"),
        default="conformal",
        show_default=True,
        help="conformal finds its own start and vertices; paper is Algorithm 1 as published.",
    ),
    click.option(
        "--order", type=click.IntRange(0, 1), help="Distance of zeroth or first order.  [default: by method]"
    ),
    click.option(
        "--max-iterations", type=click.IntRange(1), metavar="N", help="Stop after N.  [default: by method]"
    ),
    click.option(
        "--vertices",
        metavar="N|source",
        callback=_vertices,
        help="Boundary vertices, or the source's own and no others.  [default: by shape]",
    ),
    click.option(
        "--samples-per-edge",
        type=click.IntRange(1),
        metavar="N",
        help="Samples between two vertices, with --method paper.  [default: 4]",
    ),
    click.option(
        "--weights",
        type=_choice("relative", "paper"),
        help="Means that do not depend on sizes and counts, or sums as the paper has them.  [default: relative]",
    ),
    click.option(
        "--smoothness", type=float, metavar="W", help="Resistance to bending.  [default: by command]"
    ),
    click.option(
        "--tolerance",
        type=float,
        default=1e-3,
        show_default=True,
        help="Boundary gap to reach, relative to the target's diagonal.",
    ),
    click.option(
        "--require-injective",
        is_flag=False,
        flag_value="0.99",
        type=float,
        metavar="[SHARE]",
        help="Exit code 1 unless it is certified one-to-one on this share of the source's area.  [0.99]",
    ),
)


def values(options: dict[str, object]) -> dict[str, object]:
    """The options that were given, as a Job's fields: unset ones are left to its defaults."""
    return {key: _plain(value) for key, value in options.items() if value is not None}


def _plain(value: object) -> object:
    return list(value) if isinstance(value, Sequence) and not isinstance(value, str) else value

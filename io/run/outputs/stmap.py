"""The map as an STMap: for each pixel of the target, its place in the texture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....arrays import Box
from ....meshes import bake as baking
from ....pixels.stmap import flat
from ....pixels.texture import Placing, Texture, Wrapped
from ...pictures import stmap_files
from ..job import Job
from ..report import OutputReport
from ..state import Run
from . import baked, checks
from .output import Output


class STMap(Output):
    """A map as a floating-point picture, of the target's canvas or with --bake of its texture coordinates."""

    tiles = True

    def suit(self, job: Job, onto_mesh: bool) -> None:
        """Require a suffix whose format holds floats."""
        stmap_files.check(self.name)

    def check(self, run: Run) -> None:
        """Check the texture coordinates that are needed, and memory for the rows."""
        if run.job.bake:
            baked.check_layouts(run, self.tile)
            width, height = baked.size(run)
            run.room.check(baking.whole_bytes(height, width, 4, 4), baked.BAKED)
            return
        if run.source.has_uv:
            checks.coordinates(run, *run.shapes(0))
        width, _ = checks.canvas(run, self.tile)
        run.room.check(stmap_files.band_bytes(width), f"rows of {width} pixels")

    def write(self, run: Run, path: Path, earlier: Sequence[OutputReport] = ()) -> OutputReport:
        """Write rows as they are computed, or with --bake the whole picture at once."""
        lying, job = run.flat, run.job
        with run.phases.timed("resample"):
            if not job.bake:
                place, room = _placing(run, lying), run.room
                covered = stmap_files.write(
                    path,
                    run.in_layout,
                    lying.box,
                    run.canvas_of(self.tile),
                    placing=place,
                    room=room,
                    threads=run.threads,
                )
                return OutputReport({} if covered else {"empty": True})
            parts = baked.parts_of(run)
            grid = baked.layout_of([target for target, _, _ in parts], *baked.size(run), self.tile)
            placed = baked.baked_parts(parts, lying, run.threads, _unit(run), partial=baked.is_partial(run))
            st, figures = baking.bake_stmap(placed, grid, padding=job.padding, threads=run.threads)
            stmap_files.write_whole(path, st)
        return baked.report_bake(run, figures, self.tile)


def _placing(run: Run, lying: Texture) -> Placing:
    """Return where points of the source lie in a texture of one texel, which lies flat in the plane by default."""
    if run.source.is_layout:
        return flat((0j, complex(run.source.aspect, 1))) if run.tiles else Wrapped(lying, run.whole(0).wrap)
    return run.whole(0).placing(lying, _unit(run)) if run.source.has_uv else lying


def _unit(run: Run) -> Box | None:
    """Return the tile that s and t are relative to if the texture has several tiles; they then continue beyond 0..1."""
    return (0j, 1 + 1j) if run.tiles else None

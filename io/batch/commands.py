"""The commands that a batch can run: creating, checking and running their jobs."""

from __future__ import annotations

from typing import Any

from ..run.job import KINDS, Described, FlattenJob, Job, Outcome, RelayoutJob

SHARED = "shared"
"""Key of the names of values that were given for several jobs, see `Described`."""


def job_of(values: dict[str, Any]) -> Described:
    """Return the job of a `command` (by default map) with the given values."""
    given = {key: value for key, value in values.items() if key not in ("command", SHARED)}
    return KINDS[values.get("command", "map")](**given).sharing(values.get(SHARED, ()))


def check(job: Described) -> None:
    """Check that the command supports the formats of inputs and outputs.

    Raises:
        InputError: an input or output has another format.
    """
    from ..run import flatten, outputs, relayout
    from ..run.inputs import Inputs
    from ..shapes import shape
    from ..spec import Spec, is_generated

    if isinstance(job, FlattenJob):
        flatten.check(job)
    elif isinstance(job, RelayoutJob):
        relayout.plan(job)
    elif isinstance(job, Job):
        inputs = Inputs(job, keep=False)
        for spec in filter(None, (job.source, job.target)):
            _ = is_generated(spec) or inputs.is_mesh(spec) or shape.supported_suffix(Spec.of(spec).path)
        outputs.of(job, inputs)


def run(job: Described, threads: int | None) -> Outcome:
    """Run a job.

    Raises:
        InputError: an input or output is invalid. In this case nothing has been written.
    """
    from ..run import execute, flatten, relayout

    if isinstance(job, FlattenJob):
        return flatten.run(job)
    if isinstance(job, RelayoutJob):
        return relayout.run(job, threads=threads)
    assert isinstance(job, Job)
    return execute.run(job, threads=threads)

"""The commands that a batch runs: their jobs as JSON describes them, checked and run."""

from __future__ import annotations

from typing import Any

from ..run.job import KINDS, Described, FlattenJob, Job, Outcome, RelayoutJob


def job_of(values: dict[str, Any]) -> Described:
    """Return the job of a `command` (map) and the values that it is given."""
    return KINDS[values.get("command", "map")](
        **{key: value for key, value in values.items() if key != "command"}
    )


def check(job: Described) -> None:
    """Refuse inputs and outputs of kinds that the command does not know.

    Raises:
        InputError: naming one.
    """
    from ..run import flatten, outputs, relayout
    from ..run.inputs import Inputs
    from ..shapes import shape
    from ..spec import Spec

    if isinstance(job, FlattenJob):
        flatten.check(job)
    elif isinstance(job, RelayoutJob):
        relayout.plan(job)
    elif isinstance(job, Job):
        inputs = Inputs(job, keep=False)
        for spec in filter(None, (job.source, job.target)):
            _ = inputs.is_mesh(spec) or shape.known(Spec.of(spec).path)
        outputs.of(job, inputs)


def run(job: Described, threads: int | None) -> Outcome:
    """Do all of a job.

    Raises:
        InputError: an input or output is wrong. Nothing has been written then.
    """
    from ..run import execute, flatten, relayout

    if isinstance(job, FlattenJob):
        return flatten.run(job)
    if isinstance(job, RelayoutJob):
        return relayout.run(job, threads=threads)
    assert isinstance(job, Job)
    return execute.run(job, threads=threads)

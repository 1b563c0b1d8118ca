"""What options need in order to have an effect; those that were given in vain are refused.

A value that equals the default is never refused, nor are limits and permissions, which have an effect only if something
exceeds or needs them. An option that a batch gives for several jobs is refused only if it has no effect in any.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...errors import InputError
from .job import Described


@dataclass(frozen=True)
class Requirement:
    """The conditions under which options have an effect.

    Attributes:
        options: names of the options, as fields of a job.
        is_met: whether a job has it, given the state of its run.
        lacks: the end of the sentence "has no effect, because …", with a remedy.
    """

    options: tuple[str, ...]
    is_met: Callable[..., bool]
    lacks: str


def refuse(job: Described, requirements: Sequence[Requirement], *state: object) -> tuple[str, ...]:
    """Return the options without effect that were given for several jobs of a batch.

    Args:
        job: the job.
        requirements: those of its command.
        state: passed to `Requirement.is_met`.

    Raises:
        InputError: an option that was given for this job has no effect.
    """
    defaults, shared = job.defaults(), list[str]()
    for requirement in requirements:
        given = [name for name in requirement.options if getattr(job, name) != defaults[name]]
        if not given or requirement.is_met(*state):
            continue
        if own := [name for name in given if name not in job.shared]:
            raise InputError(f"--{own[0].replace('_', '-')}: has no effect, because {requirement.lacks}")
        shared += given
    return tuple(shared)

"""Signatures without types, for `help`."""

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])


def plain_signature(function: Function) -> Function:
    """Return a function whose `help` shows only names and defaults.

    Its docstring describes the types, and type checkers read them from the source.
    """
    signature = inspect.signature(function)
    bare = [
        parameter.replace(annotation=inspect.Parameter.empty) for parameter in signature.parameters.values()
    ]
    function.__signature__ = inspect.Signature(bare)  # type: ignore[attr-defined]
    return function

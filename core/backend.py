"""The build backend: setuptools, which also requires ziglang if no C++ compiler is installed (PEP 517)."""

from typing import Any

from compile import system_compiler
from setuptools import build_meta
from setuptools.build_meta import (
    build_editable,
    build_sdist,
    build_wheel,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

ZIG = "ziglang>=0.15"


def missing_compiler() -> list[str]:
    """Return the requirement for a compiler as a list, empty if one is installed."""
    return [] if system_compiler() else [ZIG]


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Return the requirements for building a wheel."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *missing_compiler()]


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """Return the requirements for building an editable installation."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *missing_compiler()]

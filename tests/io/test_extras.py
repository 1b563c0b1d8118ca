"""Tests of optional packages."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from iccm.errors import InputError
from iccm.io import extras

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("package", extras.PACKAGES)
def test_the_extra_that_a_message_names_installs_the_package(package):
    distribution, extra = extras.PACKAGES[package]
    required = PROJECT["optional-dependencies"][extra]
    assert distribution in [re.match(r"[\w-]+", requirement)[0] for requirement in required]


def test_every_extra_of_users_has_a_purpose_and_its_packages():
    names = PROJECT["optional-dependencies"].keys() - {"dev", "docs"}
    assert names == set(extras.PURPOSES) == {extra for _, extra in extras.PACKAGES.values()}


def test_a_missing_package_is_refused_with_the_command_that_installs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "roifile", None)
    with pytest.raises(InputError) as refused:
        extras.load("a.roi: reading it", "roifile", otherwise="export a table")
    message = str(refused.value)
    assert message.startswith("a.roi: reading it") and "iccm[imagej]" in message
    assert message.endswith("export a table")


def test_a_package_without_a_submodule_that_is_needed_is_refused_too(monkeypatch):
    monkeypatch.setitem(sys.modules, "ezdxf.recover", None)
    with pytest.raises(InputError, match="ezdxf"):
        extras.load("a.dxf", "ezdxf", "recover")

"""Tests of optional packages."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from iccm.errors import InputError
from iccm.io import extensions, extras

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("extra", extensions.extras(), ids=lambda extra: extra.name)
def test_the_extra_that_a_message_names_installs_the_packages(extra):
    required = PROJECT["optional-dependencies"][extra.name]
    assert set(extra.packages.values()) == {re.match(r"[\w-]+", requirement)[0] for requirement in required}


def test_every_extra_of_users_is_known():
    names = PROJECT["optional-dependencies"].keys() - {"dev", "docs", "large"}
    assert names == {extra.name for extra in extensions.extras()}


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


@pytest.mark.slow
def test_maps_need_no_matplotlib_and_plots_say_what_does(shapes, iccm, tmp_path, monkeypatch):
    for name in ("matplotlib", "fontTools"):
        monkeypatch.setitem(sys.modules, name, None)
    assert iccm("map", shapes / "square.svg", shapes / "blob.svg", "-o", tmp_path / "a.png").code == 0
    assert iccm("map", "--text", "Ab", shapes / "blob.svg", "-o", tmp_path / "word.png").code == 0
    refused = iccm("map", shapes / "square.svg", shapes / "blob.svg", "--plot", tmp_path / "plot.png")
    assert refused.code == 2 and "iccm[plot]" in refused.err and not (tmp_path / "plot.png").exists()
    plot = "import sys; sys.modules['matplotlib'] = None; import iccm; iccm.fit([0, 1, 1 + 1j, 1j], [0, 2, 2j]).plot()"
    ended = subprocess.run([sys.executable, "-c", plot], capture_output=True, text=True)
    assert ended.returncode == 1 and ended.stderr.splitlines()[-1].startswith("iccm.errors.InputError")
    assert "iccm[plot]" in ended.stderr.splitlines()[-1]

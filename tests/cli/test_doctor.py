"""`iccm doctor`: every requirement of the installed package, and the messages about it."""

import json
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from iccm.native import library

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture
def findings(iccm):
    """`findings()` runs `iccm doctor --json` and returns the exit code and the findings by name."""

    def run():
        result = iccm("doctor", "--json")
        records = [json.loads(line) for line in result.out.splitlines()]
        return result.code, {finding["check"]: finding for finding in records}

    return run


def name_of(requirement: str) -> str:
    return requirement.partition(">=")[0]


def test_every_requirement_is_examined(findings):
    code, results = findings()
    groups = PROJECT["optional-dependencies"].items()
    extras = [name for extra, names in groups if extra not in ("dev", "docs", "large") for name in names]
    assert {name_of(requirement) for requirement in [*PROJECT["dependencies"], *extras]} <= results.keys()
    assert code == 0 and not [requirement for requirement in results.values() if requirement["ok"] is False]


def test_missing_and_outdated_packages_are_reported(findings, monkeypatch):
    def version(name, installed=metadata.version):
        if name in ("tinycss2", "distributed"):
            raise metadata.PackageNotFoundError(name)
        return {"click": "8.1.7", "uvicorn": "0.1", "tqdm": "999.0rc1"}.get(name) or installed(name)

    monkeypatch.setattr(metadata, "version", version)
    code, results = findings()
    outcomes = {name: (results[name]["ok"], results[name]["result"]) for name in results}
    assert code == 1 and outcomes["tinycss2"] == (False, "not installed")
    assert outcomes["distributed"] == (None, "not installed; pip install 'iccm[dask]' for iccm batch --dask")
    assert outcomes["click"] == (False, "8.1.7; click>=8.1.8 is needed")
    assert outcomes["uvicorn"] == (False, "0.1; uvicorn>=0.34 is needed for iccm edit")
    assert outcomes["tqdm"][0] is True


@pytest.mark.slow
@pytest.mark.parametrize("module", ["numpy", "tinycss2", "packaging"])
def test_doctor_runs_without_the_missing_library(module):
    code = f"import sys; sys.modules[{module!r}] = None\nfrom iccm import cli; sys.exit(cli.run(['doctor']))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    wrong = [line for line in result.stdout.splitlines() if line.startswith("WRONG") and module in line]
    assert result.returncode == 1 and wrong and "internal error" not in result.stderr


def test_a_core_that_is_missing_is_found(findings, monkeypatch, tmp_path):
    assert findings()[1]["core"]["result"].startswith("core")
    library.library.cache_clear()
    monkeypatch.setattr(library, "FOLDER", tmp_path / "iccm" / "native" / "lib")
    code, results = findings()
    assert code == 1 and results["core"]["ok"] is False and str(tmp_path) in results["core"]["result"]
    library.library.cache_clear()


def test_doctor_reports_missing_metadata(findings, monkeypatch):
    def requires(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "requires", requires)
    code, results = findings()
    assert code == 1 and results["requirements"]["result"] == "iccm is not installed"

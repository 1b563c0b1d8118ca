"""Scripts for other systems: the script of the GitHub action, and the files that call it."""

import importlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

import iccm

ROOT = Path(__file__).parents[1]
SCRIPT = ROOT / "packaging" / "check-jobs.sh"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the script is for bash")


ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


@pytest.fixture(scope="module")
def baselines(tmp_path_factory):
    """Make a manifest of one job, and its baselines."""
    folder = tmp_path_factory.mktemp("jobs")
    for name in ("square.svg", "blob.svg"):
        shutil.copy(ROOT / "tests" / "wheel" / name, folder)
    job = 'source = "square.svg"\ntarget = "blob.svg"\nsize = "48"\nfit = "whole"\noutput = "blob.png"\n'
    (folder / "jobs.toml").write_text(f"[[job]]\n{job}")
    first = ["iccm", "batch", "jobs.toml", "--root", "baselines"]
    subprocess.run(first, cwd=folder, env=ENVIRONMENT, check=True, capture_output=True)
    return folder


@pytest.fixture
def jobs(baselines, tmp_path):
    """Copy the manifest and its baselines, and return what runs the script there."""
    shutil.copytree(baselines, tmp_path, dirs_exist_ok=True)
    environment = {**ENVIRONMENT, "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md")}

    def run(*arguments):
        line = ["bash", str(SCRIPT), *arguments]
        return subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True)

    return run


@pytest.mark.slow
def test_jobs_are_run_and_compared(jobs, tmp_path):
    done = jobs("jobs.toml", "baselines", "results")
    assert done.returncode == 0, done.stderr
    assert {file.name for file in (tmp_path / "results").iterdir()} == {
        *("outputs", "results.jsonl", "check.html", "check.xml", "check.md")
    }
    summary = (tmp_path / "summary.md").read_text()
    assert summary and summary == (tmp_path / "results" / "check.md").read_text()


@pytest.mark.slow
def test_a_difference_is_a_failure_and_wrong_input_another(jobs, tmp_path):
    shutil.copy(ROOT / "samples" / "pins" / "face.png", tmp_path / "baselines" / "blob.png")
    assert jobs("jobs.toml", "baselines", "results").returncode == 1
    assert (tmp_path / "results" / "check.html").exists()
    absent = jobs("absent.toml", "baselines", "others")
    assert absent.returncode == 2 and "absent.toml" in absent.stderr
    assert not (tmp_path / "others" / "check.html").exists()
    assert jobs("jobs.toml").returncode == 2


COMMENT = ROOT / "packaging" / "comment.sh"
GH = """#!{python}
import json, os, sys
state = os.environ["COMMENTS"]  # [[id, text], …], as the server has them
if os.environ.get("REFUSED"):
    sys.exit("HTTP 403: Resource not accessible by integration")
words, given = sys.argv[2:], dict(zip(sys.argv[2:], sys.argv[3:]))
comments = json.load(open(state, encoding="utf-8"))
if "--method" not in words:
    assert "repos/us/pictures/issues/7/comments" in words and 'startswith("<!-- iccm' in given["--jq"]
    print(*(number for number, text in comments if text.startswith("<!-- iccm")), sep="\\n")
    sys.exit()
text = given["--raw-field"].removeprefix("body=")
if given["--method"] == "POST":
    assert "repos/us/pictures/issues/7/comments" in words
    comments.append([len(comments) + 11, text])
else:
    assert given["--method"] == "PATCH"
    number = int(next(word for word in words if word.startswith("repos/us/pictures/issues/comments/")).split("/")[-1])
    next(comment for comment in comments if comment[0] == number)[1] = text
json.dump(comments, open(state, "w", encoding="utf-8"))
"""


@pytest.fixture
def comment(tmp_path):
    """Return what comments a summary with a stand-in for gh, and returns the process and all comments."""
    gh = tmp_path / "bin" / "gh"
    gh.parent.mkdir()
    gh.write_text(GH.format(python=sys.executable), encoding="utf-8")
    gh.chmod(0o755)
    state = tmp_path / "comments.json"
    state.write_text('[[11, "looks good"]]', encoding="utf-8")
    environment = {
        **os.environ,
        "PATH": f"{gh.parent}{os.pathsep}{os.environ['PATH']}",
        "COMMENTS": str(state),
    }

    def run(text, **more):
        if text is not None:
            (tmp_path / "check.md").write_text(text, encoding="utf-8")
        line = ["bash", str(COMMENT), "check.md", "us/pictures", "7"]
        result = subprocess.run(
            line, cwd=tmp_path, env={**environment, **more}, capture_output=True, text=True
        )
        return result, json.loads(state.read_text(encoding="utf-8"))

    return run


def test_a_later_run_replaces_the_comment_of_an_earlier_one(comment):
    done, comments = comment("2 files, **1 different**\n\n| `a b` |\n")
    assert done.returncode == 0, done.stderr
    assert comments[0] == [11, "looks good"] and "\n2 files, **1 different**\n\n| `a b` |" in comments[1][1]
    done, comments = comment("all as before")
    assert done.returncode == 0 and len(comments) == 2
    assert "all as before" in comments[1][1] and "different" not in comments[1][1]


def test_comments_that_are_not_permitted_do_not_fail_the_run(comment):
    done, comments = comment("1 different", REFUSED="1")
    assert done.returncode == 0 and "::warning::" in done.stdout and len(comments) == 1


def test_without_a_comparison_there_is_no_comment(comment):
    done, comments = comment(None)
    assert done.returncode == 0 and len(comments) == 1


def test_the_action_uses_the_inputs_that_it_declares():
    action = (ROOT / "action.yml").read_text()
    declared = set(re.findall(r"^  ([\w-]+):$", action.split("runs:")[0], re.M))
    assert declared == set(re.findall(r"inputs\.([\w-]+)", action)) and "manifest" in declared
    for script in set(re.findall(r"packaging/[\w-]+\.sh", action)):
        assert (ROOT / script).is_file()
    assert "packaging/check-jobs.sh" in action


def lines_of_step(run, environment, folder):
    """Run shell lines as the runners of GitHub and GitLab do: in bash, ending at the first failure."""
    line = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", run]
    return subprocess.run(line, cwd=folder, env=environment, capture_output=True, text=True)


def given(text, inputs):
    """The value of a line of the action, with its inputs."""
    return re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda name: inputs[name[1]], text)


@pytest.mark.slow
def test_the_action_runs_its_own_lines(jobs, tmp_path):
    action = yaml.safe_load((ROOT / "action.yml").read_text())
    inputs = {name: entry.get("default", "") for name, entry in action["inputs"].items()}
    inputs |= {"manifest": "jobs.toml", "baselines": "baselines"}
    environment = {
        **ENVIRONMENT,
        "GITHUB_ACTION_PATH": str(ROOT),
        "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md"),
    }
    steps = [step for step in action["runs"]["steps"] if "check-jobs.sh" in step.get("run", "")]
    assert len(steps) == 1
    values = {name: given(value, inputs) for name, value in steps[0]["env"].items()}
    done = lines_of_step(steps[0]["run"], environment | values, tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / inputs["results"] / "check.md").is_file() and (tmp_path / "summary.md").stat().st_size
    uploads = [step["with"] for step in action["runs"]["steps"] if "upload-artifact" in step.get("uses", "")]
    assert [given(entry["path"], inputs) for entry in uploads] == [inputs["results"]]


@pytest.mark.slow
def test_the_template_for_gitlab_runs_and_keeps_its_report_of_a_difference(jobs, tmp_path):
    template = yaml.safe_load((ROOT / "packaging" / "gitlab.yml").read_text())[".iccm-check"]
    install, *lines = template["script"]
    assert install.startswith("python -m pip install ")
    environment = ENVIRONMENT | template["variables"]
    assert lines_of_step("\n".join(lines), environment, tmp_path).returncode == 0
    shutil.copy(ROOT / "samples" / "pins" / "face.png", tmp_path / "baselines" / "blob.png")
    shutil.rmtree(tmp_path / "iccm-results")
    done = lines_of_step("\n".join(lines), environment, tmp_path)
    assert done.returncode == 1, done.stderr
    kept = [*template["artifacts"]["paths"], template["artifacts"]["reports"]["junit"]]
    assert all((tmp_path / name).exists() for name in kept) and template["artifacts"]["when"] == "always"


@pytest.mark.slow
def test_the_hook_checks_manifests_and_names_the_mistake(tmp_path):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
    for name in ("square.svg", "blob.svg"):
        shutil.copy(ROOT / "tests" / "wheel" / name, tmp_path)
    good = '[[job]]\nsource = "square.svg"\ntarget = "blob.svg"\noutput = "blob.png"\n'
    (tmp_path / "jobs.toml").write_text(good)
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "jobs.toml").write_text(good.replace("square.svg", "missing.svg"))
    for files, code in ((["jobs.toml"], 0), (["jobs.toml", "more/jobs.toml"], 2)):
        assert all(re.search(hook["files"], name) for name in files)
        line = [*shlex.split(hook["entry"]), *files]  # as pre-commit does
        done = subprocess.run(line, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
        assert done.returncode == code and ("missing.svg" in done.stderr) == bool(code), done.stderr
    assert not (tmp_path / "blob.png").exists()


OF_CONDA = {
    "isal": "python-isal",
    "libigl": "igl",
    "openimageio": "py-openimageio",
}


def test_the_conda_recipe_requires_the_projects_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = (ROOT / "packaging" / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    listed = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    needed = {f"python {project['requires-python']}"}
    for requirement in project["dependencies"]:
        name, _, bound = requirement.partition(">=")
        needed.add(f"{OF_CONDA.get(name.lower(), name)} >={bound}")
    assert {line.strip(" -") for line in listed.splitlines()} == needed
    assert f'version: "{iccm.__version__}"' in recipe
    for name, place in project["scripts"].items():
        assert f"- {name} = {place}\n" in recipe


@pytest.fixture
def page(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "core"))
    for name in ("ICCM_REPOSITORY", "GITHUB_SERVER_URL", "GITHUB_REPOSITORY", "GITHUB_REF_NAME"):
        monkeypatch.delenv(name, raising=False)
    return importlib.import_module("package_page")


README = """\
# Title

![a heart](docs/heart.png)

| 1 | 2 |
|---|---|
| ![a](docs/a.png) | ![b](docs/b.svg) |

| command | purpose |
|---|---|
| `iccm map` | see [Options](docs/map.md) and [the paper](https://paper.example) |
"""


def test_without_an_address_the_page_has_no_pictures_and_no_broken_links(page):
    assert page.repository() is None and page.links(None) == {}
    text = page.description(README, None)
    assert [line for line in text.splitlines() if line] == [
        "# Title",
        "| command | purpose |",
        "|---|---|",
        "| `iccm map` | see Options and [the paper](https://paper.example) |",
    ]


def test_with_an_address_pictures_and_links_are_absolute(page, monkeypatch):
    monkeypatch.setenv("GITHUB_SERVER_URL", "https://host.example")
    monkeypatch.setenv("GITHUB_REPOSITORY", "us/iccm")
    monkeypatch.setenv("GITHUB_REF_NAME", "v1.2.0")
    address = page.repository()
    text = page.description(README, address)
    base = "https://host.example/us/iccm"
    assert f"![a heart]({base}/raw/v1.2.0/docs/heart.png)" in text and "(docs/" not in text
    assert f"[Options]({base}/blob/v1.2.0/docs/map.md)" in text and "(https://paper.example)" in text
    assert page.links(address)["Source"] == base


def test_the_readme_leaves_nothing_relative_on_the_page(page):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    plain = page.description(readme, None)
    assert "](docs" not in plain and "![" not in plain and "## Six results" in plain
    assert "](docs" not in page.description(readme, "https://host.example/us/iccm")

"""List what is public, one entry a line: commands, options, exit codes, schemas, saved maps, Python names.

python -m tests.public_surface              # print the list
python -m tests.public_surface --record     # write the additions since the last release to tests/public/unreleased.txt
python -m tests.public_surface --release    # at a release: make the list that of the release, tests/public/released.txt

`tests/test_public_surface.py` compares the list with both files.
"""

import argparse
import inspect
import json
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Annotated, Literal, get_args, get_origin

import click

import iccm
from iccm import cli, result
from iccm.io import options
from iccm.options import ROWS
from iccm.solve import FORMER_NAMES

ROOT = Path(__file__).parents[1]
RELEASED = ROOT / "tests" / "public" / "released.txt"
UNRELEASED = ROOT / "tests" / "public" / "unreleased.txt"
SCHEMAS = ROOT / "docs" / "reference" / "schemas"
MODULES = ("iccm", "iccm.io.run")


def entries() -> list[str]:
    """Return the public surface of the code, sorted."""
    names = {*of_commands(), *of_settings(), *of_exit_codes(), *of_schemas(), *of_saved_maps()}
    for module in MODULES:
        names.update(of_module(module))
    names.update((*of_jobs(), *of_solver(), *of_former_attributes()))
    return sorted(names)


def of_commands() -> Iterator[str]:
    """Yield the commands with their arguments, options, former names of options, and choices."""
    for name in cli.COMMANDS:
        yield from of_command(f"iccm {name}", import_module(f"iccm.cli.{name}").command)


def of_command(path: str, command: click.Command) -> Iterator[str]:
    """Yield a command, its parameters and its subcommands."""
    yield f"command {path}"
    context = click.Context(command, info_name=path)
    parameters = command.get_params(context)
    arguments = [parameter for parameter in parameters if isinstance(parameter, click.Argument)]
    yield from (f"argument {path} {number}" for number, _ in enumerate(arguments, start=1))
    for parameter in parameters:
        if isinstance(parameter, click.Option):
            yield from of_option(path, [*parameter.opts, *parameter.secondary_opts], parameter.type)
    for name, row in getattr(command, "accepted", {}).items():
        words = (name, *row.old, *(alias for alias, _ in row.aliases))
        yield from of_option(path, [f"--{word.replace('_', '-')}" for word in words], literals().get(name))
    for name, inner in getattr(command, "commands", {}).items():
        yield from of_command(f"{path} {name}", inner)


def of_option(path: str, names: list[str], kind: object) -> Iterator[str]:
    """Yield the names of an option, former ones included, and the values that it takes where they are listed."""
    choices = kind.choices if isinstance(kind, click.Choice) else get_args(kind)
    for name in names:
        yield f"option {path} {name}"
        if name.startswith("--"):
            yield from (f"value {path} {name} {choice}" for choice in choices if isinstance(choice, str))


@cache
def literals() -> dict[str, object]:
    """Return the types of the options that take one of a few words."""
    values = {}
    for table in vars(options).values():
        for name, hint in getattr(table, "__annotations__", {}).items():
            if get_origin(hint) is Annotated and get_origin(get_args(hint)[0]) is Literal:
                values[name] = get_args(hint)[0]
    return values


def of_settings() -> Iterator[str]:
    """Yield the environment variables that set limits."""
    from iccm.cli import settings

    yield from (f"environment {settings.variable(name)}" for name in settings.LIMITS)
    yield f"environment {settings.FILE_VARIABLE}"


def of_exit_codes() -> Iterator[str]:
    """Yield the exit codes that the reference documents."""
    text = (ROOT / "docs" / "reference" / "exit-codes.md").read_text(encoding="utf-8")
    for line in text.partition("| exit code |")[2].partition("\n\n")[0].splitlines():
        cell = line.strip("| ").partition(" | ")[0]
        if cell[:1].isdigit():
            yield f"exit-code {cell}"


def of_schemas() -> Iterator[str]:
    """Yield the JSON schemas with their keys; those that are always there are marked."""
    for path in sorted(SCHEMAS.glob("*.json")):
        schema = json.loads(path.read_text(encoding="utf-8"))
        name = path.stem.removeprefix("iccm.")
        yield f"schema {name}"
        yield from of_object(f"schema {name}", schema, schema, "")


def of_object(label: str, node: dict, root: dict, place: str) -> Iterator[str]:
    """Yield the keys of a JSON object, and of the objects in it."""
    if "$ref" in node:
        node = root["$defs"][node["$ref"].rpartition("/")[2]]
    for key, inner in node.get("properties", {}).items():
        yield f"{label} {place}{key}"
        if key in node.get("required", ()):
            yield f"{label} {place}{key} (always)"
        yield from of_object(label, inner, root, f"{place}{key}.")
    if "items" in node:
        yield from of_object(label, node["items"], root, place.removesuffix(".") + "[].")


def of_saved_maps() -> Iterator[str]:
    """Yield the format of saved maps."""
    from iccm.saved import map_file

    yield f"saved-map {map_file.FORMAT}"


def of_module(name: str) -> Iterator[str]:
    """Yield the names of a module, the parameters of its functions, and the attributes of its classes."""
    module = import_module(name)
    for public in module.__all__:
        thing = getattr(module, public)
        yield f"python {name}.{public}"
        yield from of_callable(f"{name}.{public}", thing)
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            yield from of_class(f"{name}.{public}", thing)


def of_jobs() -> Iterator[str]:
    """Yield the keys of a job, which manifests and Python have; former ones included."""
    from iccm.io.run import Job

    yield from (f"job {name}" for name in fields(Job) if not name.startswith("_"))
    for _, option in options.options_of().values():
        yield from (f"job {name}" for name in option.old)


def of_solver() -> Iterator[str]:
    """Yield the options of the solver, which `iccm.fit`, `deform` and `transfer` take by name; former ones included."""
    yield from (f"solver-option {name}" for name in (*ROWS, *FORMER_NAMES))


def of_former_attributes() -> Iterator[str]:
    """Yield the former names of attributes, which work with a warning."""
    yield from (f"python iccm.Fit.{name}" for name in result.FORMER_NAMES)
    yield from (
        "python iccm.Fit(ended=)",
        "python iccm.Fit(passed_holes=)",
        *(f"python iccm.Fit({name}=)" for name in result.DETAILS),
        "python iccm.Fit.outline_of(region=)",
    )


def of_callable(path: str, thing: object) -> Iterator[str]:
    """Yield the public parameters of a function or class."""
    try:
        parameters = inspect.signature(thing).parameters
    except (TypeError, ValueError):
        return
    for name, parameter in parameters.items():
        is_public = not name.startswith("_") and name not in ("self", "cls")
        if is_public and parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            yield f"python {path}({name}=)"


def fields(thing: type) -> set[str]:
    """Return the annotated names of a class and of its bases in this package."""
    owners = [owner for owner in thing.__mro__ if owner.__module__.partition(".")[0] == "iccm"]
    return {name for owner in owners for name in getattr(owner, "__annotations__", {})}


def of_class(path: str, thing: type) -> Iterator[str]:
    """Yield the public attributes of a class that its own code declares, and the parameters of its methods."""
    owners = [owner for owner in thing.__mro__ if owner.__module__.partition(".")[0] == "iccm"]
    names = {name for owner in owners for name in vars(owner)}
    if hasattr(
        thing, "model_dump"
    ):  # a job: its fields are listed as its keys, and these methods are pydantic's
        names -= {name for name in names if name.startswith("model_")} | fields(thing)
    else:
        names |= fields(thing)
    for name in sorted(name for name in names if not name.startswith("_")):
        yield f"python {path}.{name}"
        attribute = inspect.getattr_static(thing, name, None)
        attribute = getattr(attribute, "__func__", attribute)
        if inspect.isfunction(attribute):
            yield from of_callable(f"{path}.{name}", attribute)


def read(path: Path) -> list[str]:
    """Return the entries of a file, without comments."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def write(path: Path, comment: str, lines: list[str]) -> None:
    """Write entries to a file."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join([f"# {comment}", *lines]) + "\n", encoding="utf-8", newline="\n")


def main() -> None:
    """Print the list, or write it."""
    parser = argparse.ArgumentParser(prog="python -m tests.public_surface")
    parser.add_argument("--record", action="store_true", help="write the additions since the last release")
    parser.add_argument("--release", action="store_true", help="make the list that of a release")
    options = parser.parse_args()
    current = entries()
    if options.release:
        write(RELEASED, f"Public in iccm {iccm.__version__}.", current)
        write(UNRELEASED, "Public since then.", [])
    elif options.record:
        released = set(read(RELEASED))
        write(UNRELEASED, "Public since then.", [entry for entry in current if entry not in released])
    else:
        print(*current, sep="\n")


if __name__ == "__main__":
    main()

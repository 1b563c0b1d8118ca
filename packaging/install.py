"""Install iccm into the environment that runs this script: python packaging/install.py [EXTRA ...]

pip's output is reduced to a line for each package that is downloaded, with its size, and a line with the total.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WHEEL = re.compile(
    r"\s*(?:Downloading|Using cached) (?:\S*/)?([^-\s/]+)-([^-\s]+)-\S+\.whl(?:\.metadata)? \((.+?)\)"
)
"""A line of pip about a wheel: name, version and size. Lines about its metadata have the same form."""
ENVIRONMENT = Path(sys.prefix)


def megabytes(folder: Path) -> float:
    """Return the size of all files in a folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def install(extras: list[str]) -> int:
    """Install iccm from this checkout, editable, or extras of the installed one; return pip's exit code.

    pip's output follows a failure.
    """
    package = f"iccm[{','.join(extras)}]" if extras else "iccm"
    print(
        f"Installing {package} into {ENVIRONMENT.name}, for Python {sys.version.partition(' ')[0]}:",
        flush=True,
    )
    start, output = time.perf_counter(), []
    # modules are compiled when they are first imported: most are not
    options = ["--disable-pip-version-check", "--progress-bar", "off", "--no-compile"]
    command = [sys.executable, "-m", "pip", "install", *options, *([package] if extras else ["-e", "."])]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as pip:
        assert pip.stdout is not None
        for line in pip.stdout:
            output.append(line)
            wheel = WHEEL.match(line)
            if wheel and ".metadata" not in line:
                print("  {:28} {:14} {}".format(*wheel.groups()), flush=True)
    if pip.returncode:
        sys.stdout.writelines(output)
    else:
        seconds = time.perf_counter() - start
        print(f"{ENVIRONMENT.name} has {megabytes(ENVIRONMENT):.0f} MB now ({seconds:.0f} s)", flush=True)
    return pip.returncode


if __name__ == "__main__":
    sys.exit(install(sys.argv[1:]))

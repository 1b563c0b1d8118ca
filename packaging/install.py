"""Install iccm into the environment that runs this script: python packaging/install.py [EXTRA ...]

pip's output is reduced to a line for each package that is downloaded, with its size, and a line with the total.
"""

import ensurepip
import os
import re
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WHEEL = re.compile(
    r"\s*(?:Downloading|Using cached) (?:\S*/)?([^-\s/]+)-([^-\s]+)-\S+\.whl(?:\.metadata)? \((.+?)\)"
)
"""A line of pip about a wheel: name, version and size. Lines about its metadata have the same form."""
ENVIRONMENT = Path(sys.prefix)
os.environ["PIP_NO_COMPILE"] = "1"  # modules are compiled when they are first imported: most are not


def megabytes(folder: Path) -> float:
    """Return the size of all files in a folder."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def install_pip() -> None:
    """Install the newest pip, as that of Python 3.11 needs twice the time to choose among the files of an index.

    The pip that Python brings runs from its wheel: to install it first would compile all of it.
    """
    # some distributions keep the wheel in a folder of their own
    own = sysconfig.get_config_var("WHEEL_PKG_DIR")
    folders = [Path(own)] if own else []
    folders.append(Path(ensurepip.__file__).with_name("_bundled"))
    wheels = [wheel for folder in folders for wheel in folder.glob("pip-*.whl")]
    command = [f"{wheels[0]}/pip"] if wheels else ["-m", "ensurepip"]
    arguments = ["install", "--quiet", "--disable-pip-version-check", "pip"] if wheels else []
    done = subprocess.run([sys.executable, *command, *arguments], check=False)
    if done.returncode and wheels:
        subprocess.run([sys.executable, "-m", "ensurepip"], check=True)


def install(extras: list[str]) -> int:
    """Install iccm from this checkout, editable and with its figures, or extras of the installed one; return pip's
    exit code.

    pip's output follows a failure.
    """
    package = f"iccm[{','.join(extras or ['plot'])}]"
    print(
        f"Installing {package} into {ENVIRONMENT.name}, for Python {sys.version.partition(' ')[0]}:",
        flush=True,
    )
    start, output = time.perf_counter(), []
    pip_install = [sys.executable, "-m", "pip", "install", "--disable-pip-version-check"]
    if not extras:
        install_pip()
    command = [*pip_install, "--progress-bar", "off", *([package] if extras else ["-e", ".[plot]"])]
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

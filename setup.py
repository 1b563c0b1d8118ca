"""What pyproject.toml cannot say of the build: libraries of the core, in a wheel for every Python 3, and packages."""

import shutil
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT / "core"))

from compile import compile_checkout, compile_core, find_compiler, library_names, sources  # noqa: E402
from package_folders import package_folders  # noqa: E402
from package_page import description, links, repository  # noqa: E402


class BuildCore(build_ext):
    """Compiles the core with `core/compile.py` instead of as extensions of one Python."""

    def build_extensions(self) -> None:
        """Write the libraries, all at once; setuptools copies them beside the sources if that is asked for.

        For an editable installation, the objects are kept in the checkout, as by `core/compile.py`, so that nothing is
        compiled twice, and only the variant for this processor is compiled.
        """
        folder = Path(self.build_lib) / "iccm" / "native" / "lib"
        if self.editable_mode:
            folder.mkdir(parents=True, exist_ok=True)
            libraries = compile_checkout()
            for library in libraries:
                shutil.copy2(library, folder)
            compiled = {library.name for library in libraries}
            self.extensions = [
                one for one in self.extensions if FILES[one.name.rpartition(".")[2]] in compiled
            ]
            return
        compile_core(folder.resolve(), find_compiler(), Path(self.build_temp).resolve() / "core")

    def copy_extensions_to_source(self) -> None:
        """Make the libraries' folder, which a fresh checkout lacks, and copy them there."""
        (ROOT / "iccm" / "native" / "lib").mkdir(parents=True, exist_ok=True)
        super().copy_extensions_to_source()

    def get_ext_filename(self, fullname: str) -> str:
        """Return a library's file, whose name holds nothing of Python's."""
        *folders, name = fullname.split(".")
        return str(Path(*folders, FILES[name]))

    def get_export_symbols(self, ext: Extension) -> list[str]:
        """Nothing of a Python module's."""
        return []


class CoreWheel(bdist_wheel):
    """A wheel that fits every Python 3 on one platform."""

    def get_tag(self) -> tuple[str, str, str]:
        """Of the wheel's file name."""
        return "py3", "none", super().get_tag()[2]


FILES = {name.partition(".")[0].replace("-", "_"): name for name in library_names()}
SOURCES = [str(path.relative_to(ROOT)) for path in sources()]
FOLDERS = package_folders(ROOT)
setup(
    long_description=description((ROOT / "README.md").read_text(encoding="utf-8"), repository()),
    long_description_content_type="text/markdown",
    project_urls=links(repository()),
    packages=list(FOLDERS),
    package_dir=FOLDERS,
    ext_modules=[Extension(f"iccm.native.lib.{name}", SOURCES) for name in FILES],
    cmdclass={"build_ext": BuildCore, "bdist_wheel": CoreWheel},
)

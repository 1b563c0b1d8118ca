"""Compile the core into one shared library for each variant of the processor.

As a script, it brings the library for this processor in the package's own folder up to date, which takes half as long
as all variants, or the libraries of all variants in another folder:

    python core/compile.py [FOLDER]

It needs only a C++17 compiler: the one that CXX names, else c++, g++ or clang++, else the one in the package
`ziglang`. Objects are kept in build/core, and only those whose sources changed are compiled again.
"""

import argparse
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

CORE = Path(__file__).resolve().parent
FOLDER = CORE.parent / "iccm" / "native" / "lib"
FLAGS = (
    "-std=c++17",
    "-O3",
    # results must not depend on the compiler or the processor: no fused multiply-add, no reordered sums
    "-ffp-contract=off",
    "-fno-exceptions",
    "-fno-rtti",
    "-fno-threadsafe-statics",
    # errno and floating-point exceptions are not used; without them loops with roots and comparisons are
    # vectorised
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fvisibility=hidden",
    "-Wall",
    "-Wextra",
    "-Wno-unknown-pragmas",
    "-Wno-psabi",  # wide registers are passed between inlined functions only
    f"-I{CORE / 'include'}",
    f"-I{CORE}",
)
WIDE_FEATURES = {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"}
"""What processors of the level x86-64-v3 have, as Linux names it."""
DETECTION = CORE / "runtime" / "processor.cpp"
"""Runs before the processor is known, so that it is compiled for the oldest one in every variant."""
SYSTEM_COMPILERS = "c++", "g++", "clang++"
ENDINGS = {"linux": ".so", "macos": ".dylib", "windows": ".dll", "wasi": ".wasm"}


class Variant(NamedTuple):
    """A variant of the library for some processors.

    Attributes:
        name: the library's file name without its ending.
        flags: the compiler's options for these processors.
    """

    name: str
    flags: tuple[str, ...] = ()


class Compiler(NamedTuple):
    """A compiler and the platform for which it compiles.

    Attributes:
        command: the command that compiles C++.
        link: the command that links, without the C++ standard library.
        system: linux, macos, windows or wasi.
        machine: x86_64 or another architecture.
        zig: whether the compiler is ziglang's, which has its own options for processors.
    """

    command: tuple[str, ...]
    link: tuple[str, ...]
    system: str
    machine: str
    zig: bool = False

    @property
    def ending(self) -> str:
        """The file name ending of shared libraries, such as ".so"."""
        return ENDINGS[self.system]

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The variants of the library for the machine."""
        if self.machine == "x86_64":
            # FMA instructions are disabled altogether: GCC 12 uses them when it vectorises complex products,
            # whatever -ffp-contract says
            old, wide = ("-march=x86-64",), ("-march=x86-64-v3", "-mno-fma")
            if self.zig:
                old, wide = ("-mcpu=x86_64",), ("-mcpu=x86_64_v3-fma",)
            return Variant("core-x86-64", old), Variant("core-x86-64-v3", wide)
        return (Variant("core", ("-msimd128",) if self.system == "wasi" else ()),)


def this_machine() -> tuple[str, str]:
    """Return the system and the architecture of this machine, as in `Compiler`."""
    system = {"Darwin": "macos", "Windows": "windows"}.get(platform.system(), "linux")
    return system, {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())


def library_names() -> list[str]:
    """Return the file names of this machine's libraries; this does not need a compiler."""
    system, machine = this_machine()
    compiler = Compiler((), (), system, machine)
    return [variant.name + compiler.ending for variant in compiler.variants]


def suitable(variants: tuple[Variant, ...]) -> tuple[Variant, ...]:
    """Return the variant that suits this processor; all variants where Linux does not list its features."""
    try:
        features = set(Path("/proc/cpuinfo").read_text(encoding="utf-8").split())
    except OSError:
        return variants
    return variants[-1:] if features >= WIDE_FEATURES else variants[:1]


def system_compiler() -> list[str] | None:
    """Return the command of the installed compiler, or None if there is none."""
    for name in (os.environ.get("CXX", ""), *SYSTEM_COMPILERS):
        command = shlex.split(name)
        if command and shutil.which(command[0]):
            return command
    return None


def find_compiler(target: str | None = None) -> Compiler:
    """Find the system's compiler, or ziglang's if there is none or if a target is given.

    Args:
        target: a platform as Zig names it, such as aarch64-macos; by default this machine.

    Raises:
        SystemExit: neither compiler is installed.
    """
    if target is None:
        system, machine = this_machine()
        if command := system_compiler():
            # --as-needed drops the unused C++ standard library
            link = ("-Wl,--as-needed",) if system == "linux" else ()
            return Compiler(tuple(command), (*command, *link), system, machine)
        options: tuple[str, ...] = ()
    else:
        machine, system = target.split("-")[:2]
        system = system.partition(".")[0]  # macos.11.0
        options = "-target", target
    if importlib.util.find_spec("ziglang") is None:
        raise SystemExit(
            "the compiled core needs a C++17 compiler: install one (g++ or clang++), or the package ziglang with pip"
        )
    zig = sys.executable, "-m", "ziglang", "cc", *options
    return Compiler((*zig, "-x", "c++"), zig, system, machine, zig=True)


def sources() -> list[Path]:
    """Return the source files of the core, sorted."""
    return sorted(CORE.rglob("*.cpp"))


def compile_core(
    folder: Path,
    compiler: Compiler,
    objects: Path | None = None,
    jobs: int | None = None,
    variants: tuple[Variant, ...] | None = None,
) -> list[Path]:
    """Compile the sources that changed, and link the libraries.

    Args:
        folder: where the libraries are written.
        compiler: the compiler.
        objects: folder for object files; by default build/core in the repository.
        jobs: number of files compiled at a time; by default one for each processor core.
        variants: those to compile; by default all.

    Returns:
        The paths of the libraries.

    Raises:
        SystemExit: a source does not compile (the compiler's messages are on stderr), or linking fails.
    """
    objects = objects or CORE.parent / "build" / "core"
    folder.mkdir(parents=True, exist_ok=True)
    header = max(file.stat().st_mtime for file in [*CORE.rglob("*.h"), Path(__file__)])
    position = ("-fPIC",) if compiler.system in ("linux", "macos") else ()
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        made = {
            variant: [
                (pool.submit(_compile, compiler, [*FLAGS, *position, *flags], source, header, to), to)
                for source in sources()
                for to in [_object(objects, variant, source)]
                for flags in [(compiler.variants[0] if source == DETECTION else variant).flags]
            ]
            for variant in variants or compiler.variants
        }
        failed = [job for jobs_of in made.values() for job, _ in jobs_of if not job.result()]
    if failed:
        raise SystemExit(
            f"the compiled core: {len(failed)} of its files cannot be compiled with {compiler.command[0]}"
        )
    libraries = []
    for variant, jobs_of in made.items():
        library = folder / (variant.name + compiler.ending)
        _link(compiler, [to for _, to in jobs_of], library)
        libraries.append(library)
    return libraries


def compile_checkout(jobs: int | None = None) -> list[Path]:
    """Bring the library for this processor beside the package's sources up to date, and remove those of others."""
    compiler = find_compiler()
    libraries = compile_core(FOLDER, compiler, jobs=jobs, variants=suitable(compiler.variants))
    for path in FOLDER.glob(f"core*{compiler.ending}"):
        if path not in libraries:
            path.unlink()
    return libraries


def _object(objects: Path, variant: Variant, source: Path) -> Path:
    return objects / variant.name / ("-".join(source.relative_to(CORE).with_suffix(".o").parts))


def _compile(compiler: Compiler, flags: list[str], source: Path, header: float, to: Path) -> bool:
    """Compile a source unless its object is up to date; return whether that succeeds."""
    command = [*compiler.command, *flags, "-c", str(source)]
    record = to.with_suffix(".command")
    newer = to.is_file() and to.stat().st_mtime > max(source.stat().st_mtime, header)
    if newer and record.is_file() and record.read_text() == shlex.join(command):
        return True
    to.parent.mkdir(parents=True, exist_ok=True)
    part = to.with_suffix(f".{os.getpid()}.o")
    done = subprocess.run([*command, "-o", str(part)])
    if done.returncode:
        part.unlink(missing_ok=True)
        return False
    part.replace(to)
    record.write_text(shlex.join(command))
    return True


def _link(compiler: Compiler, objects: list[Path], library: Path) -> None:
    """Link objects into a library, which replaces an old one only when complete."""
    options: dict[str, tuple[str, ...]] = {
        "linux": ("-shared", "-Wl,-s", "-lm"),
        "macos": ("-shared", f"-Wl,-install_name,@rpath/{library.name}", "-lm"),
        "windows": ("-shared",),
        # a module without a start function, in which the host allocates memory, and adds callbacks to the table
        "wasi": (
            "-mexec-model=reactor",
            "-Wl,-s,--export-dynamic,--export=malloc,--export=free,--export-table,--growable-table",
            "-lm",
        ),
    }
    with tempfile.TemporaryDirectory(dir=library.parent, prefix=".linking-") as folder:
        part = Path(folder) / library.name
        command = [*compiler.link, "-o", str(part), *map(str, objects), *options[compiler.system]]
        if subprocess.run(command).returncode:
            raise SystemExit(f"the compiled core: {compiler.link[0]} cannot link {library.name}")
        part.replace(library)


def main() -> None:
    """Bring the libraries of a folder up to date."""
    parser = argparse.ArgumentParser(description="Compile iccm's core.")
    parser.add_argument("folder", nargs="?", type=Path, help="by default the package's own")
    parser.add_argument(
        "--target", help="a platform as Zig names it, such as aarch64-macos; by default this one"
    )
    parser.add_argument(
        "--jobs", type=int, help="how many files to compile at a time; by default one for each core"
    )
    args = parser.parse_args()
    if args.folder is None and args.target is None:
        libraries = compile_checkout(args.jobs)
    else:
        objects = CORE.parent / "build" / (f"core-{args.target}" if args.target else "core")
        libraries = compile_core(args.folder or FOLDER, find_compiler(args.target), objects, args.jobs)
    for library in libraries:
        print(library)


if __name__ == "__main__":
    main()

"""How the core is compiled and packaged: with the system's compiler, with ziglang's, and for other platforms."""

import base64
import ctypes
import hashlib
import importlib
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMPILERS = ("c++", "g++", "clang++", "cc", "gcc", "clang", "zig")


@pytest.fixture
def core(monkeypatch):
    """Modules in the folder core, by name."""
    monkeypatch.syspath_prepend(str(ROOT / "core"))
    return importlib.import_module


@pytest.fixture
def no_compilers(tmp_path):
    """A PATH whose folders are copies of the current ones, as links, without compilers."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for directory in os.environ["PATH"].split(os.pathsep):
        for program in Path(directory).glob("*") if Path(directory).is_dir() else ():
            name = program.name
            if not name.startswith(COMPILERS) and "-gcc" not in name and "-g++" not in name:
                link = folder / name
                if not link.is_symlink():
                    link.symlink_to(program)
    return str(folder)


def test_ziglang_is_required_where_there_is_no_compiler(core, monkeypatch, no_compilers):
    pytest.importorskip("setuptools")
    backend, compile = core("backend"), core("compile")
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", no_compilers)
    assert compile.system_compiler() is None
    assert [name.partition(">")[0] for name in backend.missing_compiler()] == ["ziglang"]
    (Path(no_compilers) / "g++").symlink_to(sys.executable)
    assert compile.system_compiler() == ["g++"]
    assert backend.missing_compiler() == []


def test_the_compiler_of_the_environment_comes_first(core, monkeypatch):
    monkeypatch.setenv("CXX", f"{sys.executable} -x")
    assert core("compile").system_compiler() == [sys.executable, "-x"]
    monkeypatch.setenv("CXX", "no-such-compiler")
    assert core("compile").system_compiler() != ["no-such-compiler"]


def test_a_fault_in_a_source_is_reported(core, monkeypatch, tmp_path, capfd):
    compile = core("compile")
    if compile.system_compiler() is None:
        pytest.skip("needs a compiler")
    bad = tmp_path / "bad.cpp"
    bad.write_text("int f( { return 1; }\n")
    monkeypatch.setattr(compile, "CORE", tmp_path)
    with pytest.raises(SystemExit, match="cannot be compiled"):
        compile.compile_core(tmp_path / "lib", compile.find_compiler(), tmp_path / "objects")
    assert "bad.cpp" in capfd.readouterr().err
    assert not list((tmp_path / "lib").glob("core*"))


def test_only_changed_sources_are_recompiled(core, monkeypatch, tmp_path):
    compile = core("compile")
    if compile.system_compiler() is None:
        pytest.skip("needs a compiler")
    for name in ("one", "two"):
        (tmp_path / f"{name}.cpp").write_text(f'extern "C" int {name}() {{ return 1; }}\n')
    monkeypatch.setattr(compile, "CORE", tmp_path)
    arguments = tmp_path / "lib", compile.find_compiler(), tmp_path / "objects"
    libraries = compile.compile_core(*arguments)
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "objects").rglob("*.o")}
    source = tmp_path / "two.cpp"
    source.write_text(source.read_text().replace("1", "2"))
    os.utime(source, ns=(2 * max(times.values()) - min(times.values()) + 10**9,) * 2)
    compile.compile_core(*arguments)
    changed = {path.stem for path, time in times.items() if path.stat().st_mtime_ns != time}
    assert changed == {"two"} and len(times) == 2 * len(libraries)


def unpacked(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_wheel_of_another_platform_has_its_libraries_and_tags(core, tmp_path):
    wheels = core("wheels")
    native = tmp_path / "iccm-1.2.3-py3-none-linux_x86_64.whl"
    with zipfile.ZipFile(native, "w") as archive:
        archive.writestr("iccm/__init__.py", "x = 1\n")
        archive.writestr("iccm/native/lib/core-x86-64.so", b"native")
        archive.writestr("iccm-1.2.3.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-linux_x86_64\n")
        archive.writestr("iccm-1.2.3.dist-info/RECORD", "iccm/__init__.py,,\n")
    library = tmp_path / "core.dylib"
    library.write_bytes(b"another")
    platform = wheels.Platform("aarch64-macos.11.0", ("macosx_11_0_arm64", "macosx_12_0_arm64"))
    wheel = wheels.wheel_for(platform, native, [library], tmp_path)
    assert wheel.name == "iccm-1.2.3-py3-none-macosx_11_0_arm64.macosx_12_0_arm64.whl"
    files = unpacked(wheel)
    assert files["iccm/native/lib/core.dylib"] == b"another"
    assert "iccm/native/lib/core-x86-64.so" not in files
    tags = [line for line in files["iccm-1.2.3.dist-info/WHEEL"].decode().splitlines() if "Tag" in line]
    assert tags == ["Tag: py3-none-macosx_11_0_arm64", "Tag: py3-none-macosx_12_0_arm64"]
    lines = files["iccm-1.2.3.dist-info/RECORD"].decode().splitlines()
    listed = dict(line.split(",", 1) for line in lines)
    assert listed.keys() == files.keys()
    for name, content in files.items():
        if not name.endswith("RECORD"):
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert listed[name] == f"sha256={digest},{len(content)}"


@pytest.mark.slow
@pytest.mark.timeout(900)  # ziglang is unpacked, and compiles its own parts at first use
def test_a_wheel_is_built_without_a_compiler(no_compilers, tmp_path):
    tree = tmp_path / "tree"
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a git checkout: the files of a wheel cannot be told from others")
    for name in listed.stdout.splitlines():
        if not name.startswith(("tests/", "docs/")):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, tree / name)
    environment = {name: value for name, value in os.environ.items() if name != "CXX"} | {
        "PATH": no_compilers
    }
    build = [sys.executable, "-m", "build", "--wheel", "--outdir", tmp_path / "dist", tree]
    result = subprocess.run(build, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr[-2000:]
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    assert "-py3-none-" in wheel.name
    libraries = {name: content for name, content in unpacked(wheel).items() if "/native/lib/" in name}
    assert libraries
    for name, content in libraries.items():
        path = tmp_path / Path(name).name
        path.write_bytes(content)
        assert ctypes.CDLL(str(path)).iccm_runtime_x86_64_level() in (0, 1, 3)

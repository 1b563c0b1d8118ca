"""What commands open, write, start and connect to: nothing beyond the inventory in SECURITY.md.

Python's audit hooks report everything done through Python, including workers; if strace is installed, it also reports
what libraries do directly.
"""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
import roifile

import iccm as core
from iccm.io.pictures import image_files
from tests.extensions.vtk.files import POLYDATA
from tests.io.test_hostile import FACES, POINTS, UV, glb

ROOT = Path(__file__).parents[1]
SPY = """
import json, os, sys
told = os.open(os.environ["SPIED"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
WRITES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.symlink", "os.truncate", "os.chmod"}
STARTS = {"subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.startfile", "webbrowser.open"}
CONNECTS = {"socket.connect", "socket.bind", "socket.getaddrinfo", "socket.sendto"}

def heard(event, given):
    if event == "open" and isinstance(given[0], (str, bytes)):
        flags = given[2] if isinstance(given[2], int) else 0
        kind = "write" if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) else "read"
        names = [given[0]]
    elif event in WRITES:
        kind, names = "write", [each for each in given[:2] if isinstance(each, (str, bytes))]
        if event in ("os.remove", "os.rmdir", "os.mkdir") and given[-1] >= 0:  # relative to an open folder
            try:
                names = [os.path.join(os.readlink(f"/proc/self/fd/{given[-1]}"), os.fsdecode(names[0]))]
            except OSError:
                names = []
    elif event in STARTS:
        kind, names = "start", [str(given[0])]
    elif event in CONNECTS:
        kind, names = "connect", [str(given[-1])]
    else:
        return
    for name in names:
        name = os.fsdecode(name)
        if kind in ("read", "write"):
            name = os.path.abspath(name)
        os.write(told, (json.dumps([kind, name]) + "\\n").encode())

sys.addaudithook(heard)
"""
EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\n(pwned) print\n%%EOF\n"
HOSTILE = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 100">
<style>@import url("http://127.0.0.1:9/a.css"); @font-face {font-family: x; src: url(canary.ttf)}</style>
<image xlink:href="canary.png" width="9" height="9"/><use href="canary.svg#a"/>
<script href="canary.js"/><path d="M10 10H90V80L60 90H10Z"/></svg>"""
LAND = """<kml xmlns="http://www.opengis.net/kml/2.2"><Folder><name>f</name>
<NetworkLink><Link><href>http://127.0.0.1:9/a.kml</href></Link></NetworkLink>
<NetworkLink><Link><href>canary.svg</href></Link></NetworkLink>
<Style id="a"><IconStyle><Icon><href>canary.png</href></Icon></IconStyle></Style>
<Placemark><styleUrl>http://127.0.0.1:9/b.kml#x</styleUrl><Polygon><outerBoundaryIs><LinearRing>
<coordinates>0,0 3,0 3,2 0,1 0,0</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></Folder></kml>"""
COMMANDS = {
    "map": ("map square.svg disk.svg --texture t.png -o o.png -o o.svg -o o.npz --report r.json",
            "o.png o.svg o.npz r.json"),
    "a hostile drawing": ("map hostile.svg disk.svg -o o.png -o o.svg", "o.png o.svg"),
    "a hostile texture": ("map square.svg sheet.glb --texture eps.png -o o.glb", ""),
    "deform": ("deform square.svg --pin 30,30:30,35 --pin 70,70:80,70 -o o.png", "o.png"),
    "morph": ("morph square.svg disk.svg -o o.gif --frames 3 --size 32", "o.gif"),
    "a saved map": ("apply planted.npz t.png -o o.png --size 32", "o.png"),
    "a composition": ("compose planted.npz -o o.npz", ""),
    "arrays for remap": ("field planted.npz --size 32 --moving t.png -o o.npz", "o.npz"),
    "a field with data elsewhere": ("apply elsewhere.mha t.png -o o.png", ""),
    "a mesh that a process reads": ("map sheet.vtp square.svg -o o.png --size 32", "o.png"),
    "a field that a process reads": ("apply here.mha t.png -o o.png", "o.png"),
    "a layer that a process reads": ("map land.kml square.svg -o o.png --size 32", "o.png"),
    "a text": ("map disk.svg --target-text Hi -o o.png --size 32", "o.png"),
    "points": ("map square.svg disk.svg --source-landmarks a.csv --target-landmarks a.csv -o o.png --size 32", "o.png"),
    "regions": ("apply planted.npz b.zip -o o.zip", "o.zip"),
    "a mesh": ("map sheet.glb square.svg -o o.png --size 32", "o.png"),
    "a mesh that names others": ("flatten names.obj --uv o.obj", "o.obj"),
    "flatten": ("flatten sheet.glb -o o.svg --plot p.png", "o.svg p.png"),
    "relayout": ("relayout sheet.glb sheet.glb -o o.glb --size 32", "o.glb"),
    "info": ("info hostile.svg sheet.glb planted.npz t.png", ""),
    "a manifest": ("batch jobs.jsonl -j 1", "o.png .iccm-journal.jsonl"),
    "check": ("check results baselines --update", "baselines/a.png"),
}  # fmt: skip
"""A command for each line of the inventory, and the files that it may write."""
FONT_LISTS = ("fc-list", "fc-match", "system_profiler")
"""Programs of the system that list fonts: for plots, where Matplotlib asks once, and for text."""
CANARIES = ("canary.ttf", "canary.png", "canary.svg", "canary.js", "canary.mtl", ".netrc")


@pytest.fixture
def folder(shapes):
    """Inputs, canaries beside them that some inputs refer to, and a home."""
    image_files.write("t.png", image_files.Image(core.checkerboard(32)[:24]))
    Path("eps.png").write_bytes(EPS)
    Path("hostile.svg").write_text(HOSTILE)
    Path("sheet.glb").write_bytes(glb(Path("t.png").read_bytes()))
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS.tolist()] + [f"vt {u} {v}" for u, v in UV.tolist()]
    lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in FACES.tolist()]
    Path("names.obj").write_text("\n".join(["mtllib ../canary.mtl", *lines]) + "\n")
    fit = core.fit(
        np.array([0, 4, 4 + 3j, 3j]), np.array([0, 5, 5 + 3j, 1 + 4j]), method="paper", vertices=40
    )
    fit.save("planted.npz", job={"plot": "canary.png", "stmap": "../canary.exr", "memory": 1 << 50})
    fields = {"ObjectType": "Image", "NDims": 2, "DimSize": "2 1", "ElementType": "MET_UCHAR"}
    lines = [f"{name} = {value}" for name, value in fields.items()]
    Path("elsewhere.mha").write_text("\n".join([*lines, "ElementDataFile = ../canary.mtl"]) + "\n")
    lines[2] = "DimSize = 2 1\nElementNumberOfChannels = 2"
    content = "\n".join([*lines[:3], "ElementType = MET_FLOAT", "ElementDataFile = LOCAL"]) + "\n"
    Path("here.mha").write_bytes(content.encode() + np.array([0.1, 0, 0, 0], "<f4").tobytes())
    Path("sheet.vtp").write_text(
        POLYDATA.format(
            points=len(POINTS),
            polys=len(FACES),
            places=" ".join(map(str, POINTS.ravel().tolist())),
            corners=" ".join(map(str, FACES.ravel().tolist())),
            offsets=" ".join(str(3 * k + 3) for k in range(len(FACES))),
        )
    )
    Path("land.kml").write_text(LAND)
    Path("a.csv").write_text("x,y\n30,40\n60,45\n")
    with zipfile.ZipFile("b.zip", "w") as archive:
        for number, place in enumerate([(1, 1), (2, 2)]):
            region = roifile.ImagejRoi.frompoints(np.array([place], float))
            region.roitype = roifile.ROI_TYPE.POINT
            archive.writestr(f"../../{number}.roi", region.tobytes())
    job = {"source": "square.svg", "target": "disk.svg", "output": "o.png", "size": 16, "method": "paper"}
    Path("jobs.jsonl").write_text(json.dumps({**job, "vertices": 40}) + "\n")
    for name in ("results", "baselines", "home"):
        Path(name).mkdir()
    shutil.copy("t.png", "results/a.png")
    for name in CANARIES:
        Path(name).write_text("canary")
    (shapes.parent / "canary.mtl").write_text("canary")
    return shapes


def environment(folder):
    """The environment of a command: a home in the folder, and no settings of the tests."""
    home = str(folder / "home")
    named = dict.fromkeys(("HOME", "USERPROFILE", "LOCALAPPDATA", "APPDATA"), home)
    kept = {
        name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "ICCM_", "PYTHON"))
    }
    return kept | named | {"MPLCONFIGDIR": f"{home}/matplotlib", "PYTHONDONTWRITEBYTECODE": "1"}


def check(events, folder, written):
    """Compare what was done with what is allowed."""
    python = {Path(p).resolve() for p in (sys.prefix, sys.base_prefix, sysconfig.get_path("purelib"), ROOT)}
    readable = [
        *python,
        Path(tempfile.gettempdir()) / "x",
        *map(Path, ("/usr", "/etc", "/lib", "/lib64", "/proc", "/sys", "/dev")),
    ]
    inputs = {
        folder / name for name in ("square.svg", "disk.svg", "blob.svg", "t.png", "eps.png", "hostile.svg")
    }
    inputs |= {
        folder / name for name in ("sheet.glb", "names.obj", "planted.npz", "jobs.jsonl", "results/a.png")
    }
    inputs |= {
        folder / name for name in ("elsewhere.mha", "here.mha", "sheet.vtp", "land.kml", "a.csv", "b.zip")
    }
    outputs = {folder / name for name in written.split()}
    folders = {path.parent for path in outputs}  # they are created unless they exist
    stems = {path.stem.lstrip(".") for path in outputs}
    for kind, name in events:
        path = Path(name)
        is_home = path.is_relative_to(folder / "home")
        scratch = path.is_relative_to(tempfile.gettempdir()) and not path.is_relative_to(folder.parent)
        name_of_ours = r"\.?({})?(\..*)?".format("|".join(map(re.escape, sorted(stems))))
        is_temporary = path.parent in folders and bool(re.fullmatch(name_of_ours, path.name))
        if kind == "start":
            own_python = name in (sys.executable, os.path.realpath(sys.executable))
            assert own_python or path.name in FONT_LISTS, f"starts {name}"
        elif kind == "connect":
            raise AssertionError(f"connects to {name}")
        elif kind == "write":
            is_output = path in outputs | folders or name == os.devnull
            assert is_home or scratch or is_temporary or is_output, f"writes {name}"
        else:
            assert not path.name.startswith(("canary", ".netrc")), f"reads {name}"
            inner = path.is_relative_to(folder) or path == folder
            allowed = is_home or scratch or is_temporary or path in inputs | outputs
            allowed |= not inner and any(path.is_relative_to(root) for root in readable)
            allowed |= inner and path.is_dir()
            assert allowed or not path.exists() or not inner, f"reads {name}"


LIBRARIES = {".mha": "SimpleITK", ".vtp": "vtk", ".kml": "pyogrio"}
"""Libraries of extras that are needed to read files with some suffixes."""


def marked(name):
    """A name of COMMANDS as a parameter, skipped if the library that its file needs is missing."""
    needed = [library for suffix, library in LIBRARIES.items() if suffix in COMMANDS[name][0]]
    marks = [pytest.mark.large] if needed else [pytest.mark.slow]
    for library in needed:
        is_missing = importlib.util.find_spec(library) is None
        marks.append(pytest.mark.skipif(is_missing, reason=f"{library} is an extra"))
    return pytest.param(name, marks=marks)


@pytest.mark.parametrize("name", [marked(name) for name in COMMANDS])
def test_no_command_goes_beyond_the_inventory(folder, name, tmp_path_factory):
    typed, written = COMMANDS[name]
    spy = tmp_path_factory.mktemp("spy")
    (spy / "sitecustomize.py").write_text(SPY)
    more = {"PYTHONPATH": str(spy), "SPIED": str(spy / "told")}
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    command = [sys.executable, "-c", "from iccm.cli import main; main()", *typed.split()]
    done = subprocess.run(
        command, env=environment(folder) | more, capture_output=True, text=True, timeout=200
    )
    assert done.returncode == (0 if written or name == "info" else 2), done.stderr
    events = {tuple(json.loads(line)) for line in (spy / "told").read_text().splitlines()}
    assert any(kind == "read" and typed.split()[1] in path for kind, path in events)
    check([(kind, path) for kind, path in events if not path.startswith(str(spy))], folder, written)
    after = {
        path for path in folder.rglob("*") if path.is_file() and not path.is_relative_to(folder / "home")
    }
    assert {path.relative_to(folder).as_posix() for path in after - before.keys()} == set(written.split())
    assert all(path.read_bytes() == content for path, content in before.items())


TRACED = re.compile(r'(\w+)\((?:AT_FDCWD, |\d+(?:<[^>]*>)?, )?"((?:[^"\\]|\\.)*)"(.*)')


TRACED_COMMANDS = [
    "map",
    "a hostile drawing",
    "a hostile texture",
    "a saved map",
    "a field with data elsewhere",
    "a field that a process reads",
    "a mesh that a process reads",
    "a layer that a process reads",
    "flatten",
]


@pytest.mark.skipif(not shutil.which("strace"), reason="strace is not installed")
@pytest.mark.parametrize("name", [marked(name) for name in TRACED_COMMANDS])
def test_libraries_read_and_write_nothing_else(folder, name):
    typed, written = COMMANDS[name]
    line = [
        "strace",
        "--seccomp-bpf",  # stops the process for the traced calls alone
        "-f",
        "-qq",
        "-s",
        "400",
        "-e",
        "trace=open,openat,creat,execve,connect,rename,unlink,mkdir",
    ]
    command = [
        *line,
        "-o",
        "home/trace",
        sys.executable,
        "-c",
        "from iccm.cli import main; main()",
        *typed.split(),
    ]
    done = subprocess.run(command, env=environment(folder), capture_output=True, text=True, timeout=300)
    if "ptrace" in done.stderr or not Path("home/trace").exists():
        pytest.skip("strace may not trace here")
    assert done.returncode == (0 if written else 2), done.stderr
    events = []
    for trace_line in Path("home/trace").read_text(errors="replace").splitlines()[1:]:
        if "connect(" in trace_line and "AF_UNIX" not in trace_line:
            events.append(("connect", trace_line))
        elif (match := TRACED.search(trace_line)) and " = -1 " not in trace_line:
            call, path, arguments = match.groups()
            changes = call not in ("open", "openat", "execve") or re.search(
                "O_WRONLY|O_RDWR|O_CREAT", arguments
            )
            kind = "start" if call == "execve" else "write" if changes else "read"
            events.append((kind, os.path.abspath(path)))
    assert len(events) > 20
    check([(kind, path) for kind, path in events if path != str(folder / "home/trace")], folder, written)

"""Facts about a file for `iccm info`: outlines, IDs, canvas, pins and strokes; pixels; meshes; constraints; jobs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, printable
from . import files, formats, limits
from .meshes import mesh_files
from .outlines import polygons
from .shapes import shape as shapes
from .spec import Spec

LISTED_ITEMS = 20  # entries of each kind that are listed: a screenful
# values with coordinates of corners, and significant digits relative to their extent
BOXES, DIGITS = ("box", "canvas"), 6


def describe(name: str | Path, *, max_faces: int = limits.FACES) -> dict[str, Any]:
    """Return facts about a file, by its suffix, or about a part of it, such as `font.ttf#text=Word`.

    All values can be represented in JSON.

    Raises:
        InputError: the file is missing, invalid or of an unsupported format, or a mesh with more than `max_faces`
            faces.
    """
    spec = Spec.of(str(name))
    path = spec.path
    files.open_input(path)
    if spec.selection and (formats.of(path).outlines or formats.of(path).drawing):
        return {"file": str(name), "bytes": path.stat().st_size, **_shape(spec)}
    if spec.selection:
        raise InputError(
            f"{name}: only parts of drawings and fonts can be described; iccm info {path} lists the parts of this file"
        )
    kinds: dict[str, Callable[[Path], dict[str, Any]]] = {
        "picture": _picture,
        "mesh": partial(_mesh, max_faces=max_faces),
        "constraints": _constraints,
        "manifest": _manifest,
        "drawing": _shape,
        "map": _map,
        "outlines": _shape,
    }
    for content, facts in kinds.items():
        if content == "constraints" and polygons.holds(path):
            continue
        if getattr(formats.of(path), content):
            return {"file": str(path), "bytes": path.stat().st_size, **facts(path)}
    suffixes = sorted({suffix for content in kinds for suffix in formats.holding(content)})
    raise InputError(f"{path}: iccm does not read files of this type; it reads {' '.join(suffixes)}")


def _shape(spec: Spec | Path) -> dict[str, Any]:
    drawing = shapes.read_drawing(spec if isinstance(spec, Spec) else Spec(spec))
    return {
        "kind": "shapes",
        "canvas": None if drawing.rectangle is None else [float(value) for value in drawing.rectangle],
        "outlines": [
            _outline(number, outline) for number, outline in enumerate(drawing.outlines[:LISTED_ITEMS], 1)
        ],
        "outlines_in_all": len(drawing.outlines),
        "ids": list(drawing.ids)[:LISTED_ITEMS],
        "pins": {name: [z.real, z.imag] for name, z in drawing.pins.items()},
        "strokes": {name: int(z.size) for name, z in drawing.strokes.items()},
        "refused": list(dict.fromkeys(str(error) for _, error in drawing.refused))[:LISTED_ITEMS],
        "notes": drawing.notes[:LISTED_ITEMS],
    }


def _map(path: Path) -> dict[str, Any]:
    from ..maps.triangulated.map import TriangulatedMap
    from ..result import load

    fit = load(path)
    sides = {"source": (fit.source, fit.source_holes), "target": (fit.target, fit.target_holes)}
    return {
        "kind": "map",
        "status": fit.status.name.lower(),
        "message": fit.status.value,
        "triangles": len(fit.map.faces) if isinstance(fit.map, TriangulatedMap) else None,
        **{
            name: {
                "vertices": int(curve.z.size),
                "holes": len(holes),
                "box": [float(v) for w in curve.box for v in (w.real, w.imag)],
            }
            for name, (curve, holes) in sides.items()
            if curve is not None
        },
        "pins": len(fit.pins),
        "strokes": len(fit.strokes),
        "left_out": fit.coverage.left_out if fit.target is not None else 0.0,
        "uncovered": fit.coverage.uncovered if fit.target is not None else 0.0,
        **(
            {"shown": 1 - fit.coverage.hidden, "covered": 1 - fit.coverage.bare}
            if fit.coverage.seen is not None
            else {}
        ),
        "notes": fit.notes[:LISTED_ITEMS],
    }


def _outline(number: int, outline: Any) -> dict[str, Any]:
    z = outline.z
    box = [float(value) for value in (z.real.min(), z.imag.min(), z.real.max(), z.imag.max())]
    area = float(outline.area)
    return {
        "number": number,
        "name": outline.name,
        "vertices": int(z.size),
        "area": area,
        "holes": len(outline.holes),
        "box": box,
    }


def _picture(path: Path) -> dict[str, Any]:
    from .pictures import image_files, stmap_files

    image = image_files.read(path)
    height, width, channels = image.pixels.shape
    alpha = None
    if image.alpha >= 0:
        alpha = "associated" if image.associated else "straight"
    facts = {
        "kind": "picture",
        "size": [width, height],
        "channels": channels,
        "type": str(image.pixels.dtype),
        "alpha": alpha,
        "colorspace": image.colorspace,
    }
    if stmap_files.is_own(image):
        return facts | {"kind": "STMap"}
    try:
        silhouette = _shape(path)
    except InputError as error:
        return {**facts, "silhouette": str(error)}
    return {
        **facts,
        **{key: value for key, value in silhouette.items() if key in ("outlines", "outlines_in_all")},
    }


def _mesh(path: Path, max_faces: int) -> dict[str, Any]:
    opened = mesh_files.open_mesh(path, max_faces)
    opened.check_size(max_faces)
    if not opened.is_mesh():
        return _shape(path)
    file = mesh_files.read(str(path), opened)
    mesh = file.mesh
    counts = np.bincount(mesh.sizes)
    return {
        "kind": "mesh",
        "vertices": len(mesh.points),
        "faces": len(mesh.sizes),
        "sides": {str(size): int(counts[size]) for size in np.flatnonzero(counts)},
        "parts": list(file.names)[:LISTED_ITEMS],
        "parts_in_all": len(file.names),
        "textures": ["in the file"] if file.picture is not None else list(map(str, file.textures())),
        **_charts(mesh),
        **_surface(file),
        "notes": list(file.notes)[:LISTED_ITEMS],
    }


def _charts(mesh: Any) -> dict[str, Any]:
    """Return the charts of the mesh's texture coordinates, the largest first, with the names to use after `#`."""
    from ..flattening.charts import Atlas
    from .pictures.tiles import number_of

    if mesh.uv is None:
        return {"uv_charts": 0}
    try:
        atlas = Atlas.of(mesh)
    except InputError as error:
        return {"uv_charts": 0, "uv": str(error)}
    charts = [
        {
            "name": f"uv-{k}",
            "triangles": len(atlas.triangles(k)),
            "area": float(atlas.areas[k - 1]),
            "tile": number_of(atlas.tile(k)),
            "mirrored": atlas.mirrored(k),
        }
        for k in range(1, min(atlas.count, LISTED_ITEMS) + 1)
    ]
    return {"uv_charts": atlas.count, "charts": charts, "uv": "; ".join(atlas.notes) or None}


def _surface(file: Any) -> dict[str, Any]:
    """Return the pieces of the mesh and the boundary loops of the largest, with the names to use after `#`, and its
    genus; or why it cannot be flattened.
    """
    from ..meshes.disk_patch import Joined, disk_patch

    try:
        joined = Joined.of(file.mesh)
    except InputError as error:
        return {"patch": str(error)}
    sizes = joined.sizes
    listed_pieces = [
        {"name": f"piece-{k}", "triangles": size} for k, size in enumerate(sizes[:LISTED_ITEMS], 1)
    ]
    facts = {"pieces_in_all": len(sizes), "pieces": listed_pieces if len(sizes) > 1 else []}
    try:
        patch = disk_patch(joined)
    except InputError as error:
        return facts | {"patch": str(error)}
    loops = [_loop(file, patch, number) for number in range(1, min(len(patch.loops), LISTED_ITEMS) + 1)]
    return facts | {"loops_in_all": len(patch.loops), "loops": loops, "genus": int(patch.genus)}


def _loop(file: Any, patch: Any, number: int) -> dict[str, Any]:
    from .shapes.mesh_reading import names_around

    loop = patch.loops[number - 1]
    around = " ".join(names_around(file, patch, loop))
    return {"name": str(number), "vertices": int(loop.size)} | ({"around": around} if around else {})


def _constraints(path: Path) -> dict[str, Any]:
    from .shapes import listing

    if facts := _facts_of_own_file(path):
        return facts
    listed = listing.read(path)
    return {
        "kind": "constraints",
        **{key: len(value) for key, value in vars(listed).items() if hasattr(value, "__len__")},
    }


def _facts_of_own_file(path: Path) -> dict[str, Any]:
    """Return facts about a JSON file written by iccm: a report, a verdict or a result; empty for other files."""
    try:
        content = files.read_json(path, max_bytes=limits.COMPARED_BYTES)
    except InputError:
        return {}
    schema = content.get("schema") if isinstance(content, dict) else None
    if not isinstance(schema, str) or not schema.startswith("iccm."):
        return {}
    keys = ("version", "status", "message", "left_out", "uncovered", "shown", "covered", "turn", "notes")
    inputs = [
        input_file.get("path") for input_file in content.get("inputs", []) if isinstance(input_file, dict)
    ]
    return {"kind": schema, **{key: content[key] for key in keys if key in content}, "inputs": inputs}


def _lines_of_own(path: Path) -> dict[str, Any]:
    """Return facts about a JSON Lines file written by iccm: results of a batch, verdicts of a check, or a journal;
    empty for other files.
    """
    from collections import Counter

    ended: Counter[str] = Counter()
    kind = ""
    for line in filter(bytes.strip, files.read_bytes(path, max_bytes=limits.COMPARED_BYTES).splitlines()):
        try:
            content = files.parse_json(line)
        except InputError:
            return {}
        record = content if isinstance(content, dict) else {}
        kind = "journal of a batch" if "event" in record else str(record.get("schema"))
        if "event" not in record and not kind.startswith("iccm."):
            return {}
        ended[str(record.get("status") or record.get("state") or record.get("event"))] += 1
    return {"kind": kind, "lines": ended.total(), "ended": dict(ended)} if ended else {}


def _manifest(path: Path) -> dict[str, Any]:
    from .batch import manifest

    if settings := _lines_of_own(path):
        return settings
    tasks = manifest.read(manifest.load(str(path)), str(path), root=path.parent)
    names = [task.name for task in tasks[:LISTED_ITEMS]]
    return {"kind": "manifest", "jobs": len(tasks), "names": names}


def lines(facts: dict[str, Any]) -> list[str]:
    """Return the facts as lines of text, with control characters escaped."""
    out = []
    for key, value in facts.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            out += [f"{key}:", *("  " + _row(item) for item in value)]
        elif value not in ([], {}, None):
            out.append(f"{key}: {_text(key, value)}")
    return [printable(line) for line in out]


def _row(item: dict[str, Any]) -> str:
    return ", ".join(f"{key} {_text(key, value)}" for key, value in item.items())


def _text(key: str, value: Any) -> str:
    """Return a value as text; coordinates of boxes are rounded relative to the size of the box."""
    if key not in BOXES or not isinstance(value, list) or not value or not np.isfinite(value).all():
        return _plain(value)
    sides = np.array(value[-(len(value) // 2) :])
    extent = np.abs(sides if key == "canvas" else sides - value[: len(value) // 2]).max()
    decimals = int(np.clip(DIGITS - 1 - np.floor(np.log10(extent or 1.0)), 0, 12))
    if max(map(abs, value)) >= 1e15:
        return " ".join(f"{v:.6g}" for v in value)
    texts = [f"{v:.{decimals}f}" for v in value]
    return " ".join(text.rstrip("0").rstrip(".") if "." in text else text for text in texts)


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return (
            " ".join(map(_plain, value))
            if all(isinstance(v, int | float) for v in value)
            else "; ".join(map(str, value))
        )
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(name, item)}" for name, item in value.items())
    return str(value)

"""SVG drawings carried through a map as SVG: every shape becomes a path of Béziers, styles stay.

Groups, classes, style sheets and definitions are kept; transforms and `use` are resolved, because a path that went
through the map is in the target's units. Line widths follow the map's mean scale over the path, and gradients in user
space its linear part at the path's middle. Clip paths are shapes, too: each use of one gets its own, mapped. Text,
images and masks are left out, with a note. What lies outside the source shape is pressed onto its outline when the
path is partly inside, and left out when it is not.
"""

import copy
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from ..cauchy import Complex
from ..curve import Curve
from ..errors import InputError
from ..evaluate import Evaluator
from ..harmonic import HarmonicMap
from ..refit import refit
from . import affine, css, files, svg, svgpath, svgtree
from .affine import Affine
from .curves import Bezier, Piece
from .shapes import Shape
from .svgtree import Drawn
from .svgxml import canvas, length, local, root

SVG = "http://www.w3.org/2000/svg"
_LEFT_OUT = {"text": " (turn text into paths first)", "image": "", "foreignObject": ""}
TOLERANCE = 2e-4  # of the target's diagonal
FAR = 10**7  # beyond every canvas
NEAR = 2e-3  # of the source's diagonal: no farther outside counts as on the outline, which is flattened
# Attributes that say where a shape is, which the path's data replace.
_PLACED = {"d", "x", "y", "width", "height", "cx", "cy", "r", "rx", "ry", "x1", "y1", "x2", "y2", "points"}
_PLACED |= {
    "transform",
    "transform-origin",
    "viewBox",
    "preserveAspectRatio",
    "clip-path",
    "mask",
    "pathLength",
}
_PLACED |= {"href", "{http://www.w3.org/1999/xlink}href"}
_URL = re.compile(r"""\s*url\(\s*["']?#([^"')]+)["']?\s*\).*""")
_KEPT = ("defs", "style", "title", "desc", "linearGradient", "radialGradient", "pattern", "filter")


def carry(
    source: Shape,
    map: HarmonicMap | Evaluator,
    target: Shape,
    path: str | Path,
    *,
    tolerance: float | None = None,
) -> tuple[str, ...]:
    """Writes the drawing that the source shape was read from, carried to the target.

    Args:
        source: a shape from an SVG file; all that the file draws is carried, not only the outline.
        map: source → target, core plane.
        target: its canvas becomes the drawing's.
        path: the SVG file to write.
        tolerance: of the paths, in the target's units; TOLERANCE of the target's diagonal by default.

    Returns:
        At most one note: what was left out or pressed onto the outline.

    Raises:
        InputError: the source is no SVG file, or it is malformed.
    """
    if source.path.suffix.lower() != ".svg":
        raise InputError(f"{source.path}: artwork is carried from SVG files only")
    drawing = _Drawing.of(files.read_bytes(source.path, max_bytes=svg.MAX_BYTES), target)
    carrier = Carrier(map, source, tolerance or TOLERANCE * target.curve.diagonal)
    carrier.carry(drawing.shapes)
    for prefix, name in (("", SVG), ("xlink", "http://www.w3.org/1999/xlink")):
        ElementTree.register_namespace(prefix, name)
    ElementTree.ElementTree(drawing.out).write(path, encoding="utf-8", xml_declaration=True)
    counts = drawing.left_out + carrier.left_out
    return ("; ".join(f"{number} × {what}" for what, number in sorted(counts.items())),) if counts else ()


class Carrier:
    """The map, ready to carry shapes."""

    def __init__(self, map: HarmonicMap | Evaluator, source: Shape, tolerance: float):
        self.map = map if isinstance(map, Evaluator) else Evaluator(map)
        self.rim = Curve(self.map.map.polygon)
        self.near = NEAR * source.curve.diagonal
        self.tolerance = tolerance
        self.left_out: Counter[str] = Counter()

    def carry(self, shapes: "list[_Placed]") -> None:
        """Gives every shape's element its path, or takes the element out."""
        pieces = [piece for shape in shapes for run in shape.runs for piece in run.pieces]
        fitted = refit(lambda which, t: self.image(_points(pieces, which, t))[0], len(pieces), self.tolerance)
        first = 0
        for shape in shapes:
            number = sum(len(run.pieces) for run in shape.runs)
            inside, strayed, linear = self._judge(pieces[first : first + number])
            if inside:
                shape.write(fitted[first : first + number], linear, self.tolerance)
                self.left_out["path partly outside the source, pressed onto its outline"] += strayed
            elif shape.clips and _surrounds(shape.runs, np.conj(self.rim.z[0])):
                shape.out.set("d", f"M{-FAR} {-FAR}H{FAR}V{FAR}H{-FAR}Z")
            else:
                shape.parent.remove(shape.out)
                self.left_out["shape outside the source, left out"] += not shape.clips
            first += number
        self.left_out = +self.left_out

    def image(self, z: Complex) -> tuple[Complex, Complex]:
        """Images of points (p,), and the points themselves, pressed onto the outline where they are outside."""
        w = self.map(z)
        lost = np.flatnonzero(np.isnan(w))
        z = z.copy()
        if lost.size:
            z[lost] = self.rim.at(self.rim.closest(z[lost]))
            w[lost] = self.map(z[lost])
        return w, z

    def _judge(self, pieces: list[Piece]) -> tuple[bool, bool, "_Linear"]:
        """Whether a shape is inside at all, whether it leaves the source, and the map's linear part over it."""
        plain = _Linear(1.0, Affine())
        if not pieces:
            return False, False, plain
        t = (np.arange(8) + 0.5) / 8
        z = np.concatenate([_core(piece.at(t)) for piece in pieces])
        _, onto = self.image(z)
        away = np.abs(onto - z) > self.near
        inner = onto[~away]
        if not inner.size:
            return False, True, plain
        w, a, b = self.map.jet(inner)
        known = np.isfinite(a) & np.isfinite(w)
        if not known.any():
            return True, bool(away.any()), plain
        scale = float(np.sqrt(np.median(np.abs(np.abs(a) ** 2 - np.abs(b) ** 2)[known])))
        at, to, alpha, beta = (complex(v[known].mean()).conjugate() for v in (inner, w, a, b))
        linear = Affine(alpha, beta)
        return True, bool(away.any()), _Linear(scale, replace(linear, gamma=to - linear(at)))


def _core(xy: Complex) -> Complex:
    return np.conj(xy)


def _points(pieces: list[Piece], which: np.ndarray, t: np.ndarray) -> Complex:
    """Points of the pieces in the core plane; `which` is not sorted, but comes in runs."""
    out = np.empty(t.size, dtype=np.complex128)
    cuts = np.flatnonzero(np.diff(which, prepend=-1, append=-1))
    for a, b in pairwise(cuts):
        out[a:b] = pieces[which[a]].at(t[a:b])
    return _core(out)


def _surrounds(runs: list[svgpath.Run], point: complex) -> bool:
    """Whether runs, closed or not, wind around a point."""
    turns = 0.0
    for run in runs:
        z = np.concatenate([piece.at(np.arange(8) / 8) for piece in run.pieces]) - point
        turns += float(np.sum(np.angle(np.roll(z, -1) * z.conj())))
    return abs(turns) > np.pi


@dataclass(frozen=True)
class _Linear:
    """A map over a path: its mean scale, and its linear part at the path's middle, in coordinates with y down."""

    scale: float
    affine: Affine


@dataclass(eq=False)
class _Placed:
    """A shape in the root's user units, with the element that it becomes and that one's parent.

    Attributes:
        out, parent: these.
        runs: the shape.
        width: of its line, in the root's units; None without a line.
        clips: whether it is part of a clip path.
        gradients: those that paint it in user space, with what takes that space to the root's.
    """

    out: Element
    parent: Element
    runs: list[svgpath.Run]
    width: float | None = None
    clips: bool = False
    gradients: list[tuple[Element, Affine]] = field(default_factory=list)

    def write(self, fitted: list[Complex], linear: _Linear, tolerance: float) -> None:
        digits = max(0, int(np.ceil(-np.log10(tolerance / 20))))
        d, first = [], 0
        for run in self.runs:
            cubics = np.conj(np.concatenate(fitted[first : first + len(run.pieces)]))  # y down
            first += len(run.pieces)
            d.append("M" + _pair(cubics[0, 0], digits))
            d += ["C" + " ".join(_pair(p, digits) for p in cubic[1:]) for cubic in cubics]
            d.append("Z" if run.closed else "")
        self.out.set("d", "".join(d))
        if self.width is not None:
            _restyle(self.out, {"stroke-width": f"{self.width * linear.scale:.6g}"})
        for gradient, placed in self.gradients:
            gradient.set("gradientTransform", affine.written(linear.affine @ placed))


def _restyle(out: Element, style: dict[str, str]) -> None:
    """Adds declarations to an element's own, which win over attributes and style sheets."""
    both = css.declarations(out.get("style", "")) | style
    out.set("style", ";".join(f"{k}:{v}" for k, v in both.items()))


def _pair(z: complex, digits: int) -> str:
    x, y = (f"{v:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{v:.0f}" for v in (z.real, z.imag))
    return f"{x} {y}"


@dataclass(eq=False)
class _Drawing:
    """The document being built, and its shapes."""

    out: Element
    defs: Element
    walk: svgtree._Walk
    shapes: list[_Placed] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)

    @classmethod
    def of(cls, data: bytes, target: Shape) -> "_Drawing":
        top = root(data)
        box = canvas(top)
        sheet = css.sheet("\n".join("".join(e.itertext()) for e in top.iter() if local(e) == "style"))
        walk = svgtree._Walk({e.get("id", ""): e for e in reversed(list(top.iter()))}, sheet)
        low, high = target.box
        numbers = (low.real, -high.imag, (high - low).real, (high - low).imag)
        out = Element(f"{{{SVG}}}svg", {"viewBox": " ".join(f"{v:.9g}" for v in numbers)})
        out.attrib |= {
            k: v for k, v in _styled(top).items() if k not in ("width", "height", "viewBox", "version")
        }
        drawing = cls(out, Element(f"{{{SVG}}}defs"), walk)
        state = svgtree._State(affine.Affine(), box[2:] if box else None, box[:2] if box else (0.0, 0.0))
        inner = walk.enter(top, state, root=True)
        if inner is not None:
            for child in top:
                drawing.add(child, inner, out, "1")
        if len(drawing.defs):
            out.insert(0, drawing.defs)
        return drawing

    def add(self, element: Element, outer: svgtree._State, parent: Element, width: str) -> None:
        """Adds an element, and what is in it, to the parent in the new document."""
        tag = local(element)
        if tag in _KEPT:
            parent.append(copy.deepcopy(element))
        if tag in _LEFT_OUT:
            self.left_out[f"<{tag}>, left out{_LEFT_OUT[tag]}"] += 1
        if tag not in svgtree.SHAPES and tag not in (*svgtree._GROUPS, "svg", "use", "symbol"):
            return
        state = self.walk.enter(element, outer)
        self.walk.copies += bool(outer.used)
        if state is None:
            return
        if self.walk.copies > svgtree.MAX_COPIES or outer.depth > svgtree.MAX_DEPTH:
            raise InputError(f"<use> makes more than {svgtree.MAX_COPIES} elements, or nests them too deeply")
        width = state.properties.get("stroke-width", width)
        if tag in svgtree.SHAPES:
            self._shape(tag, element, state, outer, parent, width)
            return
        if local(parent) == "clipPath":  # may hold shapes only
            group = parent
        else:
            group = SubElement(parent, f"{{{SVG}}}g", _styled(element))
            self._clip(element, state, group)
        if tag == "use":
            self._use(element, state, group, width)
        else:
            inner = svgtree._inside_viewport(state, state.properties) if tag in ("svg", "symbol") else state
            for child in element:
                self.add(child, inner, group, width)

    def _use(self, element: Element, state: svgtree._State, group: Element, width: str) -> None:
        link = next(filter(None, map(element.get, svgtree._LINKS)), "")
        used = self.walk.ids.get(link[1:]) if link.startswith("#") else None
        if used is None:
            return
        if id(used) in state.used:
            raise InputError(f"<use> of {link!r} contains itself")
        x, y = (length(state.properties.get(k) or "0", state.size, k, f"<use> {k}") for k in "xy")
        shifted = replace(state, affine=state.affine @ affine.translation(x, y), used=(*state.used, id(used)))
        self.add(used, shifted, group, width)

    def _clip(self, element: Element, state: svgtree._State, out: Element) -> None:
        """Gives `out` a clip path of its own: the element's, to be mapped like any shape. Masks are left out."""
        own = self.walk.own(element)
        if own.get("mask", "none") != "none":
            self.left_out["mask, left out"] += 1
            _restyle(out, {"mask": "none"})
        named = own.get("clip-path", "none")
        if named == "none":
            return
        clip = self._defined(named, "clipPath")
        if clip is None or clip.get("clipPathUnits") == "objectBoundingBox" or id(clip) in state.used:
            self.left_out["clip-path that is no clipPath in user space, left out"] += 1
            _restyle(out, {"clip-path": "none"})
            return
        inner = self.walk.enter(clip, replace(state, used=(*state.used, id(clip))))
        mapped = SubElement(self.defs, f"{{{SVG}}}clipPath", {"id": f"clip-{len(self.defs) + 1}-mapped"})
        _restyle(out, {"clip-path": f"url(#{mapped.get('id')})"})
        if inner is not None:
            self._clip(clip, inner, mapped)
            for child in clip:
                self.add(child, inner, mapped, "1")

    def _defined(self, paint: str, *tags: str) -> Element | None:
        """The element of one of these kinds that `url(#id)` names."""
        match = _URL.fullmatch(paint)
        found = self.walk.ids.get(match[1]) if match else None
        return found if found is not None and local(found) in tags else None

    def _gradients(self, state: svgtree._State, out: Element) -> list[tuple[Element, Affine]]:
        """Gradients in user space that paint a shape, each as one of its own that inherits from the original."""
        found = []
        for kind in ("fill", "stroke"):
            gradient = self._defined(state.properties.get(kind, ""), "linearGradient", "radialGradient")
            chain = self._chain(gradient)
            said = {k: v for each in reversed(chain) for k, v in each.attrib.items()}
            if gradient is None or said.get("gradientUnits") != "userSpaceOnUse":
                continue
            name = f"gradient-{len(self.defs) + 1}-mapped"
            new = SubElement(
                self.defs, gradient.tag, {"id": name, svgtree._LINKS[1]: f"#{gradient.get('id')}"}
            )
            _restyle(out, {kind: f"url(#{name})"})
            found.append((new, state.affine @ affine.parse(said.get("gradientTransform", ""))))
        return found

    def _chain(self, element: Element | None) -> list[Element]:
        """An element and those that it inherits from by href, each once."""
        chain: list[Element] = []
        while element is not None and element not in chain:
            chain.append(element)
            link = next(filter(None, map(element.get, svgtree._LINKS)), "")
            element = self.walk.ids.get(link[1:]) if link.startswith("#") else None
        return chain

    def _shape(self, tag, element, state, outer, parent, width) -> None:
        names = state.groups[len(outer.groups) :]
        if any(name.startswith((svg.PIN, svg.STROKE)) for name in names):
            return
        drawn = Drawn(tag, state.properties, state.affine, state.size, names, outer.groups)
        runs = _runs(drawn)
        if not runs:
            return
        out = SubElement(parent, f"{{{SVG}}}path", _styled(element))
        self._clip(element, state, out)
        if outer.used:
            out.attrib.pop("id", None)
        a = state.affine
        grown = abs(abs(a.alpha) ** 2 - abs(a.beta) ** 2) ** 0.5
        lined = (
            drawn._painted("stroke", "none") and state.properties.get("vector-effect") != "non-scaling-stroke"
        )
        line = length(width, state.size, "r", "stroke-width") * grown if lined else None
        clips = local(parent) == "clipPath"
        self.shapes.append(
            _Placed(out, parent, runs, line, clips, [] if clips else self._gradients(state, out))
        )


def _styled(element: Element) -> dict[str, str]:
    """The attributes that do not say where an element is."""
    kept = {k: v for k, v in element.attrib.items() if k not in _PLACED}
    if "transform" in kept.get("style", ""):
        style = css.declarations(kept["style"])
        kept["style"] = ";".join(f"{k}:{v}" for k, v in style.items() if not k.startswith("transform"))
    return kept


def _runs(drawn: Drawn) -> list[svgpath.Run]:
    """The shape's runs in the root's user units, y down; closed ones end where they begin."""
    if drawn.tag in ("polyline", "polygon"):
        found = []
        for line in svg._polyline(replace(drawn, affine=affine.Affine())):
            sides: list[Piece] = [Bezier((complex(a), complex(b))) for a, b in pairwise(line.z)]
            found.append(svgpath.Run(complex(line.z[0]), sides, line.closed))
    else:
        found = svgpath.runs(svg._PATH[drawn.tag](drawn))
    out = []
    for run in found:
        pieces = list(run.pieces)
        if run.closed and pieces and pieces[-1].last() != run.start:
            pieces.append(Bezier((pieces[-1].last(), run.start)))
        if pieces:
            out.append(
                svgpath.Run(drawn.affine(run.start), [p.under(drawn.affine) for p in pieces], run.closed)
            )
    return out

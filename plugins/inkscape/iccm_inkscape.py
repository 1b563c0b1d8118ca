"""Inkscape's Extensions > Texture: "Fit into shape" and "Deform by pins", which run `iccm map` and `iccm deform`.

The document is copied for iccm twice, once with only the artwork drawn and once with only the target, so that
transforms, styles and definitions stay valid. All files use the document's user units. The result is inserted into the
target's layer as one group.
"""

import base64
import copy
import json
import re
import tempfile
from pathlib import Path

import inkex
from iccm_process import Failed, messages, python, start
from inkex import bezier
from inkex.command import inkscape
from lxml import etree

KINDS = ("pin-", "stroke-")
FLATNESS = 1e-4  # relative to a stroke's size: largest distance of its polyline
MARGIN = 0.02  # relative to the size of artwork or target: margin of rendered pictures
MARK_SHARE = 0.025  # relative to the artwork's size: larger circles give the radius of the pin's patch
SIDE = 8192  # pixels: largest size of rendered artwork
NOT_DRAWN = {"defs", "style", "metadata", "namedview", "title", "desc", "script"}
SWAPPED = "{0} was selected last, so {1} was fitted into it. To fit {0} into {1}, undo, and select {1} last."
GAPS = "because it lies in gaps of the target"  # in a note of iccm
OF_ROOT = {"id", "width", "height", "viewBox", "version", "preserveAspectRatio", "x", "y"}
LABEL, HREFS = inkex.addNS("label", "inkscape"), ("href", inkex.addNS("href", "xlink"))


class Texture(inkex.EffectExtension):
    """Both menu entries; `--job` selects one."""

    def add_arguments(self, pars):
        """Declare the parameters of both .inx files."""
        pars.add_argument("--job", default="fit")
        pars.add_argument("--result", default="paths")
        pars.add_argument("--size", type=int, default=1024)
        pars.add_argument("--outline", default="silhouette")
        pars.add_argument("--parts", default="auto")
        pars.add_argument("--fit", default="auto")
        pars.add_argument("--holes", default="auto")
        pars.add_argument("--turn", default="")
        pars.add_argument("--balance", type=float, default=1.0)
        pars.add_argument("--pins", type=inkex.Boolean, default=True)
        pars.add_argument("--exact_pins", type=inkex.Boolean, default=False)
        pars.add_argument("--replace", type=inkex.Boolean, default=False)

    def effect(self):
        """Run iccm on the selection, and add the result to the document."""
        with tempfile.TemporaryDirectory(prefix="iccm-") as folder:
            try:
                self.carry(Path(folder))
            except Failed as error:
                raise inkex.AbortExtension(str(error)) from None

    def carry(self, folder):
        """Write iccm's inputs into a folder, run iccm there, and insert the result."""
        interpreter = python("inkscape")
        fits = self.options.job == "fit"
        marks = self.marks() if self.options.pins else {kind: {} for kind in KINDS}
        marked = {element for found in marks.values() for pair in found.values() for element in pair}
        chosen = [each for each in self.svg.selection.values() if each not in marked]
        if len(chosen) < 1 + fits:
            raise Failed(
                "Select the artwork, then Shift-click the shape to fit it into."
                if fits
                else "Select the artwork to deform."
            )
        artwork, target = (chosen[:-1], chosen[-1]) if fits else (chosen, chosen[0])
        if any(target in each.iterdescendants() or each in target.iterdescendants() for each in artwork):
            raise Failed(
                "The target is part of the artwork, or the artwork is part of the target; ungroup them."
            )
        if fits and is_open_line(target):
            raise Failed(
                f"{title(target)}, selected last, is an open line without an inside. Close it, or select the shape "
                "to fit into last."
            )
        source = self.only(artwork, marked)
        picture = fits and self.options.result == "picture"
        if self.options.outline == "silhouette" and any(map(has_photo, artwork)):
            self.options.outline = "box"  # photos have no outline but their rectangle
        if picture or self.options.outline == "box":
            framed(source, drawn_box(source, folder), MARGIN if self.options.outline != "box" else 0)
        write(source, folder / "artwork.svg")
        pairs = marks if fits else {k: {n: (p * 2)[:2] for n, p in v.items()} for k, v in marks.items()}
        command = ["map" if fits else "deform", "artwork.svg" + self.part(artwork)]
        result = folder / ("result.png" if picture else "result.svg")
        box = None
        if fits:
            onto = self.only([target], marked)
            if picture:
                box = framed(onto, drawn_box(onto, folder), MARGIN)
            write(onto, folder / "target.svg")
            command += ["target.svg", "--target-box", "viewbox", *self.said()]
        if picture:
            render(folder / "artwork.svg", folder / "texture.png", min(SIDE, 2 * self.options.size))
            command += ["--texture", "texture.png", "--texture-box", "viewbox"]
            command += ["--size", str(self.options.size)]
        if any(pairs.values()):
            listed = self.listed(pairs, artwork, target if fits else None)
            (folder / "pairs.json").write_text(json.dumps(listed), encoding="utf-8")
            command += ["--constraints", "pairs.json"]
            command += ["--exact-pins"] if self.options.exact_pins else []
        elif not fits:
            raise Failed(
                "There are no pins. Draw a small circle on the artwork, label it pin-NAME (Object Properties), "
                "duplicate it, and move the duplicate to where the pin goes."
            )
        command += ["-o", result.name, "--report", "report.json", "--log-format", "json", "-q"]
        log = str(folder / "messages")
        code = start(interpreter, command, str(folder), log).wait()
        errors, doubts = messages(log)
        if code not in (0, 1) or not result.is_file():
            raise Failed(readable("\n".join(errors) or f"iccm ended with exit code {code}"))
        name = f"{title(artwork[0])} in {title(target)}" if fits else f"{title(artwork[0])} deformed"
        self.insert(image(result, box) if picture else drawing(result, self.svg), target, name)
        if self.options.replace:
            for each in artwork:
                self.remove(each)
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        left_out = [note for note in report["notes"] if " × " in note and "omitted" in note]
        swapped = (
            [SWAPPED.format(title(target), title(artwork[0]))] if fits and is_swapped(artwork, target) else []
        )
        if len(drawn_in(target)) > 1:  # between letters nothing is expected
            doubts = [note for note in doubts if GAPS not in note]
        if said := [*errors, *swapped, *doubts, *(note for note in left_out if note not in doubts)]:
            inkex.errormsg(readable("\n".join(said)))

    def part(self, artwork):
        """Return the `#part` that selects the artwork's outline in its file; shapes are numbered from 1, the largest
        first.
        """
        first = f"#{artwork[0].get('id')}"
        parts = {"silhouette": "#silhouette", "largest": "#1", "box": "#canvas", "first": first}
        return parts[self.options.outline]

    def said(self):
        """Return the options that differ from their defaults."""
        found = []
        for name, default in (("fit", "auto"), ("holes", "auto"), ("parts", "auto"), ("balance", 1.0)):
            value = getattr(self.options, name)
            found += [f"--{name}", str(value)] if value != default else []
        turn = self.options.turn.strip()
        return found + ([f"--turn={turn}"] if turn else [])

    def marks(self):
        """Return the visible pins and strokes: for each kind, a dictionary from names to elements in drawing order."""
        found = {kind: {} for kind in KINDS}
        for element in self.svg.iterdescendants():
            if not isinstance(element, inkex.ShapeElement):
                continue
            name = element.get(LABEL) or element.get("id") or ""
            for kind in KINDS:
                if name.startswith(kind) and shown(element):
                    found[kind].setdefault(name, []).append(element)
        return found

    def listed(self, pairs, artwork, target):
        """Return pins and strokes for `--constraints`, each pair with the artwork's element first.

        With a target, the artwork's element is the one nearer to the artwork's bounding box than to the target's;
        without, it is the one drawn first.
        """
        for kind in pairs.values():
            for name, pair in kind.items():
                if len(pair) != 2:
                    where = (
                        "once on the artwork and once on the target"
                        if target is not None
                        else "at most twice"
                    )
                    raise Failed(f"{name} is drawn {len(pair)} times; draw it {where}, or hide it.")
        if target is not None:
            start_box, end_box = boxed(artwork), boxed([target])
            for kind in pairs.values():
                for name, (a, b) in kind.items():
                    as_drawn = distance(start_box, a) + distance(end_box, b)
                    swapped = distance(start_box, b) + distance(end_box, a)
                    kind[name] = (b, a) if swapped < as_drawn else (a, b)
        pins, strokes = pairs["pin-"], pairs["stroke-"]
        box = boxed(artwork)
        mark = MARK_SHARE * (box.width * box.height) ** 0.5
        return {
            "pins": [
                {"name": n, "source": middle(a), "target": middle(b), **settings(a, mark)}
                for n, (a, b) in pins.items()
            ],
            "strokes": [
                {"name": n, "source": polyline(a, n), "target": polyline(b, n)}
                for n, (a, b) in strokes.items()
            ],
        }

    def only(self, kept, left_out):
        """Return a copy of the document that draws only some elements; the others become definitions, so that clones
        still find them.
        """
        root = copy.deepcopy(self.svg)
        kept = {each.get("id") for each in kept}
        left_out = {each.get("id") for each in left_out}
        rest = etree.SubElement(root, inkex.addNS("defs", "svg"))

        def prune(parent, inside):
            for child in list(parent):
                if not isinstance(child.tag, str) or etree.QName(child).localname in NOT_DRAWN:
                    continue
                taken = inside or child.get("id") in kept
                holds = any(each.get("id") in kept for each in child.iterdescendants())
                if child.get("id") in left_out or not (taken or holds):
                    rest.append(child)
                else:
                    if (child.get("id") or "").startswith(KINDS):  # it would be read as a pin or a stroke
                        child.set("id", f"kept-{child.get('id')}")
                    if (child.get(LABEL) or "").startswith(KINDS):
                        child.attrib.pop(LABEL)
                    prune(child, taken)

        prune(root, False)
        for element in root.iter(inkex.addNS("image", "svg")):
            for name in HREFS:
                link = element.attrib.get(name, "")
                if link and not re.match(r"[a-zA-Z][a-zA-Z0-9+.-]+:|#|/", link):
                    element.set(name, (Path(self.document_path()).resolve().parent / link).as_uri())
        return root

    def remove(self, element):
        """Remove an element from the drawing; clones of it stay visible."""
        links = {each.attrib.get(name, "")[1:] for each in self.svg.iter() for name in HREFS}
        element.getparent().remove(element)
        if links & {each.attrib.get("id") for each in element.iter()}:
            self.svg.defs.append(element)

    def insert(self, made, target, name):
        """Insert a group above the target, in the target's layer. Its coordinates are in the document's user units."""
        above = target
        while not is_layer(above.getparent()) and above.getparent() is not self.svg:
            above = above.getparent()
        layer = above.getparent()
        made.set("id", self.svg.get_unique_id("texture"))
        made.set(LABEL, name)
        made.transform = -layer.composed_transform() @ made.transform
        layer.insert(layer.index(above) + 1, made)


def drawn_in(element):
    """Return the visible elements that an element consists of: itself, or the members of a group."""
    return [
        each
        for each in element.iter()
        if isinstance(each, inkex.ShapeElement) and not isinstance(each, inkex.Group) and shown(each)
    ]


def has_photo(element):
    """Return whether a picture is among the visible elements that an element consists of."""
    return any(isinstance(each, inkex.Image) for each in drawn_in(element))


def is_open_line(element):
    """Return whether an element consists only of open lines."""
    drawn = drawn_in(element)
    return bool(drawn) and all(
        isinstance(each, (inkex.PathElement, inkex.Line, inkex.Polyline))
        and each.specified_style().get("fill") == "none"
        and not any(line[0][1] == line[-1][1] for line in each.path.to_superpath() if line)
        for each in drawn
    )


def is_swapped(artwork, target):
    """Return whether the artwork was apparently selected last: text, a picture or several objects, after one plain
    shape.
    """
    plain = (inkex.PathElement, inkex.Rectangle, inkex.Circle, inkex.Ellipse, inkex.Polygon)
    return (
        len(artwork) == 1
        and isinstance(artwork[0], plain)
        and not isinstance(target, plain)
        and (isinstance(target, (inkex.TextElement, inkex.Image)) or len(drawn_in(target)) > 1)
    )


def is_layer(element):
    """Return whether an element is an Inkscape layer."""
    return element.get(inkex.addNS("groupmode", "inkscape")) == "layer"


def shown(element):
    """Return whether an element is drawn: it is not hidden, and not inside anything hidden or a definition."""
    while element is not None:
        style = element.attrib.get("style", "").replace(" ", "")
        if (
            "display:none" in style
            or element.attrib.get("display") == "none"
            or element.tag.endswith("}defs")
        ):
            return False
        element = element.getparent()
    return True


def title(element):
    """Return the name of an element as the user sees it."""
    return element.get(LABEL) or element.get("id")


def boxed(elements):
    """Return the bounding box of elements in user units."""
    found = None
    for each in elements:
        box = each.bounding_box(each.getparent().composed_transform())
        found = box if found is None else found + box
    return found


def middle(element):
    """Return the centre of an element in user units."""
    box = boxed([element])
    return [box.center.x, box.center.y]


def settings(pin, mark):
    """Return the settings of a pin: its radius in user units, if its circle is larger than a mark."""
    box = boxed([pin])
    radius = (box.width * box.height) ** 0.5 / 2
    return {"radius": radius} if radius > mark else {}


def distance(box, element):
    """Return the distance of an element's centre to a bounding box, 0 inside."""
    x, y = middle(element)
    across = max(box.left - x, 0, x - box.right)
    return (across**2 + max(box.top - y, 0, y - box.bottom) ** 2) ** 0.5


def polyline(element, name):
    """Return a stroke as points in user units."""
    curve = element.path.transform(element.composed_transform()).to_superpath()
    if len(curve) != 1:
        raise Failed(f"{name} has {len(curve)} parts; draw it as one line.")
    box = curve.to_path().bounding_box()
    bezier.cspsubdiv(curve, FLATNESS * max(box.width, box.height))
    return [list(node[1]) for node in curve[0]]


def write(root, path):
    """Write a document to a file."""
    path.write_bytes(etree.tostring(root))


def drawn_box(root, folder):
    """Return left, top, width and height in user units of everything that a document draws, measured by Inkscape."""
    bare = copy.deepcopy(root)
    for name in ("viewBox", "width", "height"):
        bare.attrib.pop(name, None)
    write(bare, folder / "measured.svg")
    lines = inkscape(str(folder / "measured.svg"), "--query-all").splitlines()
    try:
        x, y, width, height = map(float, lines[0].split(",")[1:])
    except (IndexError, ValueError):
        raise Failed("Select visible objects; the selection draws nothing.") from None
    if not width > 0 or not height > 0:
        raise Failed("The selected objects have no area.")
    return x, y, width, height


def framed(root, box, margin):
    """Set the canvas of a document to a box with a margin relative to its larger side; return the canvas."""
    x, y, width, height = box
    by = margin * max(width, height)
    box = (x - by, y - by, width + 2 * by, height + 2 * by)
    root.set("viewBox", " ".join(f"{value:.12g}" for value in box))
    root.set("width", f"{box[2]:.12g}")
    root.set("height", f"{box[3]:.12g}")
    root.attrib.pop("preserveAspectRatio", None)
    return box


def render(drawing_path, path, side):
    """Render a drawing's canvas to a PNG file with Inkscape."""
    root = etree.parse(str(drawing_path)).getroot()
    width, height = float(root.get("width")), float(root.get("height"))
    longer = {"export_width": side} if width >= height else {"export_height": side}
    inkscape(
        str(drawing_path),
        "--export-area-page",
        export_type="png",
        export_filename=str(path),
        **longer,
    )
    if not path.is_file():
        raise Failed("Inkscape could not render the artwork.")


def image(path, box):
    """Return an embedded picture that covers a box."""
    group, element = inkex.Group(), inkex.Image()
    for name, value in zip(("x", "y", "width", "height"), box):
        element.set(name, f"{value:.12g}")
    element.set("preserveAspectRatio", "none")
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    element.set(HREFS[1], f"data:image/png;base64,{data}")
    group.append(element)
    return group


def drawing(path, svg):
    """Return the contents of a drawing as a group with IDs that are new in the document; add its definitions to the
    document.
    """
    root = inkex.load_svg(str(path)).getroot()
    taken = set(svg.get_ids())
    new = {}
    for element in root.iter():
        old = element.get("id") if isinstance(element.tag, str) else None
        if old:
            number = 1
            while (name := f"{old}-{number}") in taken:
                number += 1
            new[old] = name
            taken.add(name)
    for element in root.iter():
        for key, value in element.attrib.items():
            element.set(key, renamed(value, new, key))
        if isinstance(element.tag, str) and element.tag.endswith("}style"):
            element.text = renamed(element.text or "", new)
    group = inkex.Group()
    for key, value in root.attrib.items():
        if key not in OF_ROOT and not key.startswith("{"):
            group.set(key, value)
    styles = {each.text for each in svg.iter(inkex.addNS("style", "svg"))}
    for child in list(root):
        tag = etree.QName(child).localname if isinstance(child.tag, str) else ""
        if tag == "defs":
            for each in list(child):
                svg.defs.append(each)
        elif tag == "style":
            if child.text not in styles:
                svg.defs.append(child)
        elif tag not in NOT_DRAWN:
            group.append(child)
    if not len(group):
        raise Failed("No part of the artwork lies inside its outline.")
    return group


def renamed(text, new, key=""):
    """Return an attribute or a style sheet with references to elements replaced by their new names."""
    if key == "id":
        return new.get(text, text)
    if key in HREFS and text.startswith("#"):
        return f"#{new.get(text[1:], text[1:])}"

    def refer(found):
        return f"url(#{new.get(found[1], found[1])})"

    return re.sub(r"url\(\s*[\"']?#([^\"')]+)[\"']?\s*\)", refer, text)


def readable(text):
    """Return a message of iccm in terms of the document."""
    return text.replace("artwork.svg", "the artwork").replace("target.svg", "the target")


if __name__ == "__main__":
    Texture().run()

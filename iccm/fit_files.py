"""Results as saved maps, and back."""

from dataclasses import replace
from typing import Any

from .axes import AXES, UP
from .curve import Curve
from .drawings.drawing import Drawing
from .errors import InputError
from .fit_data import Details, FitData
from .maps.regions import RigidRegion, mean_scale, triangles_in
from .maps.triangulated.map import TriangulatedMap
from .options import PLACES, TOLERANCE
from .pins import Softness
from .saved.map_file import DRAWING_RINGS, FORMER_RINGS, RINGS, MapFile, SavedPlane
from .status import Status


def to_map_file(fit: FitData, planes: tuple[SavedPlane, SavedPlane] | None, about: dict[str, Any]) -> MapFile:
    """Return the contents of a saved map; see `Fit.save` for the arguments.

    Raises:
        InputError: the map is between flattened surfaces.
    """
    if any(fit.details.layouts):
        raise InputError("save: the map of a mesh cannot be saved, only maps between planar shapes")
    default_planes = SavedPlane.of(fit.source.z, fit.source_holes), SavedPlane.of(fit.image, fit.target_holes)
    if fit.details.place != "fill":
        default_planes = (
            replace(default_planes[0], box=fit._boxes[0]),
            replace(default_planes[1], box=fit._boxes[1]),
        )
    outlines = fit.source.z, fit.target.z if fit.target else None
    saved_planes = [replace(plane, outline=z) for plane, z in zip(planes or default_planes, outlines)]
    sides = zip(*fit.strokes) if fit.strokes else ((), ())
    curves = (*sides, fit.source_holes, fit.target_holes)
    rings = {name: [curve.z for curve in group] for name, group in zip(RINGS, curves)}
    rings |= {name: [] for name in FORMER_RINGS}
    data = {"ended": fit._ended.name, "notes": fit.notes, "energies": fit.energies, **about}
    data |= {"tolerance": fit.details.tolerance, "axes": list(fit.axes)}
    data |= {} if fit.details.softness is None else {"softness": fit.details.softness.as_lists()}
    arrays = {"pins": fit.pins, "hole_partners": fit.details.hole_partners}
    rings["filled"] = list(fit.details.filled or ())
    for side, name in enumerate(DRAWING_RINGS):
        rings[name] = fit.details.drawings[side].rings if fit.details.drawings else []
    data |= {"opaque": fit.details.opaque, "place": fit.details.place}
    rings["rigid"] = [ring for region in fit.rigid for ring in region.rings]
    data["rigid"] = [len(region.rings) for region in fit.rigid]
    data["rigid_of_target"] = any(region.of_target for region in fit.rigid)
    return MapFile(fit.map, (saved_planes[0], saved_planes[1]), arrays, rings, data)


def from_map_file(map_file: MapFile) -> FitData:
    """Return the data of the result that a map file contains.

    Raises:
        InputError: the data about the map are inconsistent.
    """
    about, (source, target) = map_file.about, map_file.planes
    ended: str = about["ended"]
    notes: list[str] = about.get("notes", [])
    energies: list[dict[str, float]] = about.get("energies", [])
    tolerance = about.get("tolerance", TOLERANCE)
    axes = about.get("axes", list(UP))
    is_tolerance = isinstance(tolerance, float) and tolerance > 0
    if not isinstance(axes, list) or len(axes) != 2 or any(axis not in AXES for axis in axes):
        raise InputError("about: the axes are not those of two planes")
    if source.outline is None or ended not in Status.__members__ or not is_tolerance:
        raise InputError("about: the description of the solver is invalid")
    begins, ends, *holes = (
        [Curve(z, not name.startswith("stroke")) for z in map_file.rings[name]] for name in RINGS[:4]
    )
    partners = [(int(i), int(j)) for i, j in map_file.arrays["hole_partners"]]
    fits = all(-1 <= i < len(holes[0]) and -1 <= j < len(holes[1]) for i, j in partners)
    fits &= target.outline is None or len(partners) == len(map_file.map.rims) - 1
    filled = map_file.rings["filled"]
    if len(begins) != len(ends) or not fits or len(filled) not in (0, 2):
        raise InputError("hole_partners, strokes, filled: inconsistent with each other")
    return FitData(
        map=replace(map_file.map, axes=(axes[0], axes[1])) if tuple(axes) != UP else map_file.map,
        _ended=Status[ended],
        energies=energies,
        source=Curve(source.outline),
        target=None if target.outline is None else Curve(target.outline),
        pins=map_file.arrays["pins"],
        strokes=list(zip(begins, ends)),
        notes=notes,
        source_holes=holes[0],
        target_holes=holes[1],
        rigid=_regions(map_file, (holes[0], holes[1])),
        axes=(axes[0], axes[1]),
        details=Details(
            hole_partners=partners,
            filled=(filled[0], filled[1]) if filled else None,
            drawings=_drawings(map_file),
            opaque=about.get("opaque") is not False,
            place=about["place"] if about.get("place") in PLACES else "fill",
            softness=_softness(map_file),
            tolerance=tolerance,
        ),
    )


def _softness(map_file: MapFile) -> Softness | None:
    """Return the softness of a saved map's pins.

    Raises:
        InputError: their numbers differ.
    """
    lists = map_file.about.get("softness")
    if lists is None:
        return None
    softness = Softness.from_lists(lists)
    if softness is None or len(softness.radii) != len(map_file.arrays["pins"]):
        raise InputError("about: the softness is not that of the pins")
    return softness


def _drawings(map_file: MapFile) -> tuple[Drawing, Drawing] | None:
    """Return the drawings of a saved map; None if it is not a map of whole drawings."""
    source, target = (map_file.rings[name] for name in DRAWING_RINGS)
    if not source or not target:
        return None
    return Drawing.of_rings(source, "source drawing"), Drawing.of_rings(target, "target drawing")


def _regions(map_file: MapFile, holes: tuple[list[Curve], list[Curve]]) -> list[RigidRegion]:
    """Return the rigid regions of a saved map.

    Raises:
        InputError: the rings do not form regions, or a region contains no triangles.
    """
    counts, rings = map_file.about.get("rigid", []), list(map_file.rings["rigid"])
    if sum(counts) != len(rings) or (rings and not isinstance(map_file.map, TriangulatedMap)):
        raise InputError("rigid: the rings do not form regions")
    source, target = (None if plane.outline is None else Curve(plane.outline) for plane in map_file.planes)
    mean = mean_scale(source, target, holes) if source else 1.0
    regions, of_target = [], map_file.about.get("rigid_of_target") is True
    for count in counts:
        region, rings = tuple(rings[:count]), rings[count:]
        if (
            not isinstance(map_file.map, TriangulatedMap)
            or not triangles_in(map_file.map, region, of_target=of_target).size
        ):
            raise InputError("rigid: a region contains no triangles")
        regions.append(RigidRegion.of(map_file.map, region, mean, of_target=of_target))
    return regions

"""Layers of GeoPackage, Shapefile, KML and FlatGeobuf: geometries carried like those of GeoJSON, columns kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import InputError
from .. import formats
from ..outlines import layers
from ..spec import Spec
from .document import Geometry, GeometryDocument, Images
from .geojson import GeoJson


@dataclass
class LayerDocument(GeometryDocument):
    """A layer of a file, whose features are written to a file with this layer only."""

    is_database = True

    layer: layers.Layer
    inner: GeoJson
    geometry: Geometry
    notes: tuple[str, ...] = ()

    @classmethod
    def parse(cls, data: bytes, columns: str | None) -> LayerDocument:
        """Layers are read from files, by `of_file`."""
        raise InputError("layers are read from files")

    @classmethod
    def of_file(cls, text: str) -> LayerDocument:
        """Read `file` or `file#layer`.

        Raises:
            InputError: as for `outlines.layers.read`, or there is no geometry.
        """
        spec = Spec.of(text)
        layer = layers.read(spec.path, spec.selection)
        inner = GeoJson.of(layer.content)
        others = f"only the layer {layer.name} is written, without {', '.join(layer.others)}"
        return cls(layer, inner, inner.geometry, (*inner.notes, *([others] if layer.others else [])))

    def encode(self, images: Images) -> bytes:
        """Raise InputError: a layer cannot be encoded as bytes; `write` writes it to a file."""
        raise InputError("layers are written to files")

    def write(self, images: Images, path: Path) -> None:
        """Write the layer with the images, and its further files beside it."""
        layers.write(replace(self.layer, content=self.inner.mapped(images)), path)

    @staticmethod
    def companions(output: str) -> Sequence[str]:
        """Return the names of the further files of an output."""
        suffixes = layers.COMPANIONS.get(formats.suffix_of(output), ())
        return [str(Path(output).with_suffix(suffix)) for suffix in suffixes]

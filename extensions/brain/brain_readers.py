"""Readers of GIFTI and of FreeSurfer's files for the separate process, in which the library is imported."""

from typing import Any

import numpy as np


def gifti(path: str) -> dict[str, Any]:
    """Return the `arrays` of a GIFTI file with their `intents`, and its `labels` (key, red, green, blue, alpha)."""
    from nibabel.gifti import GiftiImage

    image = GiftiImage.from_filename(path)
    labels = [
        [label.key, label.red, label.green, label.blue, label.alpha] for label in image.labeltable.labels
    ]
    return {
        "arrays": [np.asarray(array.data) for array in image.darrays],
        "intents": [int(array.intent) for array in image.darrays],
        "labels": [[0.0 if part is None else float(part) for part in label[:4]]
                   + [1.0 if label[4] is None else float(label[4])] for label in labels],
    }  # fmt: skip


def freesurfer(path: str, kind: str) -> dict[str, Any]:
    """Return what a file of FreeSurfer holds: a "surface", an "annot", numbers ("morph"), or a volume ("mgh")."""
    import nibabel

    read = nibabel.freesurfer
    if kind == "surface":
        points, faces = read.read_geometry(path)[:2]
        return {"points": np.asarray(points, float), "faces": np.asarray(faces, np.int64)}
    if kind == "mgh":
        volume: Any = nibabel.load(path)
        return {"values": np.asarray(volume.dataobj, float).reshape(-1, order="F")}
    if kind == "annot":
        keys, table, _ = read.read_annot(path)
        return {"values": np.asarray(keys, float), "colors": np.asarray(table, float)}
    return {"values": np.asarray(read.read_morph_data(path), float)}

"""Materials between glTF and MTL: pictures of different depths in one."""

import numpy as np
import pytest

from iccm.io.materials import translate
from iccm.io.materials.material_set import Material
from iccm.io.materials.of_gltf import ROUGH
from iccm.io.pictures.image import Image

SHALLOW = np.array([[0, 1, 128, 255], [3, 77, 200, 254]], np.uint8)
DEEP = np.array([[0, 300, 32768, 65535], [9, 20000, 40000, 65000]], np.uint16)


@pytest.mark.parametrize("roughness_is_deep", [False, True])
def test_roughness_and_metal_of_different_depths_keep_their_values(roughness_is_deep):
    roughness, metal = (DEEP, SHALLOW) if roughness_is_deep else (SHALLOW, DEEP)
    images = {"map_pr": Image(roughness[..., None]), "map_pm": Image(metal[..., None])}
    kinds = dict.fromkeys(images, "data")
    converted, _, _ = translate.to_gltf(images, kinds, Material("tin", key="tin", source=[]))
    pixels = converted[ROUGH].pixels
    assert pixels.dtype == np.uint16 and (pixels[..., 0] == 65535).all()
    for values, channel in ((roughness, pixels[..., 1]), (metal, pixels[..., 2])):
        np.testing.assert_allclose(channel / 65535, values / np.iinfo(values.dtype).max, atol=1e-9)

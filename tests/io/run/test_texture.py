"""Textures shared by jobs are read and prepared once; changed ones are read again."""

import os

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io.pictures import image_files
from iccm.io.pictures.image import Image
from iccm.io.run import texture
from iccm.io.run.job import Job
from iccm.memory import Memory

BOX = (0j, 1 + 1j)


class Blank:
    pictures = ()
    bounds = BOX


def load(**options):
    job = Job(source="a.svg", target="b.svg", **options)
    image = texture.image_of(job, Blank(), Memory())
    return image, texture.sampler_of(job, image, options.pop("box", BOX), [], Memory(), 1)


@pytest.fixture
def grey(tmp_path):
    path = tmp_path / "a.png"
    image_files.write(path, Image(np.full((8, 8, 3), 100, np.uint8)))
    return path


def test_the_next_job_finds_the_same_texture(grey):
    (image, sampler), (again, same_sampler) = load(texture=str(grey)), load(texture=str(grey))
    assert again is image and same_sampler is sampler
    assert load()[1] is load()[1]  # the checkerboard


def test_other_options_or_files_are_read_again(grey):
    image, sampler = load(texture=str(grey))
    again, new_sampler = load(texture=str(grey), filter="linear")
    assert again is image and new_sampler is not sampler
    assert load(texture=str(grey), colorspace="data")[0] is not image
    assert load(texture=str(grey), memory="1G")[0] is not load(texture=str(grey), memory="1G")[0]
    image_files.write(grey, Image(np.full((8, 8, 3), 200, np.uint8)))
    os.utime(grey, ns=(1, 1))
    assert (load(texture=str(grey))[0].pixels == 200).all()
    grey.unlink()
    with pytest.raises(InputError, match="no such file"):
        load(texture=str(grey))
    with pytest.raises(InputError, match="max-pixels"):
        image_files.write(grey, image)
        load(texture=str(grey), max_pixels=9)


def test_a_large_texture_is_not_kept(grey, monkeypatch):
    monkeypatch.setattr(texture, "KEPT_VALUES", 100)
    assert load(texture=str(grey))[0] is not load(texture=str(grey))[0]

"""Drawn wings with landmarks: the same pattern, or varied ones, on specimens of different shapes."""

from pathlib import Path

import numpy as np
import shapely
from PIL import Image

from iccm.arrays import complex_of

HEIGHT_SHARE = 0.75
NAMES = ("root", "tip", "margin", "corner", "eye", "fork")
LANDMARKS = np.array([0.02 + 0.06j, 0.98 + 0.52j, 0.93 + 0.2j, 0.62 - 0.06j, 0.7 + 0.27j, 0.4 + 0.2j])
"""Places on the pattern, y up; the first four lie on the outline."""


def outline() -> shapely.Polygon:
    """The outline of the pattern: a forewing, of width one, with corners at the landmarks."""
    edges = (  # cubic Bezier curves from landmark to landmark
        (LANDMARKS[0], 0.25 + 0.32j, 0.7 + 0.5j, LANDMARKS[1]),
        (LANDMARKS[1], 1.05 + 0.42j, 0.93 + 0.32j, LANDMARKS[2]),
        (LANDMARKS[2], 0.93 + 0.08j, 0.78 - 0.04j, LANDMARKS[3]),
        (LANDMARKS[3], 0.4 - 0.02j, 0.2 - 0.03j, LANDMARKS[0]),
    )
    t = np.arange(40) / 40
    z = [
        a * (1 - t) ** 3 + 3 * b * t * (1 - t) ** 2 + 3 * c * t**2 * (1 - t) + d * t**3
        for a, b, c, d in edges
    ]
    z = np.concatenate(z)
    return shapely.Polygon(np.column_stack([z.real, z.imag]))


def colours(z: np.ndarray, eye: float = 0.075, band: float = 0.09) -> np.ndarray:
    """The pattern (…, 3) at points: brown with veins, an orange band with a wavy edge, and an eye spot."""
    x, y = z.real, z.imag
    rgb = np.empty((*z.shape, 3))
    rgb[:] = np.array([0.33, 0.2, 0.13])
    rgb += (0.12 * x - 0.1 * y)[..., None]
    wave = 0.02 * np.sin(25 * y)
    rgb[np.abs(x - 0.45 - 0.3 * y + wave) < band / 2] = (0.93, 0.55, 0.13)
    for slope in (-0.12, 0.12, 0.4):
        rgb[np.abs(y - 0.2 - slope * (x - 0.4)) < 0.006 * (x > 0.4)] = (0.16, 0.1, 0.08)
    away = np.abs(z - LANDMARKS[4])
    rgb[away < eye] = (0.95, 0.9, 0.75)
    rgb[away < 0.65 * eye] = (0.08, 0.1, 0.3)
    rgb[np.abs(z - LANDMARKS[4] - (-0.25 + 0.2j) * eye) < 0.2 * eye] = (1, 1, 1)
    return rgb


class Wing:
    """A specimen: the pattern bent, scaled, rotated and placed in a picture."""

    def __init__(self, seed: int, width: int = 200, *, mirrored: bool = False, varied: bool = False):
        """Choose a form; specimens with `varied` patterns differ in their eye and band, too."""
        random = np.random.default_rng(seed)
        self.width, self.height, self.mirrored = width, round(HEIGHT_SHARE * width), mirrored
        self._factor = width * random.uniform(0.62, 0.75) * np.exp(1j * random.uniform(-0.3, 0.3))
        self._stretch = random.uniform(0.88, 1.12)
        self._waves = random.uniform(-0.025, 0.025, (2, 2)) @ np.array([1, 1j])
        self._pattern = (
            dict(zip(("eye", "band"), random.uniform((0.05, 0.07), (0.09, 0.13)))) if varied else {}
        )
        self._grain = random

    def on_pattern(self, pixels: np.ndarray) -> np.ndarray:
        """The places on the pattern of points of the picture, y down."""
        if self.mirrored:
            pixels = self.width - pixels.conj()
        z = (pixels.conj() - (self.width - 1j * self.height) / 2) / self._factor
        z = z.real * self._stretch + 1j * z.imag
        bend = self._waves[0] * np.sin(5 * z.real + 1) + self._waves[1] * np.sin(6 * z.imag + 3 * z.real)
        return z + bend + 0.5 + 0.22j

    def pixels_of(self, z: np.ndarray) -> np.ndarray:
        """The inverse of `on_pattern`, by a fixed-point iteration."""
        places = np.full(z.shape, (self.width + 1j * self.height) / 2)
        for _ in range(60):
            step = (z - self.on_pattern(places)) * self._factor
            places = places + 0.7 * (-step if self.mirrored else step.conj())
        assert np.abs(self.on_pattern(places) - z).max() < 1e-6
        return places

    @property
    def landmarks(self) -> np.ndarray:
        """The landmarks in the picture, y down."""
        return self.pixels_of(LANDMARKS)

    def picture(self, samples: int = 3) -> Image.Image:
        """The picture, on a light background with some grain."""
        x = (np.arange(self.width * samples) + 0.5) / samples
        y = (np.arange(self.height * samples) + 0.5) / samples
        z = self.on_pattern(x[None, :] + 1j * y[:, None])
        shape = outline()
        shapely.prepare(shape)
        large = np.where(
            shapely.contains_xy(shape, z.real, z.imag)[..., None], colours(z, **self._pattern), 0.87
        )
        small = large.reshape(self.height, samples, self.width, samples, 3).mean(axis=(1, 3))
        small += self._grain.normal(0, 0.006, small.shape[:2])[..., None]
        return Image.fromarray(np.rint(255 * np.clip(small, 0, 1)).astype(np.uint8))


def tps(wings: dict[str, Wing], suffix: str = ".png") -> str:
    """The landmarks of wings by name, as tpsDig writes them: y up from the lower edge."""
    lines = []
    for name, wing in wings.items():
        points = [f"{z.real:.3f} {wing.height - z.imag:.3f}" for z in wing.landmarks]
        lines += [f"LM={len(points)}", *points, f"IMAGE={name}{suffix}", f"ID={name}"]
    return "\n".join(lines) + "\n"


def write(folder: Path, wings: dict[str, Wing]) -> None:
    """Write the pictures of wings by name, and their landmarks in `wings.tps`."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, wing in wings.items():
        wing.picture().save(folder / f"{name}.png")
    (folder / "wings.tps").write_text(tps(wings), encoding="utf-8")


def rings_of(path: Path) -> np.ndarray:
    """The first outline in an SVG file of polygons."""
    numbers = path.read_text(encoding="utf-8").split(' d="M')[1].split('Z"')[0].replace(",", " ").split()
    return complex_of(np.array(numbers, float).reshape(-1, 2))

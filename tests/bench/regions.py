"""Rigid regions on random pairs: whether they are kept, and what that costs.

python -m tests.bench.regions [--pairs 60] [--seed 1] [--sheet FILE.png] [--cartograms]

Each source has a disc, a rectangle or a letter with 3 to 20 % of its area at a random place inside (less if there is no
room). A row for each pair: figures with the region, compared with those of the whole map without it. The sheet shows
each target with a checkerboard and the outline of the region's image. Cartograms are countries mapped onto themselves
with ten parts each, whose requested areas have ratios of up to 4.
"""

import argparse
import random
import time

import numpy as np
import shapely
from shapely import affinity

import iccm
from iccm.arrays import complex_of, xy_of
from iccm.balanced.model.metric import PLACES
from iccm.maps.distortion import Distortion, of_triangles
from iccm.plane import triangle_areas
from tests.bench import shapes

SHARES = 0.03, 0.2  # relative to the source's area
LETTER = shapely.Polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 5), (0, 5)])
KINDS = {
    "disc": shapely.Point(0, 0).buffer(1),
    "rectangle": shapely.box(0, 0, 1.6, 1),
    "letter": LETTER,
}
OFF = 0.012  # relative to the root of the area: distance from the outline
TRIES = 40  # places tried for each size
PARTS, MOST_PEOPLE, SIDE = 10, 4, 400  # for cartograms: regions, largest ratio of populations, pixels


def main(words: list[str] | None = None) -> None:
    """Print the table and its summary; draw the sheet."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sheet")
    parser.add_argument("--cartograms", action="store_true")
    options = parser.parse_args(words)
    if options.cartograms:
        cartograms(options.pairs, options.seed)
        return
    choice, rows, cells = random.Random(options.seed), [], []
    pairs = shapes.drawn_pairs(options.pairs, options.seed, [], tuple(shapes.WILD))
    # for compilation
    iccm.fit(pairs[0][0].curve, pairs[0][1].curve, rigid=[placed(pairs[0][0].curve, choice)[1]])
    print(
        f"seed {options.seed}; pair, region, share: status, K95, size, p95 of the stretch elsewhere and CPU by without"
    )
    for source, target in pairs:
        kind, region = placed(source.curve, choice)
        name = f"{shapes.label(source)} to {shapes.label(target)}, {kind}"
        row, fit = measured(source.curve, target.curve, region, name)
        rows.append(row)
        cells.append((name, fit, region))
    summary(rows)
    if options.sheet:
        draw(cells, options.sheet)


def placed(curve: iccm.Curve, choice: random.Random) -> tuple[str, np.ndarray]:
    """Return the kind and the outline of a region."""
    domain = shapely.Polygon(xy_of(curve.z))
    room, share = domain.buffer(-OFF * np.sqrt(domain.area)), choice.uniform(*SHARES)
    kind = choice.choice(sorted(KINDS))
    left, low, right, high = domain.bounds
    while True:
        size = np.sqrt(share * domain.area / KINDS[kind].area)
        shape = affinity.scale(KINDS[kind], size, size, origin=(0, 0))
        for _ in range(TRIES):
            place = choice.uniform(left, right), choice.uniform(low, high)
            if room.contains(moved_shape := affinity.translate(shape, *place)):
                return kind, complex_of(shapely.get_coordinates(moved_shape.exterior)[:-1])
        share *= 0.9


def measured(
    source: iccm.Curve, target: iccm.Curve, region: np.ndarray, name: str
) -> tuple[tuple, iccm.Fit | None]:
    """Print a row of the table; return it, and the map."""
    started = time.process_time()
    plain = iccm.fit(source, target, fit="whole")
    between = time.process_time()
    try:
        fit = iccm.fit(source, target, rigid=[region])
    except iccm.IccmError as error:
        print(f"{name}: {error}", flush=True)
        return (False, False, False, np.nan, np.nan, np.nan), None
    ended = time.process_time()
    (rigid,) = fit.rigid
    outside_region = np.flatnonzero(~iccm.Curve(region).contains(fit.map.source[fit.map.faces].mean(axis=1)))
    stretch = p95(of_triangles(fit.map, outside_region)) / p95(plain.distortion)
    cpu = (ended - between) / (between - started)
    sound = fit.certificate.report()["certified"] and fit._boundary["hausdorff"] <= 1e-3
    share = abs(iccm.Curve(region).area) / source.area
    sizes = "–".join(f"{rigid.sizes[k]:.3f}" for k in (0, 2))
    print(
        f"{name}, {share:.1%}: {fit.status.name.lower()}, {rigid.dilatation:.4f}, {sizes}, {stretch:.2f}, {cpu:.2f}"
        + ("" if sound else ", NOT CERTIFIED or off the outline"),
        flush=True,
    )
    return (fit.status.ok, rigid.is_rigid, sound, rigid.scale, stretch, cpu), fit


def cartograms(count: int, seed: int) -> None:
    """Print whether ten parts of some countries get the requested areas."""
    choice = np.random.default_rng(seed)
    print(f"seed {seed}; country: farthest off its area, certified, K of 95 %, CPU seconds")
    lands = shapes.countries()
    for name in random.Random(seed).sample(sorted(lands), count):
        curve = lands[name]
        seats = seats_in(curve, PARTS, choice)
        people = np.exp(choice.uniform(0, np.log(MOST_PEOPLE), PARTS))
        low, high = curve.box
        x = np.linspace(low.real, high.real, SIDE + 1)[:-1] + 0.5 * (high - low).real / SIDE
        y = np.linspace(high.imag, low.imag, SIDE + 1)[:-1] - 0.5 * (high - low).imag / SIDE
        started = time.process_time()
        sizes = np.sqrt(people)[nearest(seats, x[None, :] + 1j * y[:, None])]
        fit = iccm.fit(curve, curve, size_map=sizes, balance=8)
        cpu = time.process_time() - started
        places = fit.map.source[fit.map.faces] @ PLACES.T
        owner = nearest(seats, places).ravel()
        before, after = (
            np.bincount(owner, np.repeat(np.abs(triangle_areas(w[fit.map.faces])), places.shape[1]), PARTS)
            for w in (fit.map.source, fit.map.image)
        )
        off = np.abs(after / after.sum() / (people * before / (people * before).sum()) - 1).max()
        bent = fit.distortion.quantile(fit.distortion.dilatations, 0.95)
        certified = fit.certificate.report()["certified"]
        print(f"{name}: {off:.1%}, {certified}, {bent:.1f}, {cpu:.1f}", flush=True)


def nearest(seats: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the seat nearest to each place."""
    return np.abs(z[..., None] - seats).argmin(axis=-1)


def seats_in(curve: iccm.Curve, count: int, choice: np.random.Generator) -> np.ndarray:
    """Return the centres of parts of a shape with about equal size (Lloyd's algorithm)."""
    low, high = curve.box
    z = low + choice.random(20_000) * (high - low).real + 1j * choice.random(20_000) * (high - low).imag
    z = z[curve.contains(z)]
    seats = z[:count]
    for _ in range(6):
        owner = nearest(seats, z)
        seats = np.array([z[owner == k].mean() for k in range(count)])
    return seats


def p95(distortion: Distortion) -> float:
    """Return the 95 % quantile of the stretch."""
    return distortion.quantile(distortion.stretches, 0.95)


def summary(rows: list[tuple]) -> None:
    """Print the figures of all pairs."""
    ok, rigid, sound, scale, stretch, cpu = (np.array(column) for column in zip(*rows))
    ok, rigid, sound = (values.astype(bool) for values in (ok, rigid, sound))
    print(
        f"{ok.sum()} of {ok.size} end well, {np.sum(ok & rigid)} of these rigid; "
        f"certified and on the outline: {sound.sum()}; at the mean scale {np.sum(scale >= 0.98)}, "
        f"smallest {np.nanmin(scale):.2f}; elsewhere p95 of the stretch × {np.nanmedian(stretch):.2f}, "
        f"CPU × {np.nanmedian(cpu):.2f} in the median, × {np.nanmax(cpu):.1f} at most"
    )


def draw(cells: list[tuple], path: str, columns: int = 8) -> None:
    """Draw targets with a checkerboard and the outlines of the regions' images."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2.4 * columns, 2.6 * -(-len(cells) // columns)), layout="constrained")
    for place, (name, fit, region) in enumerate(cells):
        axes = figure.add_subplot(-(-len(cells) // columns), columns, place + 1)
        axes.set_axis_off()
        axes.set_title(name.replace(" to ", "\n"), fontsize=5)
        if fit is None:
            continue
        picture = iccm.warp(fit, iccm.checkerboard(512), size=400)
        low, high = picture.box
        axes.imshow(picture.pixels, extent=(low.real, high.real, low.imag, high.imag))
        ring = fit.map(np.append(region, region[0]))
        axes.plot(ring.real, ring.imag, "k", lw=1.2)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()

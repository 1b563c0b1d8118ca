"""How much of the picture changes when the first pin is placed in `iccm edit`.

python -m tests.bench.first_pins [--pairs 12] [--pins 2] [--seed 82] [--first 0] [--set el]

Random pairs of an icon set (fetched by npm) are opened as the page opens them, with and without a photo, and in turns
such that their parts are mapped each, a fit leaves parts out, and holes are kept. A pin is placed at a random place
that is seen, where the map takes it. The export before and after is compared: `changed` is the share of the picture's
pixels that differ by more than an eighth of the range in a channel, `moved` is the largest displacement of 95 % of the
points in per cent of the target's diagonal. Then the pin is dragged by 5 % of the diagonal in small steps, and
released: `reached` is whether it is met there, `jump` is by how much the released map moves afterwards.
"""

import argparse
import io
import random
import time

import numpy as np
from PIL import Image

from iccm.errors import InputError
from iccm.frames.choice import may_pair
from iccm.io.edit import placing, saving
from iccm.io.edit.map_choice import greatest_displacement
from iccm.io.edit.messages import Scene
from iccm.io.edit.session import Session
from iccm.io.run.job import make

from . import drags
from .live import SAMPLES, place, reached, scene

SETS = {"vaadin": "@iconify-json/vaadin@1.2.1", "el": "@iconify-json/el@1.2.2"}
PHOTO = str(SAMPLES / "pins" / "face.png")
SETTINGS: list[dict[str, str]] = [  # of pairs in turns; the second is for pairs whose parts are mapped each
    {},
    {"texture": PHOTO},
    {"texture": PHOTO},
    {"fit": "contain"},
    {"holes": "keep"},
    {"fit": "cover", "texture": PHOTO},
]
EACH = 1  # number of the settings for which pairs are sought whose parts are mapped each
SIDE = 400  # pixels of the exported pictures
FAINT = 32  # of 255: a difference that is not a change
MOST_CHANGED_SHARE = 0.002
DRAG_SHARE, STEPS = 0.05, 20
TRIES = 400


def picture(session: Session, shown: Scene) -> np.ndarray:
    """Return the (SIDE, SIDE, 4) export of a scene."""
    made = saving.download(session, shown, "picture.png", SIDE)
    return np.asarray(Image.open(io.BytesIO(made.content)).convert("RGBA")).astype(int)


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """Return the share of pixels that differ by more than FAINT."""
    if before.shape != after.shape:
        return 1.0
    return float((np.abs(before - after).max(axis=2) > FAINT).mean())


def opened(name: str, settings: dict[str, str], choice: random.Random, *, each: bool) -> Session:
    """Return a session with the first random pair that can be read and mapped, if `each` by its parts."""
    drags.SETS |= SETS
    while True:
        source, target = (drags.drawing(name, choice) for _ in range(2))
        try:
            session = Session(make({"source": str(source), "target": str(target), **settings}))
            if each and not may_pair(session.pair.source.drawing, session.pair.target.drawing):
                continue
            is_solved = session.solve(Scene(fit=settings.get("fit", "auto"))).ok
            if is_solved and (len(session.maps) > 1 or not each):
                return session
        except InputError:
            continue


def first_pin(session: Session, rng: np.random.Generator) -> list[list[float]] | None:
    """Return a pin at a random place of the source that is seen, where the map takes it."""
    curve = session.pair.source.curve
    low, high = curve.box
    for _ in range(TRIES):
        z = complex(rng.uniform(low.real, high.real), rng.uniform(low.imag, high.imag))
        if not (curve.contains(np.array([z]))[0] and reached(session, z)):
            continue
        here = place(session, 0, z)
        return [here, placing.transfer(session, "source", [tuple(here)])[0]]
    return None


def drag(
    session: Session, pin: list[list[float]], shown: Scene, rng: np.random.Generator
) -> tuple[bool, float]:
    """Drag a pin in the target, and release it; return whether it is met there, and the jump."""
    target, start = session.pair.target, session.pair.target.at(tuple(pin[1]))
    for _ in range(TRIES):
        goal = start + DRAG_SHARE * target.curve.diagonal * np.exp(2j * np.pi * rng.uniform())
        if target.curve.contains(np.array([start, goal])).all():
            break
    for share in np.arange(1, STEPS + 1) / STEPS:
        ends = [pin[0], place(session, 1, start + share * (goal - start))]
        last = shown.model_copy(update={"pins": scene([ends]).pins})
        session.scene = last
        session.follow(last)
    for _ in range(3):
        session.relax(last)
    seen = session.maps
    update = session.solve(last, hand="released")
    jump = greatest_displacement(seen, session.maps) / target.curve.diagonal
    return update.kind == "full" and update.ok and not update.short, jump


def main() -> None:
    """Print a line for each pair."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--first", type=int, default=0, help="number of the first pair")
    parser.add_argument("--pins", type=int, default=2)
    parser.add_argument("--seed", type=int, default=82)
    parser.add_argument("--set", choices=SETS, default="vaadin")
    options = parser.parse_args()
    print(f"seed {options.seed}, {SETS[options.set]}: % of pixels, % of the diagonal", flush=True)
    print(f"{'':52} {'changed':>8} {'moved':>7} reached {'jump':>6}")
    good = 0
    for number in range(options.first, options.pairs):
        kind = number % len(SETTINGS)
        settings, choice = SETTINGS[kind], random.Random(f"{options.seed} {number}")
        session = opened(options.set, settings, choice, each=kind == EACH)
        begun, rng = time.process_time(), np.random.default_rng([options.seed, number])
        empty = Scene(fit=settings.get("fit", "auto"))
        before = picture(session, empty)
        rows = []
        for _ in range(options.pins):
            session.solve(empty)
            maps = session.maps
            pin = first_pin(session, rng)
            if pin is None:
                print("    no place is seen")
                continue
            shown = empty.model_copy(update={"pins": scene([pin]).pins})
            update = session.solve(shown)
            if update.kind != "full" or not update.ok:
                print(f"    {update.message}")
                rows.append((1.0, 1.0, False, 1.0))
                continue
            moved = greatest_displacement(maps, session.maps)
            share = changed(before, picture(session, shown))
            rows.append((share, moved / session.pair.target.curve.diagonal, *drag(session, pin, shown, rng)))
        worst = max(row[0] for row in rows)
        good += worst <= MOST_CHANGED_SHARE
        names = [shape.path.stem for shape in (session.pair.source, session.pair.target)]
        others = " ".join(value for name, value in settings.items() if name != "texture")
        label = f"{number} {' -> '.join(names)} {others} ({len(maps)} maps)"
        moved, jump = (100 * max(row[k] for row in rows) for k in (1, 3))
        met = f"{sum(row[2] for row in rows)}/{len(rows)}"
        seconds = time.process_time() - begun
        print(
            f"{label[:52]:52} {100 * worst:8.3f} {moved:7.3f} {met:>7} {jump:6.2f}  {seconds:4.0f} s",
            flush=True,
        )
    print(
        f"first pin changes at most {100 * MOST_CHANGED_SHARE} % of the pixels: "
        f"{good} of {options.pairs - options.first}"
    )


if __name__ == "__main__":
    main()

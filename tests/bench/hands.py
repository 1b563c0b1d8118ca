"""Drags in the pages themselves: how many pictures a second the hand sees, and whether what it released stays.

python -m tests.bench.hands {demo,editor} [--pairs 12] [--drags 8] [--seed 82] [--first 0] [--hold] [--load 0]
                            [--seconds 0.5]

A headless Chromium without a graphics card (SwiftShader, and a compositor without it) shows the demo of the site, or
`iccm edit`. Random pairs of sets of drawings (fetched by npm) are opened, in turns silhouettes and whole drawings in
the editor, the largest outlines in the demo. The drags of a pair follow each other: each places a new pin where the
map takes it, or takes an earlier one, and moves one of its ends to a random place anywhere in the shape, along the
shortest path inside. Then the hand rests for REST_PICTURES pictures and until the map has reached it, or with --hold
until the page has done everything that it does then, and releases the pin. With --load so many other processes use a
core each.

Of each pair, the table shows how many pins were `met` where the hand released them (corners and mirror images attract
them before), and in per cent of the target's diagonal by how much 95 % of the picture's points move at most between
the picture at the release and the one that stays (`after`, the worst drag, and how many are within MOST_AFTER).
`pictures` are those a second, from the first to the last movement of a drag: the median and the slowest drag.
"""

import argparse
import base64
import multiprocessing
import os
import random
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from selenium.common.exceptions import JavascriptException, WebDriverException
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.mouse_button import MouseButton

from iccm.curve import Curve, inside_any
from iccm.errors import InputError
from iccm.io.edit.session import Session
from iccm.io.run.job import make

from ..io.edit import test_page as editor
from ..web import test_page as demo
from . import drags
from .first_pins import SETS

ROOT = Path(__file__).parents[2]
MOVES_PER_SECOND = 60  # of a mouse
REST_PICTURES = 3  # of the map, while the hand rests before it releases: some 150 ms where nothing else runs
FOLLOWED = {  # whether the map of the last movement has been seen, and has reached the hand
    "editor": "iccm.seq[0] === iccm.seq[1] && !document.querySelectorAll('#target .handle.wrong').length",
    "demo": "iccmDemo.shown?.seq >= hand.sent && !iccmDemo.shown.figures.missed.length",
}
IDLE_SECONDS = 1.5  # after the page has come to rest: it may still compare maps
MOST_AFTER = 0.5  # per cent of the diagonal
MET_SHARE = 0.005  # of the diagonal: a pin this close to where it was released is there
SAMPLES = 400
FLOATS = 18
PATIENCE_SECONDS = 120.0
NEW_PIN_TRIES = 20
WITHOUT_GRAPHICS_CARD = ("--disable-gpu", "--enable-unsafe-swiftshader")  # as Chromium then does by itself
WATCH = """
const target = globalThis.iccm ? iccm.panes.target : iccmDemo.right, {painter} = target;
const source = globalThis.iccm ? iccm.panes.source : iccmDemo.left;
const hand = {panes: {source, target}, floats: null, released: null, isNew: false, maps: 0, sent: 0};
Object.assign(hand, {pictures: [], moves: []});
globalThis.hand = hand;
const map = painter.map.bind(painter), paint = target.paint.bind(target);
painter.map = (floats) => { hand.floats = floats; hand.isNew = true; hand.maps++; map(floats); };
target.paint = () => {
  paint();
  if (hand.isNew) hand.pictures.push(performance.now());
  hand.isNew = false;
};
addEventListener('pointermove', (event) => {
  if (!event.buttons) return;
  hand.moves.push(performance.now());
  if (globalThis.iccmDemo) hand.sent = iccmDemo.solver.next;
}, {capture: true});
addEventListener('pointerup', () => {
  hand.released = hand.floats;
  hand.dropped = PINS.map((pin) => ['source', 'target'].map((side) => hand.panes[side].page(pin[side])));
}, {capture: true});
"""  # code: keeps when pictures with a new map are painted, and which map and pins are seen at the release
TAKE = """
const name = arguments[0], bytes = new Uint8Array(hand[name].slice().buffer), parts = [];
for (let k = 0; k < bytes.length; k += 32768) parts.push(String.fromCharCode(...bytes.subarray(k, k + 32768)));
return btoa(parts.join(''));
"""
QUIET = {
    "editor": "!document.body.classList.contains('busy') && iccm.kind !== 'coarse' && iccm.seq[0] === iccm.seq[1]"
    " && Object.values(iccm.panes).every((pane) => !pane.waiting)",
    "demo": "!iccmDemo.solver.busy && !iccmDemo.right.waiting",
}
PINS = {"editor": "iccm.scene.pins", "demo": "iccmDemo.pinning.scene.pins"}


class Hand:
    """A hand on one of the pages, in which a pair is open."""

    def __init__(self, page: Any, kind: str) -> None:
        self.page, self.kind = page, kind
        page.driver.execute_script(WATCH.replace("PINS", PINS[kind]))

    def js(self, expression: str, *arguments: Any) -> Any:
        """Return the value of an expression."""
        return self.page.js(expression, *arguments)

    def rest(self, idle: float = IDLE_SECONDS, pictures: float = 1e9) -> None:
        """Wait until the page has done what it does, or has shown so many pictures and follows."""
        end = time.monotonic() + PATIENCE_SECONDS
        quiet_since = time.monotonic()
        while time.monotonic() - quiet_since < idle:
            if self.js(f"hand.maps >= arguments[0] && {FOLLOWED[self.kind]}", pictures):
                break
            if not self.js(f"Boolean({QUIET[self.kind]})"):
                quiet_since = time.monotonic()
            if time.monotonic() > end:
                raise TimeoutError(self.js("document.body.innerText"))
            time.sleep(0.05)

    def shape(self, side: str) -> Any:
        """Return a shape in page coordinates, as `drags.path_inside` takes it."""
        rings = self.js(f"[hand.panes.{side}.shape.outline, ...hand.panes.{side}.shape.holes]")
        outline, *holes = (np.array(ring) @ [1, 1j] for ring in rings)
        return SimpleNamespace(curve=Curve(outline), holes=holes, mappable_holes=range(len(holes)))

    def pins(self, side: str) -> list[complex]:
        """Return the places of all pins on a side, in page coordinates."""
        places = self.js(f"{PINS[self.kind]}.map((pin) => hand.panes.{side}.page(pin.{side}))")
        return [complex(*place) for place in places]

    def pixel(self, side: str, z: complex) -> list[int]:
        """Return the pixel of the window at a point of a side."""
        corner = f"hand.panes.{side}.element.getBoundingClientRect()"
        x, y = self.js(f"hand.panes.{side}.pixel(arguments[0])", [z.real, z.imag])
        left, top = self.js(f"[{corner}.left, {corner}.top]")
        return [round(left + x), round(top + y)]

    def floats(self, name: str = "floats") -> np.ndarray:
        """Return the triangles of the map that is seen, or was seen at the release."""
        data = base64.b64decode(self.page.driver.execute_script(TAKE, name))
        return np.frombuffer(data, np.float32).astype(float).reshape(-1, FLOATS)

    def place(self, z: complex) -> bool:
        """Place a pin at a point of the target; return whether there is one."""
        count, pixel = len(self.pins("target")), self.pixel("target", z)
        self.page.mouse("mousePressed", pixel, 1)
        self.page.mouse("mouseReleased", pixel)
        self.rest(0.3)
        return len(self.pins("target")) > count

    def drag(self, side: str, path: list[complex], *, holding: bool) -> None:
        """Press, move along a path with the frequency of a mouse, rest, and release."""
        pixels = [self.pixel(side, z) for z in path]
        self.js("(hand.pictures = [], hand.moves = [], hand.released = null)")
        actions = ActionBuilder(self.page.driver, duration=round(1000 / MOVES_PER_SECOND))
        pointer = actions.pointer_action
        pointer.move_to_location(*pixels[0])
        pointer.pointer_down(MouseButton.LEFT)
        for pixel in pixels[1:]:
            pointer.move_to_location(*pixel)
        actions.perform()
        self.js("(hand.maps = 0)")
        if holding:
            self.rest()
        else:
            self.rest(0.1, REST_PICTURES)
        actions = ActionBuilder(self.page.driver)
        actions.pointer_action.pointer_up(MouseButton.LEFT)
        actions.perform()
        self.rest()

    def pictures_per_second(self) -> float:
        """Return how many pictures a second were painted between the first and the last movement."""
        moves, pictures = self.js("[hand.moves, hand.pictures]")
        if len(moves) < 2:
            return 0.0
        seen = [at for at in pictures if moves[0] <= at <= moves[-1] + 1000 / MOVES_PER_SECOND]
        return len(seen) / (moves[-1] - moves[0] + 1e-9) * 1000


def displacement(before: np.ndarray, after: np.ndarray) -> float:
    """Return how far 95 % of the points move at most between two maps, in per cent of the target's diagonal."""
    chosen = before[np.unique(np.linspace(0, len(before) - 1, SAMPLES).astype(int))]
    images = chosen[:, 0:6].reshape(-1, 3, 2).mean(axis=1) @ [1, 1j]
    points = chosen[:, 6:12].reshape(-1, 3, 2).mean(axis=1) @ [1, 1j]
    a, b, c = (after[:, k : k + 2] @ [1, 1j] for k in (6, 8, 10))
    u, v, w = (after[:, k : k + 2] @ [1, 1j] for k in (0, 2, 4))

    def cross(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (np.conj(x) * y).imag

    area = cross(b - a, c - a)
    area[area == 0] = np.nan
    gaps = []
    for point, image in zip(points, images):
        second, third = cross(point - a, c - a) / area, cross(b - a, point - a) / area
        least = np.minimum(np.minimum(second, third), 1 - second - third)
        if not np.nanmax(least) > -1e-6:
            continue  # hidden now
        k = int(np.nanargmax(least))
        gaps.append(abs(u[k] + second[k] * (v[k] - u[k]) + third[k] * (w[k] - u[k]) - image))
    low, high = (bound(before[:, 0:6].reshape(-1, 2), axis=0) for bound in (np.min, np.max))
    return 100 * float(np.quantile(gaps, 0.95)) / float(np.hypot(*(high - low)))


def random_place(shape: Any, others: list[complex], rng: np.random.Generator) -> complex | None:
    """Return a random place inside a shape, away from its outlines and from other pins."""
    curve, holes = shape.curve, [Curve(hole) for hole in shape.holes]
    low, high = curve.box
    for _ in range(drags.TRIES):
        z = np.array([complex(rng.uniform(low.real, high.real), rng.uniform(low.imag, high.imag))])
        depth = min(float(outline.distances(z)[0]) for outline in (curve, *holes))
        apart = min((abs(z[0] - other) for other in others), default=np.inf)
        is_inside = curve.contains(z)[0] and not inside_any(holes, z)[0]
        if (
            is_inside
            and depth > drags.LEAST_DEPTH * curve.diagonal
            and apart > drags.LEAST_GAP * curve.diagonal
        ):
            return complex(z[0])
    return None


def random_path(shape: Any, places: list[complex], number: int, rng: np.random.Generator) -> np.ndarray:
    """Return the corners of a path of a pin inside the shape to a random place.

    Raises:
        LookupError: there is no room.
    """
    for _ in range(NEW_PIN_TRIES):
        goal = random_place(shape, places, rng)
        if goal is None:
            break
        with suppress(ValueError):  # beyond a passage that is too narrow
            return drags.path_inside(shape, places[number], goal, holed=True)
    raise LookupError


def drag_once(hand: Hand, rng: np.random.Generator, options: argparse.Namespace) -> tuple[bool, float, float]:
    """Drag a new or an earlier pin; return whether it was met, the displacement afterwards, and pictures a second.

    Raises:
        LookupError: there is no room.
    """
    pins = hand.pins("target")
    if not pins or rng.uniform() < drags.NEW_PIN_SHARE:
        for _ in range(NEW_PIN_TRIES):
            z = random_place(hand.shape("target"), pins, rng)
            if z is not None and hand.place(z):
                break
        else:
            if not pins:
                raise LookupError
    side = ("source", "target")[int(rng.integers(2))]
    places, shape = hand.pins(side), hand.shape(side)
    number = len(places) - 1 if len(places) > len(pins) else int(rng.integers(len(places)))
    corners = random_path(shape, places, number, rng)
    steps = round(options.seconds * MOVES_PER_SECOND)
    path = [complex(z) for z in drags.along(corners, np.arange(steps + 1) / steps)]
    hand.drag(side, path, holding=options.hold)
    dropped = complex(
        *hand.js(f"hand.dropped[{number}][{('source', 'target').index(side)}]")
    )  # it may have snapped
    away = abs(hand.pins(side)[number] - dropped) / shape.curve.diagonal
    is_met = away <= MET_SHARE  # pins that the picture cannot follow are put where it is
    if not is_met:
        said = hand.js("document.querySelector('[role=status]#status, #try-status')?.textContent")
        print(f"    pin {number + 1}, {side}, {100 * away:.1f} % away: {said}", flush=True)
    return is_met, displacement(hand.floats("released"), hand.floats()), hand.pictures_per_second()


# ---------------------------------------------------------------- the pages


@contextmanager
def edited(number: int, options: argparse.Namespace) -> Iterator[tuple[Hand, str]]:
    """Open a random pair in the editor."""
    choice = random.Random(f"{options.seed} {number}")
    names = choice.sample(sorted(drags.SETS), 2)
    part = "#silhouette" if number % 2 == 0 else ""
    while True:
        drawings = [drags.drawing(name, choice) for name in names]
        specs = [f"{drawing}{part}" for drawing in drawings]
        with suppress(InputError):
            session = Session(make(dict(zip(("source", "target"), specs))))
            if session.solve(session.scene).ok:
                break
    with tempfile.TemporaryDirectory() as folder:
        page = editor.Page(Path(folder), *specs)
        try:
            yield Hand(page, "editor"), " -> ".join(drawing.stem for drawing in drawings)
        finally:
            page.close()


@contextmanager
def tried(number: int, options: argparse.Namespace) -> Iterator[tuple[Hand, str]]:
    """Open a random pair in the demo."""
    choice = random.Random(f"{options.seed} {number}")
    names = choice.sample(sorted(drags.SETS), 2)
    with tempfile.TemporaryDirectory() as folder:
        files = ROOT / "build" / "web", ROOT / "build" / "wasm" / "core.wasm"
        subprocess.run(["node", ROOT / "web" / "bundle.js", folder, files[1]], check=True)
        (Path(folder) / "demo.html").write_text(demo.HTML)
        page = demo.Page(Path(folder))
        try:
            while True:
                drawings = [drags.drawing(name, choice) for name in names]
                with suppress(AssertionError, JavascriptException):
                    for menu, drawing in zip(("try-from", "try-into"), drawings):
                        page.upload(menu, drawing)
                        page.wait(
                            f"({demo.FULL}) || document.getElementById('try-status').classList.contains('try-wrong')"
                        )
                    if page.js(f"Boolean({demo.FULL})"):
                        break
            yield Hand(page, "demo"), " -> ".join(drawing.stem for drawing in drawings)
        finally:
            page.driver.quit()


def burn() -> None:
    """Use a core."""
    while True:
        pass


@contextmanager
def load(count: int) -> Iterator[None]:
    """Let other processes use a core each."""
    others = [multiprocessing.Process(target=burn, daemon=True) for _ in range(count)]
    for other in others:
        other.start()
    try:
        yield
    finally:
        for other in others:
            other.kill()


def main() -> None:
    """Print a line for each pair."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("page", choices=("demo", "editor"))
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--drags", type=int, default=8)
    parser.add_argument("--seed", type=int, default=82)
    parser.add_argument("--first", type=int, default=0, help="number of the first pair")
    parser.add_argument("--hold", action="store_true", help="hold each pin until nothing changes any more")
    parser.add_argument("--load", type=int, default=0, help="other processes that use a core each")
    parser.add_argument("--seconds", type=float, default=0.5, help="that a drag takes")
    options = parser.parse_args()
    drags.SETS |= SETS
    for pages in (editor, demo):
        kept = [flag for flag in pages.FLAGS if "angle" not in flag and "swiftshader" not in flag]
        pages.FLAGS = (*kept, *WITHOUT_GRAPHICS_CARD)
    way = "held" if options.hold else "quick"
    print(
        f"{f'{options.page}, {way}, seed {options.seed}, load {options.load}':52}      met  after          pictures"
    )
    rows: list[tuple[bool, float, float]] = []
    for number in range(options.first, options.pairs):
        rng = np.random.default_rng([options.seed, number])
        of_pair: list[tuple[bool, float, float]] = []
        opened = {"editor": edited, "demo": tried}[options.page](number, options)
        with opened as (hand, name), suppress(LookupError, WebDriverException), load(options.load):
            while len(of_pair) < options.drags:
                of_pair.append(drag_once(hand, rng, options))
        print(line(f"{number} {name}", of_pair), flush=True)
        rows += of_pair
    print(line("all", rows), f"  load average {os.getloadavg()[0]:.1f}")


def line(name: str, rows: list[tuple[bool, float, float]]) -> str:
    """Return a line of the table."""
    if not rows:
        return f"{name[:52]:52}  no room"
    met, after, pictures = (np.array(column) for column in zip(*rows))
    within = f"{(after <= MOST_AFTER).sum():3d}/{len(rows):2d}"
    return (
        f"{name[:52]:52}  {met.sum():3d}/{len(rows):2d}  {after.max():6.2f} {within}  "
        f"{np.median(pictures):4.0f} {pictures.min():4.0f}"
    )


if __name__ == "__main__":
    main()

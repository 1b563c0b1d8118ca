"""The page in a real, headless Chromium: pins are placed and dragged with the mouse, and it shows what `iccm map`
writes. Skipped, with a warning, without Chromium and ChromeDriver.
"""

import base64
import re
import shlex
import shutil
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

import cv2
import numpy as np
import pytest
from skimage.metrics import structural_similarity

from iccm.curve import Curve
from iccm.fits import FITS

webdriver = pytest.importorskip("selenium.webdriver", reason="NO BROWSER TESTS: selenium is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
SAMPLES = Path(__file__).parents[3] / "samples"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(400),
    pytest.mark.skipif(
        not (CHROMIUM and DRIVER), reason="NO BROWSER TESTS: install chromium and chromium-driver"
    ),
]
FLAGS = (
    *("--headless=new", "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--window-size=1400,800"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)  # WebGL without a graphics card, and no connections to the vendor
PATIENCE = 120
PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": False}
WEAK = "import iccm.balanced.interactive as live; live.STIFFEST = 1.0"  # code: springs cannot pull far


class Page:
    """A running `iccm edit` and a browser that shows it."""

    def __init__(self, folder, *arguments, before="", opened=True):
        """`before` is code that the server runs first; if `opened`, both sides and what is advanced are open."""
        command = [
            sys.executable,
            "-c",
            f"{before}\nfrom iccm.cli import main; main()",
            "edit",
            *arguments,
            "--no-browser",
        ]
        self.command, self.folder = command, folder
        self.start()
        options = webdriver.ChromeOptions()
        for flag in (*FLAGS, f"--user-data-dir={folder / 'profile'}"):
            options.add_argument(flag)
        options.binary_location = CHROMIUM
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        options.set_capability("unhandledPromptBehavior", "ignore")
        self.driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
        # Some versions give a page without a window no focus, and its elements no events of it.
        self.driver.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})
        self.driver.get(self.address)
        self.wait("globalThis.iccm || !document.getElementById('welcome').hidden")
        if arguments:
            if opened:
                self.js(
                    "(document.getElementById('both').click(), document.getElementById('advanced').open = true)"
                )
            self.settled()

    def start(self):
        """Start the server."""
        self.process = subprocess.Popen(self.command, cwd=self.folder, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()

    def close(self):
        self.driver.quit()
        self.process.kill()
        self.process.wait()

    def js(self, expression, *arguments):
        return self.driver.execute_script(f"return {expression}", *arguments)

    def wait(self, condition, seconds=PATIENCE):
        end = time.monotonic() + seconds
        while not self.js(f"Boolean({condition})"):
            assert time.monotonic() < end, f"{condition}: {self.js('document.body.innerText')}"
            time.sleep(0.05)

    def settled(self):
        """Return the kind of the converged map, once it is there and both halves are drawn: handles appear with the
        next frame.
        """
        still = "iccm.kind !== 'coarse' && iccm.seq[0] === iccm.seq[1]"
        drawn = "Object.values(iccm.panes).every((pane) => !pane.waiting)"
        self.wait(f"!document.body.classList.contains('busy') && {still} && {drawn}")
        return self.js("iccm.kind")

    @property
    def scene(self):
        return self.js("iccm.scene")

    def at(self, side, *place):
        """The window's pixel of a point in file units, in the plane or in space."""
        corner = "iccm.panes[arguments[0]].element.getBoundingClientRect()"
        page = "iccm.panes[arguments[0]].units.page(arguments[1])"
        px, py = self.js(f"iccm.panes[arguments[0]].pixel({page})", side, place)
        left, top = self.js(f"[{corner}.left, {corner}.top]", side)
        return left + px, top + py

    def mouse(self, kind, place, buttons=0, modifiers=0):
        event = {"type": kind, "x": place[0], "y": place[1], "buttons": buttons, "clickCount": 1}
        event["modifiers"] = modifiers
        event["button"] = "none" if kind == "mouseMoved" and not buttons else "left"
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def click(self, side, *place):
        count = len(self.scene["pins"])
        self.mouse("mousePressed", self.at(side, *place), 1)
        self.mouse("mouseReleased", self.at(side, *place))
        self.wait(f"iccm.scene.pins.length > {count}")
        return self.settled()

    def drag(self, side, start, end, steps=12, release=True):
        a, b = np.array(self.at(side, *start)), np.array(self.at(side, *end))
        self.mouse("mousePressed", a, 1)
        for k in range(1, steps + 1):
            self.mouse("mouseMoved", a + (b - a) * k / steps, 1)
            time.sleep(0.03)
        if release:
            self.mouse("mouseReleased", b)

    def key(self, key, **modifiers):
        code = {"ctrl": 2, "shift": 8}
        flags = sum(code[name] for name, on in modifiers.items() if on)
        for kind in ("rawKeyDown", "keyUp"):
            event = {
                "type": kind,
                "key": key,
                "modifiers": flags,
                "windowsVirtualKeyCode": {"Enter": 13}.get(key, ord(key[0].upper())),
            }
            self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", event)

    def screen(self, ratio, width=1400, height=660, scheme="light"):
        """Set another screen: device pixels per page pixel, and the size of the window."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": ratio, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        self.wait(f"innerWidth === {width} && devicePixelRatio === {ratio}")
        sides = "[c.width - devicePixelRatio * c.clientWidth, c.height - devicePixelRatio * c.clientHeight]"
        fits = f"{sides}.every((away) => Math.abs(away) <= 1)"
        self.wait(f"Object.values(iccm.panes).every(({{canvas: c}}) => {fits})", 20)
        self.wait("Object.values(iccm.panes).every((p) => !p.waiting)", 20)

    def picture(self, width, height):
        """The pixels that the target's canvas paints, with straight alpha."""
        address = self.js("iccm.panes.target.picture(arguments[0], arguments[1])", width, height)
        data = np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8)
        return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)


@pytest.fixture
def page(tmp_path):
    opened = []

    def start(sample, *arguments, **more):
        shutil.copytree(SAMPLES / sample, tmp_path, dirs_exist_ok=True)
        opened.append(Page(tmp_path, *arguments, **more))
        return opened[0]

    yield start
    for each in opened:
        mistakes = [line for line in each.driver.get_log("browser") if line["level"] == "SEVERE"]
        each.close()
        assert not mistakes


def over_white(pixels):
    alpha = pixels[..., 3:] / 255
    return (pixels[..., :3] * alpha + 255 * (1 - alpha)).mean(axis=2)


def similarity(page, path):
    written = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    shown = page.picture(written.shape[1], written.shape[0])
    return structural_similarity(over_white(shown), over_white(written), data_range=255)


def test_three_pins_a_drag_undo_a_stroke_save_and_the_same_picture(page, tmp_path, shell):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    for x, y in ((259, 156), (167, 340), (330, 300)):
        assert edited.click("source", x, y) == "full"
    start = edited.scene["pins"][0]["target"]
    end = [start[0] + 25, start[1] - 20]
    edited.drag("target", start, end, release=False)
    edited.wait("iccm.kind === 'coarse' && iccm.seq[1] > 5")
    edited.mouse("mouseReleased", edited.at("target", *end))
    assert edited.settled() == "full"
    moved = edited.scene["pins"][0]["target"]
    assert np.hypot(*np.subtract(moved, end)) < 0.5
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and edited.scene["pins"][0]["target"] == start
    edited.key("z", ctrl=True, shift=True)
    assert edited.settled() == "full" and edited.scene["pins"][0]["target"] == moved
    edited.key("s")
    edited.drag("source", (210, 380), (310, 385))
    edited.wait("iccm.scene.strokes.length === 1")
    assert edited.settled() == "full"
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    assert (tmp_path / "rose-leaf.json").exists()
    line = edited.js("document.getElementById('command').textContent")
    done = shell(f"cd {tmp_path} && {line} --size 500")
    assert done.returncode == 0, done.stderr
    assert similarity(edited, tmp_path / "rose-leaf.png") >= 0.98, similarity(
        edited, tmp_path / "rose-leaf.png"
    )


def test_the_patch_of_a_pin_is_shown_resized_and_made_exact(page, tmp_path, shell):
    edited = page("pins", "round.svg", "cat.svg", "--texture", "face.png")
    assert edited.js("document.querySelectorAll('#source .ring').length") == 4
    assert edited.js("document.getElementById('pin').hidden")
    edited.js("document.querySelector('#source .handle.pin').focus()")
    edited.wait("document.querySelectorAll('#source .ring.active').length === 1")
    field = "document.querySelector('#pin [name=radius]')"
    assert edited.js(f"{field}.value") == "" and "auto" in edited.js(f"{field}.placeholder")
    chosen = edited.js("iccm.panes.source.scene.patches[0].radius")
    edited.key("]")
    edited.wait("iccm.scene.pins[0].radius > 0")
    assert edited.settled() == "full"
    assert edited.scene["pins"][0]["radius"] == pytest.approx(1.1 * chosen, rel=1e-3)
    x, y = edited.scene["pins"][0]["source"]
    grown = edited.scene["pins"][0]["radius"]
    edited.drag("source", (x + grown, y), (x + 0.5 * chosen, y))
    assert edited.settled() == "full"
    dragged = edited.scene["pins"][0]["radius"]
    assert dragged == pytest.approx(0.5 * chosen, rel=0.1)
    enter = "(e => { e.value = arguments[0]; e.onchange(); })(document.querySelector('#pin [name=turn]'))"
    edited.js(enter, "1e9")
    assert "-360 to 360" in edited.js("document.getElementById('status').textContent")
    assert edited.scene["pins"][0]["turn"] is None and edited.settled() == "full"
    edited.js("document.querySelector('#source .handle.pin').focus()")
    edited.key("e")
    edited.wait("iccm.scene.pins[0].radius === 0")
    assert edited.settled() == "full"
    assert edited.js("document.querySelectorAll('#source .ring').length") == 3
    edited.js("document.querySelector('#pin [name=exact]').click()")  # a second click resets
    edited.wait("iccm.scene.pins[0].radius === null")
    assert edited.settled() == "full"
    edited.key("z", ctrl=True)
    edited.wait("iccm.scene.pins[0].radius === 0")
    assert edited.settled() == "full"
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    line = edited.js("document.getElementById('command').textContent")
    done = shell(f"cd {tmp_path} && {line} --size 500")
    assert done.returncode == 0, done.stderr
    assert similarity(edited, tmp_path / "round-cat.png") >= 0.98


def test_a_closed_stroke_is_a_rigid_region(page, tmp_path, shell):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.key("s")
    around = [(260 + 45 * np.cos(t), 250 + 45 * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 25)]
    ring = [edited.at("source", *place) for place in around]
    edited.mouse("mousePressed", ring[0], 1)
    for place in ring:
        edited.mouse("mouseMoved", place, 1)
    edited.mouse("mouseReleased", ring[-1])
    edited.wait("iccm.scene.rigid.length === 1")
    assert edited.settled() == "full" and not edited.scene["strokes"]
    for side in ("source", "target"):
        assert edited.js(f"document.querySelectorAll('#{side} .region').length") == 1
    assert edited.js("document.getElementById('figures').textContent").count("rigid 1") == 1
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    line = edited.js("document.getElementById('command').textContent")
    assert "--constraints rose-leaf.json" in line
    done = shell(f"cd {tmp_path} && {line} --size 500")
    assert done.returncode == 0, done.stderr
    assert similarity(edited, tmp_path / "rose-leaf.png") >= 0.98
    edited.driver.save_screenshot(str(tmp_path / "regions.png"))
    edited.js("document.querySelector('#list .region button:last-child').click()")
    edited.wait("iccm.scene.rigid.length === 0")
    assert edited.settled() == "full" and not edited.js("document.querySelectorAll('path.region').length")


def test_what_cannot_be_is_red_and_the_map_stays(page, tmp_path):
    edited = page("pins", "cat.svg", "round.svg", "--texture", "face.png")
    before = edited.picture(300, 300)
    assert [pin["name"] for pin in edited.scene["pins"]] == ["left-eye", "right-eye", "nose", "mouth"]
    typed = "(e => { e.value = '130, 120 -> 20, 20'; e.onchange(); })(document.querySelectorAll('#list input')[1])"
    edited.js(typed)
    edited.wait("document.body.classList.contains('bad')")
    edited.settled()
    assert "outside" in edited.js("document.getElementById('status').textContent")
    assert edited.js("document.querySelectorAll('#target .handle.wrong').length") == 1
    edited.key("z", ctrl=True)
    edited.wait("!document.body.classList.contains('bad')")
    assert edited.settled() == "full" and np.array_equal(edited.picture(300, 300), before)


def test_a_mesh_is_turned_pinned_on_its_surface_and_written_as_it_is_shown(
    page, tmp_path, shell, monkeypatch
):
    from iccm.io.shapes import mesh_reading
    from iccm.meshes import render
    from iccm.pixels.sampler import Sampler

    edited = page("face-pins", "tiger.svg", "face.obj", "--texture", "tiger.png")
    before = edited.js("iccm.panes.target.surface.axes")
    pane = edited.js(
        "(r => [r.left, r.top, r.width, r.height])(document.getElementById('target').getBoundingClientRect())"
    )
    edited.mouse("mousePressed", (pane[0] + 30, pane[1] + 300), 1)
    for k in range(1, 8):
        edited.mouse("mouseMoved", (pane[0] + 30 + 5 * k, pane[1] + 300 - 3 * k), 1)
    edited.mouse("mouseReleased", (pane[0] + 65, pane[1] + 279))
    axes = np.reshape(edited.js("iccm.panes.target.surface.axes"), (3, 3))
    assert np.abs(axes.ravel() - before).max() > 0.1 and np.allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    offered = "[...document.getElementById('format').options].filter((option) => !option.disabled)"
    formats = edited.js(f"{offered}.map((option) => option.value)")
    assert ".obj" in formats and ".png" not in formats  # a mesh is written
    for x, y in ((170, 200), (342, 200)):
        assert edited.click("source", x, y) == "full"
    assert edited.click("target", 0.0, -0.13, 1.1) == "full"
    start = edited.scene["pins"][0]["target"]
    edited.drag("target", start, (-0.42, 0.3, 0.6), release=False)
    edited.wait("iccm.kind === 'coarse' && iccm.seq[1] > 5")
    edited.mouse("mouseReleased", edited.at("target", -0.42, 0.3, 0.6))
    assert edited.settled() == "full"
    moved = edited.scene["pins"][0]["target"]
    assert moved != start and (isinstance(moved, str) or len(moved) == 3)
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    line = edited.js("document.getElementById('command').textContent")
    done = shell(f"cd {tmp_path} && {line}")
    assert done.returncode == 0, done.stderr
    written = mesh_reading.read(str(tmp_path / "tiger-face.obj"))
    image = mesh_reading.read_texture(written)
    height, width = image.pixels.shape[:2]
    patch, uv = written.flattening.patch, written.uv[written.uv_faces]
    texels = np.stack([uv[..., 0] * width, (1 - uv[..., 1]) * height], axis=-1)
    monkeypatch.setattr(render, "AMBIENT_SHARE", 1.0)
    seen = np.array(axes)
    seen[1] *= -1  # up
    sampler = Sampler(image.texture((0j, complex(width, height))))
    want = render.render(patch.points, patch.faces, texels, sampler, 602, seen)[
        1:-1, 1:-1
    ]  # without its margin
    shown = edited.picture(want.shape[1], want.shape[0])
    likeness = structural_similarity(over_white(shown), over_white(want[..., [2, 1, 0, 3]]), data_range=255)
    assert likeness >= 0.96, likeness


def contrast(page, selector):
    """The WCAG 2 contrast ratio between the text of an element and its background."""
    colours = page.js(
        """(() => {
          let e = document.querySelector(arguments[0]), text = getComputedStyle(e).color, ground;
          do { ground = getComputedStyle(e).backgroundColor; e = e.parentElement; }
          while (ground === 'rgba(0, 0, 0, 0)');
          return [text, ground].map((c) => c.match(/[\\d.]+/g).slice(0, 3).map(Number));
        })()""",
        selector,
    )
    linear = [[(v / 255 + 0.055) ** 2.4 / 1.055**2.4 if v > 10 else v / 3294 for v in c] for c in colours]
    light = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in linear]
    return (max(light) + 0.05) / (min(light) + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_fine_screens_other_windows_and_both_schemes(page, scheme):
    edited = page("pins", "round.svg", "cat.svg", "--texture", "face.png")
    edited.screen(2, scheme=scheme)
    for side in ("source", "target"):
        canvas = edited.js(
            f"(e => [e.width, e.clientWidth, e.height, e.clientHeight])(iccm.panes.{side}.canvas)"
        )
        assert canvas[0] == 2 * canvas[1] and canvas[2] == 2 * canvas[3]
    pin = edited.scene["pins"][0]["target"]
    x, y = edited.at("target", *pin)
    edited.mouse("mousePressed", (x + 6, y - 3), 1)  # on its boundary
    for k in range(1, 7):
        edited.mouse("mouseMoved", (x + 6 + 2 * k, y - 3), 1)
    edited.mouse("mouseReleased", (x + 18, y - 3))
    assert edited.settled() == "full"
    assert np.allclose(edited.at("target", *edited.scene["pins"][0]["target"]), (x + 12, y), atol=0.1)
    edited.screen(1.5, 1000, 560, scheme)
    box = edited.js("(r => [r.left + r.width / 2, r.top + r.height / 2])"
                    "(document.querySelector('#target .handle').getBoundingClientRect())")  # fmt: skip
    assert np.allclose(box, edited.at("target", *edited.scene["pins"][0]["target"]), atol=1)
    for selector in ("h1", "#status", ".hint", "#figures th", "#figures td", "#save", "#command", ".caption"):
        assert contrast(edited, selector) >= 4.5, selector
    edited.js("document.body.classList.add('bad')")
    assert contrast(edited, "#status") >= 4.5


def test_a_deep_view_is_as_sharp_as_a_large_picture(page, tmp_path, shell):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.js("document.getElementById('own').value = 0, document.getElementById('own').oninput()")
    edited.js("iccm.panes.target.zoomBy(12)")
    corners = edited.js(
        "(p => [[0, 0], [p.view.width, p.view.height]].map((c) => p.units.file(p.at(c))))(iccm.panes.target)"
    )
    address = edited.js("(p => { p.paint(); return p.canvas.toDataURL(); })(iccm.panes.target)")
    shown = cv2.imdecode(
        np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8), cv2.IMREAD_UNCHANGED
    )
    done = shell(
        f"cd {tmp_path} && iccm map rose.svg leaf.svg --texture petals.jpg --size 6000 -o large.png -q"
    )
    assert done.returncode == 0, done.stderr
    large = over_white(cv2.imread(str(tmp_path / "large.png"), cv2.IMREAD_UNCHANGED))
    box = edited.js("iccm.panes.target.shape.box")
    (left, top), (right, bottom) = (
        edited.js("iccm.panes.target.units.file(arguments[0])", box[k : k + 2]) for k in (0, 2)
    )
    scale = large.shape[1] / (right - left), large.shape[0] / (bottom - top)
    (a, b), (c, d) = [[(x - left) * scale[0], (y - top) * scale[1]] for x, y in corners]
    move = np.array([[(c - a) / shown.shape[1], 0, a - 0.5], [0, (d - b) / shown.shape[0], b - 0.5]])
    size = (shown.shape[1], shown.shape[0])
    want = cv2.warpAffine(large, move, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    likeness = structural_similarity(over_white(shown), want, data_range=255)
    assert likeness >= 0.95, likeness


@pytest.mark.parametrize("kind", ["touch", "pen"])
def test_strokes_are_drawn_by_finger_and_pen(page, kind):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('pen').click()")
    way = [edited.at("source", 200 + 10 * k, 380 + 8 * np.sin(k / 2)) for k in range(12)]
    if kind == "touch":
        edited.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    for k, (x, y) in enumerate(way):
        if kind == "touch":
            event = {"type": "touchMove" if k else "touchStart", "touchPoints": [{"x": x, "y": y}]}
            edited.driver.execute_cdp_cmd("Input.dispatchTouchEvent", event)
        else:
            event = {
                "type": "mouseMoved" if k else "mousePressed",
                "x": x,
                "y": y,
                "button": "left",
                "buttons": 1,
            }
            edited.driver.execute_cdp_cmd(
                "Input.dispatchMouseEvent", event | {"pointerType": "pen", "force": 0.5}
            )
    if kind == "touch":
        edited.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    else:
        event = {"type": "mouseReleased", "x": x, "y": y, "button": "left", "pointerType": "pen"}
        edited.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)
    edited.wait("iccm.scene.strokes.length === 1")
    assert edited.settled() == "full"
    drawn = edited.scene["strokes"][0]["source"]
    assert len(drawn) > 3 and abs(drawn[0][0] - 200) < 2 and abs(drawn[-1][0] - 310) < 2


def test_a_stroke_by_the_keyboard(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('source').focus()")
    edited.key("s")
    for key in ("p", "ArrowRight", "ArrowRight", "p", "ArrowDown", "p", "Enter"):
        edited.key(key)
    edited.wait("iccm.scene.strokes.length === 1")
    assert edited.settled() == "full" and len(edited.scene["strokes"][0]["source"]) == 3
    edited.key("z", ctrl=True)
    edited.wait("iccm.scene.strokes.length === 0")


def test_nothing_is_lost_when_the_page_is_loaded_again_or_the_server_dies(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    edited.click("source", 167, 340)
    pins = edited.scene["pins"]
    edited.driver.get(edited.address)
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full" and edited.scene["pins"] == pins
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and edited.scene["pins"] == pins[:1]
    address = edited.address
    edited.process.kill()
    edited.process.wait()
    edited.wait("document.body.classList.contains('ended')")
    edited.start()
    assert edited.address == address
    edited.wait("!document.body.classList.contains('ended')")
    assert edited.settled() == "full" and edited.scene["pins"] == pins[:1]
    edited.process.kill()
    edited.process.wait()
    edited.driver.get("about:blank")
    edited.driver.delete_all_cookies()
    edited.start()
    edited.driver.switch_to.new_window("tab")
    edited.driver.get(edited.address)
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full" and not edited.scene["pins"]
    banner = edited.js("document.getElementById('left-what').textContent")
    assert "1 pin " in banner and str(datetime.now().year) in banner
    edited.js("document.getElementById('go-on').click()")
    assert edited.settled() == "full" and edited.scene["pins"] == pins[:1]
    edited.driver.get_log("browser")  # the log contains that the server was away


OUT = """[...document.querySelectorAll('header button, header input, aside, #copy, #command, #list input, .caption')]
  .filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > innerWidth + 1)
  .map((e) => e.id || e.className)"""


def test_everything_is_within_the_window_however_long_names_are(page, tmp_path):
    long = "a-rose-" + "by-any-other-name-" * 8
    shutil.copy(SAMPLES / "rose-leaf" / "rose.svg", tmp_path / f"{long}.svg")
    edited = page(
        "rose-leaf", f"{long}.svg", "leaf.svg", "--texture", "petals.jpg", "--max-pixels", "90000000"
    )
    edited.click("source", 259, 156)
    edited.js("document.getElementById('both').click()")
    for width in (1400, 1024, 900, 768, 390):
        edited.screen(1, width, 700)
        assert edited.js("document.documentElement.scrollWidth <= innerWidth"), width
        for is_open in ("true", "false"):
            edited.js(f"document.getElementById('compare').open = {is_open}")
            assert edited.js(OUT) == [], (width, is_open)
        low, high = edited.js(
            "[target, document.querySelector('footer')].map((e) => e.getBoundingClientRect())"
            ".map((r) => [r.top, r.bottom])"
        )
        assert low[1] <= high[0] + 1 or high[1] <= low[0] + 1, width


def canvas(page, side):
    address = page.js(f"(p => {{ p.paint(); return p.canvas.toDataURL(); }})(iccm.panes.{side})")
    data = np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)


def test_the_drawings_themselves_are_seen(page, tmp_path):
    """At one end of the slider only the map is visible, at the other only the file's drawing, as the browser renders
    it.
    """
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    seen = []
    for share in (0, 0.5, 1):
        edited.js(f"document.getElementById('own').value = {share}, document.getElementById('own').oninput()")
        seen.append(canvas(edited, "target").astype(float))
    x, y = edited.js("iccm.panes.target.pixel([0, 0]).map(Math.round)")
    leaf = list(bytes.fromhex(re.search('fill="#([0-9a-f]{6})"', (tmp_path / "leaf.svg").read_text())[1]))
    assert np.abs(seen[2][y, x, 2::-1] - leaf).max() <= 2 and seen[2][y, x, 3] == 255
    assert np.abs(seen[0][y, x] - seen[2][y, x]).max() > 20
    assert np.abs(seen[1][y, x] - (seen[0][y, x] + seen[2][y, x]) / 2).max() <= 2


def test_the_drawing_blinks_until_it_is_told_to_stop(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.js("""(() => { window.shares = [];
      const {painter} = iccm.panes.target, draw = painter.draw.bind(painter);
      painter.draw = (view, overlay) => { shares.push(overlay.own); draw(view, overlay); }; })()""")
    edited.key("b")
    edited.wait("shares.join('').includes('101')")
    assert edited.js("document.getElementById('blink').getAttribute('aria-pressed')") == "true"
    edited.js("document.getElementById('blink').click()")
    edited.wait("shares.at(-1) === 0")
    count = edited.js("shares.length")
    time.sleep(2)
    assert edited.js("shares.length") == count


def test_the_loupe_shows_what_is_under_the_pin_larger(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.click("source", 259, 156)
    glass = "document.querySelector('#target .loupe').checkVisibility()"
    assert not edited.js(glass)
    x, y = edited.scene["pins"][0]["target"]
    edited.drag("target", (x, y), (x + 20, y + 15), release=False)
    assert edited.settled() == "full" and edited.js(glass)
    seen = canvas(edited, "target")
    left, top, side = edited.js(
        "['x', 'y', 'width'].map((name) => Number(document.querySelector('#target .loupe').getAttribute(name)))"
    )
    loupe = seen[round(top) : round(top + side), round(left) : round(left + side)]
    edited.mouse("mouseReleased", edited.at("target", x + 20, y + 15))
    edited.wait(f"!{glass}")
    assert edited.settled() == "full"
    edited.js("""((pane, [x, y]) => Object.assign(pane.view, {x, y, zoom: 4 * pane.view.zoom}))
      (iccm.panes.target, iccm.panes.target.page(iccm.scene.pins[0].target))""")
    near = canvas(edited, "target")
    begin = [round((length - side) / 2) for length in near.shape[:2]]
    want = near[begin[0] : begin[0] + round(side), begin[1] : begin[1] + round(side)]
    likeness = structural_similarity(over_white(loupe), over_white(want), data_range=255)
    assert likeness >= 0.95, likeness


def test_the_heat_of_stretch_is_that_of_the_map_as_the_legend_says(page, tmp_path):
    """A pixel's stretch by the map's own derivatives: no colour at 1, the last one from 4 times on."""
    from iccm.io.edit.messages import Scene
    from iccm.io.edit.session import Session
    from iccm.io.run.job import make

    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.js("document.getElementById('own').value = 0, document.getElementById('own').oninput()")
    cold, legend = canvas(edited, "target"), "document.getElementById('legend').checkVisibility()"
    assert not edited.js(legend)
    edited.key("h")
    edited.wait(legend)
    warm = canvas(edited, "target").astype(float)
    session = Session(make({"source": str(tmp_path / "rose.svg"), "target": str(tmp_path / "leaf.svg")}))
    session.solve(Scene())
    rng = np.random.default_rng(1)
    x, y = (rng.integers(length, size=4000) for length in cold.shape[1::-1])
    places = edited.js(
        "arguments[0].map((p) => iccm.panes.target.units.file(iccm.panes.target.at(p)))",
        (np.column_stack([x, y]) + 0.5).tolist(),
    )
    w = np.array([session.pair.target.at(tuple(place)) for place in places])
    inside = session.pair.target.curve.contains(w)
    _, p, q = session._map.inverse_jet(w[inside])
    mean = np.sqrt(session.pair.source.curve.area / session.pair.target.curve.area)
    most = np.maximum((abs(p) + abs(q)) / mean, mean / (abs(p) - abs(q)))
    heat = np.clip(np.log(most) / np.log(4), 0, 1)[:, None]
    assert np.ptp(heat) > 0.5
    hot = 255 * ((1 - heat) * [0.2, 0.85, 1] + heat * [0.15, 0, 0.65])
    near = np.clip(heat / 0.35, 0, 1)
    share = 0.85 * near**2 * (3 - 2 * near)
    before, after = (picture[y[inside], x[inside], :3] for picture in (cold, warm))
    wrong = np.abs((1 - share) * before + share * hot - after).max(axis=1)
    assert np.nanquantile(wrong, 0.9) <= 4, np.nanquantile(wrong, [0.5, 0.9, 0.95])


def test_the_panes_stay_where_they_are_whatever_is_told(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    places = "['source', 'target'].map((id) => document.getElementById(id).getBoundingClientRect().toJSON())"
    for width in (1400, 1024):
        edited.screen(1, width)
        before = edited.js(places)
        edited.js("""(() => {
          document.getElementById('other').hidden = false;
          document.getElementById('other').textContent = 'Back to the continued map';
          document.getElementById('status').textContent = 'It is told at length. '.repeat(40);
          document.body.classList.add('bad', 'busy', 'dirty'); })()""")
        assert edited.js(places) == before, width
        edited.js("document.getElementById('other').hidden = true")
        edited.js("document.body.classList.remove('bad', 'busy', 'dirty')")


def test_copy_says_what_must_be_saved_before(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    allowed = {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]}
    edited.driver.execute_cdp_cmd("Browser.grantPermissions", allowed)
    edited.click("source", 259, 156)
    said = "document.getElementById('status').textContent"
    edited.js("document.getElementById('copy').click()")
    edited.wait(f"{said}.startsWith('Copied')")
    assert "save first" in edited.js(said)
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    edited.js("document.getElementById('copy').click()")
    edited.wait(f"{said} === 'Copied.'")
    edited.driver.set_script_timeout(PATIENCE)
    copied = edited.driver.execute_async_script("navigator.clipboard.readText().then(arguments[0])")
    assert copied == edited.js("document.getElementById('command').textContent")
    assert (edited.folder / copied.partition("--constraints ")[2].split()[0]).exists()


def test_what_is_drawn_or_dragged_too_far_stays_in_reach(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('pen').click()")
    edited.drag("source", (256, 256), (256, -200))
    edited.wait("iccm.scene.strokes.length === 1")
    assert edited.settled() == "full"
    assert np.hypot(*np.subtract(edited.scene["strokes"][0]["source"][0], (256, 256))) < 4
    edited.key("z", ctrl=True)
    edited.settled()
    edited.click("source", 259, 156)
    edited.drag("target", edited.scene["pins"][0]["target"], (259, -3000), steps=60)  # some within the window
    assert edited.settled() == "full" and not edited.js("document.body.classList.contains('bad')")
    pin = edited.scene["pins"][0]["target"]
    ring = "iccm.panes.target.shape.outline.map((p) => iccm.panes.target.units.file(p))"
    outline = Curve(np.array(edited.js(ring)) @ [1, 1j])
    place = np.array([complex(*pin)])
    assert outline.contains(place)[0] and outline.distances(place)[0] < 0.1 * outline.diagonal
    low, high = edited.js(
        "[document.querySelector('#target .handle'), target].map((e) => e.getBoundingClientRect().bottom)"
    )
    top = edited.js("target.getBoundingClientRect().top")
    assert top < low < high
    edited.js("document.querySelector('#target .handle').focus()")
    edited.key("Delete")
    edited.wait("iccm.scene.pins.length === 0")
    edited.wait("document.activeElement === target")


def test_places_are_typed_and_two_states_compared(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    before = edited.scene
    edited.key("a")
    typed = "(e => { e.value = '250, 150 -> 255, 140.5'; e.onchange(); })(document.querySelectorAll('#list input')[1])"
    edited.js(typed)
    edited.js("document.querySelectorAll(`[data-balance]`)[2].click()")
    assert edited.settled() == "full"
    after = edited.scene
    assert after["balance"] == 3
    assert (after["pins"][0]["source"], after["pins"][0]["target"]) == ([250, 150], [255, 140.5])
    steps = "document.querySelectorAll('#past li').length"
    count = edited.js(steps)
    for wanted in (before, after, before, after):
        edited.key("a")
        assert edited.settled() == "full" and edited.scene == wanted and edited.js(steps) == count
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and not edited.js("document.getElementById('redo').disabled")
    edited.key("a")
    assert edited.settled() == "full" and not edited.js("document.getElementById('redo').disabled")
    edited.key("z", ctrl=True, shift=True)
    assert edited.settled() == "full" and edited.scene == after
    edited.js("document.querySelector('[data-fit=cover]').click()")
    assert edited.settled() == "full" and edited.scene["fit"] == "cover"


def test_presets_change_a_pin_and_words_are_not_taken_as_numbers(page):
    edited = page("pins", "round.svg", "cat.svg")
    edited.js("document.querySelector('#source .handle.pin').focus()")
    edited.wait("!document.getElementById('pin').hidden")
    chosen_radius = edited.js("iccm.panes.source.scene.patches[0].radius")
    for preset, holds in (
        ("pull", f"iccm.scene.pins[0].radius < {chosen_radius} && iccm.scene.pins[0].tolerance > 0"),
        ("exact", "iccm.scene.pins[0].radius === 0"),
        ("exact", "iccm.scene.pins[0].radius === null && iccm.scene.pins[0].tolerance === null"),
    ):
        edited.driver.find_element("css selector", f"#pin [name={preset}]").click()
        edited.wait(holds, 20)
        assert edited.settled() == "full"
    for is_kept in (True, False):
        edited.driver.find_element("css selector", "#pin [name=keep]").click()
        edited.wait(f"iccm.scene.rigid.length === {int(is_kept)}", 20)
        assert edited.settled() == "full"
        pressed = "document.querySelector('#pin [name=keep]').getAttribute('aria-pressed')"
        assert edited.js(pressed) == str(is_kept).lower()
        regions = edited.js("iccm.panes.source.scene.regions")
        assert [region["dilatation"] < 1.001 for region in regions] == [True] * is_kept
    pins = edited.scene["pins"]
    place = edited.driver.find_elements("css selector", "#list li:first-child input")[1]
    digits = [number.partition(".")[2] for number in re.findall(r"[\d.]+", place.get_attribute("value"))]
    assert len(digits) == 4 and max(map(len, digits)) <= 2  # what a screen can place
    place.send_keys(webdriver.Keys.CONTROL, "a", webdriver.Keys.NULL, "abc", webdriver.Keys.ENTER)
    edited.wait("document.body.classList.contains('bad')")
    assert edited.scene["pins"] == pins


def test_pins_are_suggested_selected_locked_and_undone_from_a_list(page, tmp_path):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('suggest').click()")
    edited.wait("document.querySelector('#source .ghost')")
    edited.js("document.querySelector('#source .ghost').click()")
    edited.wait("iccm.scene.pins.length === 1")
    assert edited.settled() == "full"
    edited.js("document.getElementById('dismiss').click()")
    edited.wait("!document.querySelector('.ghost')")
    for place in ((259, 156), (167, 340)):
        assert edited.click("source", *place) == "full"
    before = [pin["target"] for pin in edited.scene["pins"]]
    for place in before[1:]:
        for kind in ("mousePressed", "mouseReleased"):
            edited.mouse(kind, edited.at("target", *place), 1, modifiers=8)
    edited.wait("document.querySelectorAll('#target .handle[aria-pressed=true]').length === 2")
    x, y = before[1]
    edited.drag("target", (x, y), (x + 10, y + 12))
    assert edited.settled() == "full"
    moved = np.subtract([pin["target"] for pin in edited.scene["pins"]], before)
    assert np.allclose(moved, [[0, 0], [10, 12], [10, 12]], atol=0.1)
    edited.js("document.querySelector('#target .handle:last-child').focus()")
    edited.key("l")
    edited.wait("document.querySelector('#target .handle.locked')")
    x, y = edited.scene["pins"][2]["target"]
    edited.drag("target", (x, y), (x + 30, y), steps=4)
    assert edited.settled() == "full" and edited.scene["pins"][2]["target"] == [x, y]
    assert edited.js("document.querySelector('#past button').textContent") == "2 pins moved"
    edited.js("document.querySelectorAll('#past button')[1].click()")
    assert edited.settled() == "full"
    assert [pin["target"] for pin in edited.scene["pins"]] == before
    edited.js("document.getElementById('more').click()")
    edited.js(
        "document.getElementById('format').value = '.jpg', document.getElementById('format').onchange()"
    )
    ending = "--size 1024 --constraints rose-leaf.json -o rose-leaf.jpg"
    edited.wait(f"document.getElementById('export-command').textContent.endsWith('{ending}')")


def test_handles_are_added_in_one_step_without_changing_the_picture(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    seen = edited.picture(200, 200)
    edited.js("document.getElementById('handles-show').click()")
    edited.js("document.getElementById('handle-rows').value = 3")
    edited.js("document.getElementById('handles-add').click()")
    edited.wait("iccm.scene.pins.length > 0")
    assert edited.settled() == "full" and 6 <= len(edited.scene["pins"]) <= 12
    assert np.array_equal(edited.picture(200, 200), seen)
    names = [pin["name"] for pin in edited.scene["pins"]]
    handle = edited.scene["pins"][names.index("r2c2")]
    (x, y), others = handle["target"], [pin["target"] for pin in edited.scene["pins"] if pin != handle]
    edited.drag("target", (x, y), (x + 15, y + 5))
    assert edited.settled() == "full"
    assert not np.array_equal(edited.picture(200, 200), seen)
    assert [pin["target"] for pin in edited.scene["pins"] if pin["name"] != "r2c2"] == others
    for count in (len(names), 0):
        edited.js("document.getElementById('undo').click()")
        assert edited.settled() == "full" and len(edited.scene["pins"]) == count
    assert np.array_equal(edited.picture(200, 200), seen)


def test_mirror_images_and_corners_attract_and_only_what_changes_is_painted(page):
    edited = page("pins", "cat.svg", "round.svg", "--texture", "face.png")
    edited.drag("target", edited.scene["pins"][0]["target"], (165, 235))
    assert edited.settled() == "full"
    (left, top), (x, y) = (pin["target"] for pin in edited.scene["pins"][:2])
    axis = edited.js("iccm.panes.target.units.file([iccm.panes.target.shape.axis, 0])")[0]
    share = "iccm.panes.target.canvas.width / iccm.panes.target.canvas.clientWidth"
    edited.js(f"""(() => {{ window.painted = {{source: 0, target: 0, share: 1}};
      for (const [side, {{painter}}] of Object.entries(iccm.panes)) {{
        const draw = painter.draw.bind(painter);
        painter.draw = (...how) => {{
          painted[side] += 1;
          if (iccm.kind === 'coarse') painted.share = {share};
          draw(...how);
        }};
      }} }})()""")
    edited.drag("target", (x, y), (2 * axis - left + 1, top + 1), release=False)
    edited.wait("painted.share < 1 && document.querySelector('#target .guide')")
    assert edited.js("painted.target") > 0 and edited.js("painted.source") == 0
    # there is no graphics card here; a busy machine paints even fewer pixels
    painted = edited.js("painted.share")
    assert painted == pytest.approx(0.5, abs=0.01) or painted == pytest.approx(0.25, abs=0.01)
    edited.mouse("mouseReleased", edited.at("target", 2 * axis - left + 1, top + 1))
    assert edited.settled() == "full" and edited.js(share) == 1
    assert np.allclose(edited.scene["pins"][1]["target"], [2 * axis - left, top], atol=1e-4)
    corner = edited.js("iccm.panes.source.units.file(iccm.panes.source.shape.corners[0])")
    px, py = edited.at("source", *corner)
    edited.mouse("mousePressed", (px + 2, py + 3), 1)
    edited.mouse("mouseReleased", (px + 2, py + 3))
    edited.wait("iccm.scene.pins.length === 5")
    assert np.allclose(edited.scene["pins"][4]["source"], corner, atol=1e-4)
    edited.settled()


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    """The automated accessibility rules of axe-core, fetched from npm."""
    folder = tmp_path_factory.mktemp("axe")
    try:
        subprocess.run(["npm", "pack", "axe-core@4"], cwd=folder, check=True, timeout=60, capture_output=True)
    except (OSError, subprocess.SubprocessError) as error:
        pytest.skip(f"NO TESTS OF ACCESSIBILITY: axe-core cannot be fetched from npm ({error})")
    shutil.unpack_archive(next(folder.glob("*.tgz")), folder)
    return (folder / "package" / "axe.min.js").read_text(encoding="utf-8")


FINDINGS = """const done = arguments[0];
  axe.run({runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice']})
    .then(({violations}) => done(violations.map(({id, nodes}) => `${id}: ${nodes[0].html}`)))"""


def test_axe_finds_nothing_at_any_width(page, axe):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    edited.js("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    edited.js("document.getElementById('suggest').click()")
    edited.wait("document.querySelector('#source .ghost')")
    edited.driver.set_script_timeout(PATIENCE)
    edited.driver.execute_script(axe)
    for width in (1400, 1024, 900, 768, 390):
        for scheme in ("light", "dark"):
            edited.screen(1, width, 700, scheme)
            assert edited.driver.execute_async_script(FINDINGS) == [], (width, scheme)
    for scheme in ("light", "dark"):
        edited.screen(1, 1400, 700, scheme)
        for dialog in ("export", "keys", "lasso", "fits", "handles"):
            edited.js(f"document.getElementById('{dialog}').showModal()")
            assert edited.driver.execute_async_script(FINDINGS) == [], (dialog, scheme)
            edited.js(f"document.getElementById('{dialog}').close()")
        edited.js("document.getElementById('choose').click()")
        edited.wait("document.querySelector('#samples button')")
        assert edited.driver.execute_async_script(FINDINGS) == [], ("files", scheme)
        edited.js("document.getElementById('files').close()")
        edited.js("document.getElementById('tour-again').click()")
        assert edited.driver.execute_async_script(FINDINGS) == [], ("tour", scheme)
        edited.js("document.getElementById('tour-end').click()")


def test_axe_finds_nothing_where_pins_turn(page, axe):
    edited = page("limbs", "gingerbread.svg", "--texture", "icing.png")
    edited.click("source", 256, 110)
    edited.wait("document.querySelector('.handle.turn')")
    edited.driver.set_script_timeout(PATIENCE)
    edited.driver.execute_script(axe)
    for scheme in ("light", "dark"):
        edited.screen(1, 1400, 700, scheme)
        assert edited.driver.execute_async_script(FINDINGS) == [], scheme


def test_closing_with_changes_asks_first(page):
    """Whether the page asks for confirmation: ChromeDriver answers such questions itself."""
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    asks = "(e => !dispatchEvent(e))(new Event('beforeunload', {cancelable: true}))"
    assert not edited.js(asks)
    edited.click("source", 259, 156)
    assert edited.js(asks)
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    assert not edited.js(asks)


def test_the_keyboard_does_it_all_and_the_server_ends_with_the_page(page, tmp_path):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('source').focus()")
    edited.key("p")
    edited.wait("iccm.scene.pins.length === 1")
    edited.settled()
    edited.wait("document.querySelector('#target .handle')")
    edited.js("document.querySelector('#target .handle').focus()")
    before = edited.scene["pins"][0]
    edited.key("ArrowRight")
    edited.wait(f"iccm.scene.pins[0].target[0] > {before['target'][0]}")
    assert edited.settled() == "full" and edited.scene["pins"][0]["source"] == before["source"]
    edited.js("document.querySelector('#target .handle').focus()")
    edited.key("Delete")
    edited.wait("iccm.scene.pins.length === 0")
    assert edited.settled() == "full"
    edited.driver.get("about:blank")
    assert edited.process.wait(timeout=60) == 0


def chosen(page, role, *files):
    """Choose files in the dialog, once it is open."""
    page.wait("document.querySelector('#files[open]')")
    page.driver.find_element("css selector", f"[data-role={role}] input").send_keys(
        "\n".join(map(str, files))
    )
    page.wait(f"document.querySelector('[data-role={role}] .name').textContent.includes({files[0].name!r})")


TWO = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M5 5H60V60H5Z"/>{}</svg>'


def test_files_are_chosen_on_the_page_and_parts_by_their_pictures(page, tmp_path):
    """From an empty page to a map; then another part, another texture, and one of the samples."""
    edited = page("rose-leaf")
    edited.js("document.getElementById('welcome-files').click()")
    edited.wait("document.querySelector('#files[open]')")
    away = tmp_path / "elsewhere"
    away.mkdir()
    (away / "two.svg").write_text(TWO.format('<circle id="dot" cx="80" cy="80" r="15"/>'))
    chosen(edited, "source", away / "two.svg")
    chosen(edited, "target", tmp_path / "leaf.svg")
    edited.js("document.getElementById('files-open').click()")
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full"
    line = edited.js("document.getElementById('command').textContent")
    assert re.search(r"iccm map \S+/two.svg leaf.svg ", line)  # a file in this folder keeps its name
    edited.js("document.getElementById('choose').click()")
    edited.wait("document.querySelectorAll('[data-role=source] .parts button').length === 4")
    names = "[...document.querySelectorAll('[data-role=source] .parts button')].map((e) => e.title)"
    assert [title.split(",")[0] for title in edited.js(names)] == ["all", "part 1", "dot", "silhouette"]
    edited.js("document.querySelectorAll('[data-role=source] .parts button')[2].click()")
    edited.js("document.getElementById('files-open').click()")
    edited.wait(
        "!document.querySelector('#files[open]') && globalThis.iccm?.panes.source.shape.name.endsWith('#2')"
    )
    edited.settled()
    edited.click("source", 80, 80)
    pins = edited.scene["pins"]
    edited.js("document.getElementById('choose').click()")
    chosen(edited, "texture", tmp_path / "petals.jpg")
    edited.js("document.getElementById('files-open').click()")
    edited.wait("!document.querySelector('#files[open]')")
    edited.wait("document.getElementById('command')?.textContent.includes('petals.jpg')")
    assert edited.settled() == "full" and edited.scene["pins"] == pins
    edited.js("document.getElementById('choose').click()")
    edited.wait("document.querySelector('#samples button')")
    edited.js("document.querySelector('#samples button').click()")
    edited.wait("globalThis.iccm?.panes.target.shape.name.endsWith('cat.svg')")
    assert edited.settled() == "full"


def test_files_are_dropped_on_the_page_and_wrong_ones_told(page, tmp_path):
    edited = page("rose-leaf")
    drop = """((names) => { const data = new DataTransfer();
      for (const [name, text] of names) data.items.add(new File([text], name));
      document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true})); })(arguments[0])"""
    edited.js(drop, [["broken.svg", "<svg"]])
    edited.wait("document.getElementById('files-said').textContent.includes('broken.svg')")
    edited.js(drop, [[name, (tmp_path / name).read_text()] for name in ("rose.svg", "leaf.svg")])
    edited.wait("document.querySelector('[data-role=target] .name').textContent === 'leaf.svg'")
    edited.js("document.getElementById('files-open').click()")
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full" and edited.js("iccm.panes.source.shape.name") == "rose.svg"


def test_what_is_held_still_settles_and_nothing_moves_when_it_is_let_go_of(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    (x, y), history = edited.scene["pins"][0]["target"], "document.getElementById('undo').disabled"
    edited.drag("target", (x, y), (x + 20, y), release=False)
    assert edited.settled() == "full"
    seen, number = edited.picture(200, 200), edited.js("iccm.seq[1]")
    edited.mouse("mouseReleased", edited.at("target", x + 20, y))
    edited.wait(f"iccm.seq[1] > {number}")
    assert edited.settled() == "full" and np.array_equal(edited.picture(200, 200), seen)
    edited.key("z", ctrl=True)
    assert (
        edited.settled() == "full" and edited.scene["pins"][0]["target"] == [x, y] and not edited.js(history)
    )


def test_a_better_map_is_shown_while_a_pin_is_held_and_is_what_is_released(page):
    better = "import iccm.io.edit.session as edit; edit.NOTABLE_COST_RATIO, edit.same = 0, lambda *_: False"
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg", before=better)
    other = "document.getElementById('other')"
    edited.click("source", 259, 156)
    x, y = edited.scene["pins"][0]["target"]
    edited.drag("target", (x, y), (x + 40, y - 25), release=False)
    edited.wait(f"!{other}.hidden && {other}.dataset.way === 'kept'")
    assert edited.settled() == "full"
    held, number = edited.picture(200, 200), edited.js("iccm.seq[1]")
    edited.mouse("mouseReleased", edited.at("target", x + 40, y - 25))
    edited.wait(f"iccm.seq[1] > {number}")
    assert edited.settled() == "full" and np.array_equal(edited.picture(200, 200), held)
    assert np.allclose(edited.scene["pins"][0]["target"], (x + 40, y - 25), atol=1)
    edited.js(f"{other}.click()")
    edited.wait(f"{other}.dataset.way === 'fresh'")
    edited.settled()
    kept = edited.picture(200, 200)
    assert not np.array_equal(kept, held)
    edited.js(f"{other}.click()")
    edited.wait(f"{other}.dataset.way === 'kept'")
    edited.settled()
    assert np.array_equal(edited.picture(200, 200), held)
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and np.allclose(edited.scene["pins"][0]["target"], (x, y), atol=1)
    edited.key("y", ctrl=True)
    assert edited.settled() == "full" and np.array_equal(edited.picture(200, 200), held)


def test_a_pin_that_the_picture_cannot_follow_is_reached_while_it_is_held(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg", before=WEAK)
    edited.click("source", 259, 156)
    field = "document.querySelector('#pin [name=tolerance]')"
    edited.js(f"[{field}.value = '2', {field}.dispatchEvent(new Event('change'))]")
    edited.settled()
    x, y = edited.scene["pins"][0]["target"]
    edited.drag("target", (x, y), (x + 90, y), release=False)
    named = "document.getElementById('status').textContent.includes('pin 1')"
    edited.wait(f"iccm.kind === 'full' && {named}")
    edited.settled()
    held, number = edited.picture(200, 200), edited.js("iccm.seq[1]")
    edited.mouse("mouseReleased", edited.at("target", x + 90, y))
    edited.wait(f"iccm.seq[1] > {number}")
    assert edited.settled() == "full" and np.array_equal(edited.picture(200, 200), held)
    assert np.allclose(edited.scene["pins"][0]["target"], (x + 90, y), atol=1)
    assert edited.js("document.getElementById('search').hidden")
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and np.allclose(edited.scene["pins"][0]["target"], (x, y), atol=1)


def test_a_pin_that_the_picture_cannot_follow_stops_short_until_its_place_is_searched_for(page):
    unsearched = (
        "import iccm.io.edit.session as edit; edit.Session._reach = lambda *_: None"  # while it is held
    )
    edited = page(
        "rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg", before=f"{WEAK}; {unsearched}"
    )
    search = "document.getElementById('search')"
    edited.click("source", 259, 156)
    begun = edited.scene["pins"][0]
    field = "document.querySelector('#pin [name=tolerance]')"
    edited.js(f"[{field}.value = '2', {field}.dispatchEvent(new Event('change'))]")
    edited.settled()
    x, y = begun["target"]
    edited.drag("target", (x, y), (x + 90, y), release=False)
    edited.wait("iccm.kind === 'blocked'")
    assert "pin 1" in edited.js("document.getElementById('status').textContent")
    seen = edited.picture(200, 200)
    edited.mouse("mouseReleased", edited.at("target", x + 90, y))
    edited.wait(f"!{search}.hidden")
    assert edited.settled() == "full"
    before, seen = seen.astype(int), edited.picture(200, 200)
    assert np.abs(before - seen).mean() < 1  # maps that are kept are rounded
    stopped = edited.scene["pins"][0]["target"]
    assert x + 5 < stopped[0] < x + 89.5
    label = edited.js("document.querySelector('#target .handle.pin').getAttribute('aria-label')")
    assert "stopped short" in label
    edited.wait("!document.getElementById('other').hidden")  # a map from scratch has been compared
    assert "pin 1" in edited.js("document.getElementById('status').textContent")
    edited.js(f"{search}.click()")
    edited.wait(f"{search}.hidden")
    assert edited.settled() == "full"
    assert np.allclose(edited.scene["pins"][0]["target"], (x + 90, y), atol=1)
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and edited.scene["pins"][0]["target"] == stopped
    assert np.array_equal(edited.picture(200, 200), seen) and not edited.js(f"{search}.hidden")
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and np.allclose(edited.scene["pins"][0]["target"], (x, y), atol=1)


def test_a_pin_that_cannot_be_met_is_put_where_the_picture_is_with_one_click(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    yield_button = "document.getElementById('yield')"
    for place in ((259, 156), (230, 190)):
        edited.click("source", *place)
        edited.settled()
    first, second = edited.scene["pins"]
    seen = edited.picture(200, 200).astype(int)
    assert edited.js(f"{yield_button}.hidden")
    field = edited.driver.find_elements("css selector", "#list li:nth-child(2) input")[1]
    twice = "{}, {} -> {}, {}".format(*first["source"], *second["target"])  # one point to two places
    field.send_keys(webdriver.Keys.CONTROL, "a", webdriver.Keys.NULL, twice, webdriver.Keys.ENTER)
    edited.wait(f"!{yield_button}.hidden")
    assert edited.js("iccm.kind") == "error"
    edited.js(f"{yield_button}.click()")
    edited.wait(f"{yield_button}.hidden")
    assert edited.settled() == "full"
    (pin,) = edited.scene["pins"]  # the second one is the same now
    assert pin["source"] == first["source"] and np.allclose(pin["target"], first["target"], atol=1)
    assert np.abs(edited.picture(200, 200) - seen).mean() < 1
    edited.key("z", ctrl=True)
    edited.wait(f"!{yield_button}.hidden")


def test_without_a_target_pins_deform_the_shape_as_the_command_does(page, tmp_path, shell):
    edited = page("limbs", "gingerbread.svg", "--texture", "icing.png")
    for x, y in ((256, 256), (256, 110)):
        edited.click("source", x, y)
    begun = edited.js("iccm.panes.target.shape.outline")
    edited.drag("target", (256, 110), (330, 120))
    assert edited.settled() == "full"
    moved = np.abs(np.ptp(edited.js("iccm.panes.target.shape.outline"), axis=0) - np.ptp(begun, axis=0))
    assert moved.max() > 0.01 and np.allclose(edited.scene["pins"][1]["target"], [330, 120], atol=2)
    edited.key("s", ctrl=True)
    edited.wait("document.getElementById('status').textContent.includes('Saved gingerbread-deformed.json')")
    line = edited.js("document.getElementById('command').textContent")
    assert line.startswith("iccm deform gingerbread.svg ")
    done = shell(f"{line} --size 400", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert similarity(edited, tmp_path / "gingerbread-deformed.png") > 0.97


def test_without_a_target_pins_turn_the_shape_by_hand_and_keys(page):
    edited = page("limbs", "gingerbread.svg", "--texture", "icing.png")
    for x, y in ((256, 256), (256, 110)):
        edited.click("source", x, y)
    assert edited.js("document.querySelectorAll('.handle.turn').length") == 2
    before = edited.picture(300, 300)
    ring = "document.querySelectorAll('#target .handle.turn')[1]"
    box = f"(r => [r.left + r.width / 2, r.top + r.height / 2])({ring}.getBoundingClientRect())"
    begin, pin = np.array(edited.js(box)), np.array(edited.at("target", 256, 110))
    arm = np.hypot(*(begin - pin))
    edited.mouse("mousePressed", begin, 1)
    for angle in np.radians(np.linspace(5, 30, 6)):  # to the left, which is counter-clockwise
        edited.mouse("mouseMoved", pin - arm * np.array([np.sin(angle), np.cos(angle)]), 1)
        time.sleep(0.03)
    edited.mouse("mouseReleased", edited.js(box))
    assert edited.settled() == "full"
    assert edited.scene["pins"][1]["turn"] == pytest.approx(30, abs=1)
    assert edited.js("document.querySelector('#past button').textContent") == "pin 2 rotated"
    assert not np.array_equal(edited.picture(300, 300), before)
    edited.js(f"{ring}.focus()")
    edited.key("ArrowRight")
    edited.wait("iccm.scene.pins[1].turn < 26")
    assert edited.settled() == "full"
    edited.js(f"{ring}.focus()")
    edited.key("Delete")
    edited.wait("iccm.scene.pins[1].turn === null")
    assert edited.settled() == "full"


def test_undo_outlasts_a_new_load_whichever_side_was_clicked(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("target", 259, 156)
    edited.js("document.getElementById('pen').click()")
    edited.drag("source", (210, 380), (310, 385))
    edited.wait("iccm.scene.strokes.length === 1")
    edited.settled()
    edited.driver.get(edited.address)
    edited.wait("globalThis.iccm")
    edited.settled()
    for strokes, pins in ((0, 1), (0, 0)):
        edited.key("z", ctrl=True)
        edited.wait(f"iccm.scene.strokes.length === {strokes} && iccm.scene.pins.length === {pins}")
        edited.settled()


COLOURED = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">
  <path d="M10 10H90V90H10Z" fill="#efd1b1"/><path d="M30 30H55V60H30Z" fill="#204080"/></svg>"""


def test_the_source_shows_its_own_colours_and_the_target_does_not_tint_them(page, tmp_path):
    (tmp_path / "two.svg").write_text(COLOURED)
    edited = page("rose-leaf", "two.svg", "leaf.svg")
    seen = edited.picture(300, 300)
    opaque = seen[seen[..., 3] == 255][:, 2::-1].astype(int)
    for colour in ((0xEF, 0xD1, 0xB1), (0x20, 0x40, 0x80)):
        assert np.mean(np.abs(opaque - colour).max(axis=1) <= 3) > 0.05, colour
    on_page = canvas(edited, "target")
    opaque = on_page[on_page[..., 3] == 255][:, 2::-1].astype(int)
    near = [np.abs(opaque - c).max(axis=1) <= 3 for c in ((0xEF, 0xD1, 0xB1), (0x20, 0x40, 0x80))]
    assert np.mean(near[0] | near[1]) > 0.9


def test_both_ends_are_placed_one_after_the_other_and_pins_selected_by_a_rectangle(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.key("t")
    edited.mouse("mousePressed", edited.at("source", 259, 156), 1)
    edited.mouse("mouseReleased", edited.at("source", 259, 156))
    edited.wait("document.querySelector('#source .pending')")
    assert not edited.scene["pins"] and "target" in edited.js("document.getElementById('status').textContent")
    edited.click("target", 240, 200)
    pin = edited.scene["pins"][0]
    assert np.allclose(pin["source"], (259, 156), atol=1) and np.allclose(pin["target"], (240, 200), atol=1)
    assert not edited.js("document.querySelector('.pending')")
    edited.key("v")
    edited.click("source", 167, 340)
    edited.click("source", 330, 300)
    edited.key("m")
    left, top = edited.at("source", 100, 260)
    right, bottom = edited.at("source", 400, 400)
    edited.mouse("mousePressed", (left, top), 1)
    edited.mouse("mouseMoved", ((left + right) / 2, bottom), 1)
    edited.wait("document.querySelector('#source .marquee')")
    edited.mouse("mouseMoved", (right, bottom), 1)
    edited.mouse("mouseReleased", (right, bottom))
    edited.wait("document.querySelectorAll('#source .handle[aria-pressed=true]').length === 2")
    edited.key("Escape")
    edited.wait("!document.querySelector('#source .handle[aria-pressed=true]')")
    assert edited.js("document.getElementById('tool-pin').getAttribute('aria-pressed')") == "true"


def test_views_are_linked_divided_and_laid_over_each_other(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    place = [259, 156]
    edited.mouse("mouseMoved", edited.at("source", *place))
    edited.wait("iccm.panes.target.cross")
    cross = edited.js("iccm.panes.target.units.file(iccm.panes.target.cross)")
    choose = "(e => {{ e.value = '{}'; e.onchange(); }})(document.getElementById('view'))"
    result = canvas(edited, "target").astype(int)
    edited.js(choose.format("overlay"))
    edited.js("(e => { e.value = 1; e.oninput(); })(document.getElementById('own'))")
    own = canvas(edited, "target").astype(int)
    edited.js(choose.format("swipe"))
    both, middle = canvas(edited, "target").astype(int), result.shape[1] // 2
    assert np.abs(own - result).max() > 50
    assert np.array_equal(both[:, : middle - 2], own[:, : middle - 2])
    assert np.array_equal(both[:, middle + 2 :], result[:, middle + 2 :])
    edited.js(choose.format("result"))
    before = canvas(edited, "target").astype(int)
    edited.js("document.querySelectorAll('[data-balance]')[2].click()")
    assert edited.settled() == "full"
    after = canvas(edited, "target").astype(int)
    edited.js(choose.format("onion"))
    mixed, opaque = canvas(edited, "target").astype(int), (before[..., 3] == 255) & (after[..., 3] == 255)
    assert (
        np.abs(mixed - (before + after) / 2)[opaque].max() <= 3 and np.abs(before - after)[opaque].max() > 50
    )
    edited.js("document.getElementById('undo').click()")
    assert edited.settled() == "full"
    edited.click("source", *place)
    assert np.hypot(*np.subtract(cross, edited.scene["pins"][0]["target"])) < 3
    edited.key("k")
    ratio = "iccm.panes.target.view.zoom / iccm.panes.source.view.zoom"
    linked = edited.js(ratio)
    edited.js("iccm.panes.source.zoomBy(3)")
    assert edited.js(ratio) == pytest.approx(linked) and edited.js("iccm.panes.target.view.whole") is False


def test_another_tab_takes_over_and_gives_back_and_the_server_lives(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    first = edited.driver.current_window_handle
    edited.driver.switch_to.new_window("tab")
    edited.driver.get(edited.address)
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full"
    edited.click("source", 167, 340)
    pins = edited.scene["pins"]
    second = edited.driver.current_window_handle
    edited.driver.switch_to.window(first)
    edited.wait("document.getElementById('taken').checkVisibility()")
    edited.js("document.getElementById('take').click()")
    edited.wait("!document.getElementById('taken').checkVisibility()")
    assert edited.settled() == "full" and edited.scene["pins"] == pins
    edited.driver.switch_to.window(second)
    edited.wait("document.getElementById('taken').checkVisibility()")
    edited.driver.close()
    edited.driver.switch_to.window(first)
    time.sleep(4)  # longer than a server without pages runs
    edited.key("z", ctrl=True)
    assert edited.settled() == "full" and len(edited.scene["pins"]) == 1 and edited.process.poll() is None
    edited.process.kill()
    edited.wait("document.body.classList.contains('ended')")
    assert "iccm edit rose.svg leaf.svg" in edited.js("document.getElementById('status').textContent")
    edited.driver.get_log("browser")  # the log contains that the server was away


def test_what_is_exported_is_seen_before_and_downloaded(page, tmp_path, shell):
    (tmp_path / "two.svg").write_text(COLOURED)
    edited = page("rose-leaf", "two.svg", "leaf.svg")
    folder = tmp_path / "downloads"
    folder.mkdir()
    allowed = {"behavior": "allow", "downloadPath": str(folder)}
    edited.driver.execute_cdp_cmd("Browser.setDownloadBehavior", allowed)
    edited.js("document.getElementById('more').click()")
    shown = "document.querySelector('#preview img')?.naturalWidth"
    edited.wait(f"{shown} > 0")
    sized = "document.getElementById('size').checkVisibility()"
    assert edited.js(sized)
    assert edited.js("document.querySelector('#format [value=\".obj\"]').disabled")  # of meshes
    edited.js(
        "document.getElementById('format').value = '.svg', document.getElementById('format').onchange()"
    )
    edited.wait("document.getElementById('export-command').textContent.endsWith('-o two-leaf.svg')")
    edited.wait(f"!{sized}")  # artwork has no pixels
    edited.wait(f"{shown} > 0")
    typed = "(e => { e.value = arguments[0]; e.oninput(); })(document.getElementById('picture'))"
    disabled = "['download', 'export-now'].map((id) => document.getElementById(id).disabled)"
    for name in ("two-leaf.xyz", "", "sub/two.png", "two-leaf.svg"):  # refused before a command is shown
        edited.js(typed, name)
        is_wrong = name != "two-leaf.svg"
        edited.wait(f"String({disabled}) === '{str(is_wrong).lower()},{str(is_wrong).lower()}'")
        assert bool(edited.js("document.getElementById('export-command').textContent")) is not is_wrong
        assert bool(edited.js("document.getElementById('export-fault').textContent")) is is_wrong
    edited.js("document.getElementById('download').click()")
    edited.wait("document.getElementById('status').textContent.includes('Downloaded two-leaf.svg')")
    end = time.monotonic() + PATIENCE
    while not (folder / "two-leaf.svg").exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    done = shell(f"cd {tmp_path} && iccm map two.svg leaf.svg -o two-leaf.svg")
    assert done.returncode == 0, done.stderr
    assert (folder / "two-leaf.svg").read_bytes() == (tmp_path / "two-leaf.svg").read_bytes()


def test_two_fingers_zoom_and_a_swipe_scrolls(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    touch = {"enabled": True, "maxTouchPoints": 2}
    edited.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
    edited.screen(1, 768, 1000)
    tops = edited.js(
        "['source', 'target'].map((id) => document.getElementById(id).getBoundingClientRect().top)"
    )
    assert tops[0] == tops[1]
    small = """[...document.querySelectorAll('button, select, .handle')].filter((e) => e.checkVisibility())
      .filter((e) => { const {width, height} = e.getBoundingClientRect(); return Math.min(width, height) < 43.9; })
      .map((e) => e.id || e.textContent)"""
    assert edited.js(small) == []
    edited.screen(1, 390, 800)
    x, y = edited.at("source", 256, 256)
    zoom = "iccm.panes.source.view.zoom"
    before = edited.js(zoom)
    for k, kind in enumerate(("touchStart", *["touchMove"] * 6, "touchEnd")):
        away = 30 + 8 * k
        points = [{"x": x - away, "y": y, "id": 0}, {"x": x + away, "y": y, "id": 1}]
        event = {"type": kind, "touchPoints": [] if kind == "touchEnd" else points}
        edited.driver.execute_cdp_cmd("Input.dispatchTouchEvent", event)
    edited.wait(f"{zoom} > {1.5 * before}")
    assert edited.js("visualViewport.scale") == 1 and not edited.scene["pins"]
    view = edited.js("[iccm.panes.source.view.x, iccm.panes.source.view.y]")
    for k, kind in enumerate(("touchStart", *["touchMove"] * 14, "touchEnd")):
        points = [] if kind == "touchEnd" else [{"x": x, "y": y - 12 * k, "id": 0}]
        edited.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        time.sleep(0.02)
    edited.wait("scrollY > 100")
    assert edited.js("[iccm.panes.source.view.x, iccm.panes.source.view.y]") == view
    assert not edited.scene["pins"]


def test_a_photograph_is_its_rectangle_its_silhouette_or_what_a_lasso_encloses(page, tmp_path):
    edited = page("rose-leaf")
    edited.js("document.getElementById('welcome-files').click()")
    edited.wait("document.querySelector('#files[open]')")
    away = tmp_path / "elsewhere"
    away.mkdir()
    y, x = np.mgrid[:120, :160]
    photograph = np.stack([x, y, (x * y) % 251], axis=-1).astype(np.uint8)
    cv2.imwrite(str(away / "photo.png"), photograph)
    chosen(edited, "source", away / "photo.png")
    chosen(edited, "target", tmp_path / "leaf.svg")
    names = "[...document.querySelectorAll('[data-role=source] .parts button')].map((e) => e.textContent)"
    offered = edited.js(names)
    assert "whole picture" in offered and offered[-1] == "Lasso…"
    beyond = "[...document.querySelectorAll('.parts button')].filter((e) => e.scrollWidth > e.clientWidth)"
    assert edited.js(f"{beyond}.map((e) => e.textContent)") == []
    edited.js("document.querySelector('[data-role=source] .parts button:last-child').click()")
    edited.wait("document.querySelector('#lasso[open]')")
    left, top, width, height = edited.js(
        "(r => [r.left, r.top, r.width, r.height])(document.getElementById('lasso-picture').getBoundingClientRect())"
    )
    around = [(0.2, 0.2), (0.8, 0.3), (0.6, 0.9), (0.3, 0.8)]
    line = [(left + u * width, top + v * height) for u, v in around]
    edited.mouse("mousePressed", line[0], 1)
    for place in line[1:]:
        edited.mouse("mouseMoved", place, 1)
    edited.mouse("mouseReleased", line[-1])
    edited.js("document.getElementById('lasso-use').click()")
    edited.wait("document.querySelector('[data-role=source] .name').textContent === 'photo-lasso.png'")
    edited.js("document.getElementById('files-open').click()")
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full"
    outline = np.array(
        edited.js("iccm.panes.source.shape.outline.map((p) => iccm.panes.source.units.file(p))")
    )
    corners = np.array(around) * (160, 120)
    nearest = np.abs(outline[:, None] - corners).max(axis=2).min(axis=0)
    assert nearest.max() < 2, nearest
    edited.js("document.getElementById('choose').click()")
    edited.wait("document.querySelector('#files[open]')")
    broken = [["flat.png", ""]]
    edited.js(
        """((names) => { const data = new DataTransfer();
      for (const [name, text] of names) data.items.add(new File([text], name));
      const drop = new DragEvent('drop', {dataTransfer: data, bubbles: true});
      document.querySelector('[data-role=source]').dispatchEvent(drop); })(arguments[0])""",
        broken,
    )
    edited.wait("document.getElementById('files-said').textContent.startsWith('flat.png: ')")


def test_a_key_that_removes_what_is_dragged_ends_the_drag(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.click("source", 259, 156)
    edited.click("source", 200, 250)
    dragged, kept = (pin["target"] for pin in edited.scene["pins"])
    for key, others in (("Delete", {}), ("z", {"ctrl": True})):
        x, y = edited.scene["pins"][0]["target"]
        edited.drag("target", (x, y), (x + 20, y + 10), release=False)
        edited.key(key, **others)
        edited.mouse("mouseMoved", edited.at("target", x + 40, y + 10), 1)
        edited.mouse("mouseReleased", edited.at("target", x + 40, y + 10))
        assert edited.settled() == "full"
        places = [pin["target"] for pin in edited.scene["pins"]]
        # the other pin stays; what was undone comes back where it was
        assert places == ([kept] if key == "Delete" else [dragged, kept])


def test_the_tour_shows_each_part_of_the_page_within_the_window(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('tour-again').click()")
    box = "(r => [r.left, r.top, r.right, r.bottom])(document.querySelector('{}').getBoundingClientRect())"
    texts, shown = [], []
    for width in (1400, 390):
        edited.screen(1, width, 700)
        edited.js("document.getElementById('tour-again').click()")
        while edited.js("document.getElementById('tour').checkVisibility()"):
            left, top, right, bottom = edited.js(box.format("#tour"))
            assert left >= 0 and top >= 0 and right <= width and bottom <= 700
            about = edited.js(box.format(".toured"))
            assert about[1] < 700 and about[3] > 0, "what is explained is in sight"
            texts.append(edited.js("document.getElementById('tour-text').textContent"))
            shown.append(edited.js("document.getElementById('tour-count').textContent"))
            edited.js("document.getElementById('tour-next').click()")
        assert not edited.js("document.querySelector('.toured')")
    half = len(texts) // 2
    assert texts[:half] == texts[half:] and len(set(texts)) == half and half >= 5
    assert shown[0] == f"1 of {half}" and shown[half - 1] == f"{half} of {half}"
    assert not edited.scene["pins"]


def test_samples_have_thumbnails_and_open_with_their_texture(page):
    edited = page("rose-leaf")
    samples = "[...document.querySelectorAll('#welcome-samples button')]"
    drawn = f"{samples}.map((e) => [...e.querySelectorAll('svg path')].map((p) => p.getBBox().width > .1))"
    assert edited.js(drawn) == [[True, True]] * edited.js(f"{samples}.length") and edited.js(drawn)
    edited.js(f"{samples}.find((e) => e.textContent.startsWith('Limbs')).click()")
    edited.wait("globalThis.iccm")
    assert edited.settled() == "full"
    names = edited.js("[iccm.panes.source.shape.name, iccm.panes.target.shape.name]")
    assert [Path(name).name for name in names] == ["gingerbread.svg", "starfish.svg"]


def test_the_texture_is_a_checkerboard_or_the_drawing_of_the_source(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "checker")

    def colours(name):
        edited.js("document.getElementById('choose').click()")
        edited.wait("document.querySelector('#files[open]')")
        edited.js(f"document.getElementById('{name}').click()")
        said = edited.js("document.querySelector('[data-role=texture] .name').textContent")
        edited.js("(delete globalThis.iccm, document.getElementById('files-open').click())")
        edited.wait("globalThis.iccm")
        assert edited.settled() == "full"
        shown = edited.picture(200, 200)
        return said, shown[shown[..., 3] > 250][:, :3].astype(int)

    said, own = colours("own-texture")
    assert said == "the source’s own drawing"
    said, checker = colours("checkerboard")
    assert said == "a checkerboard"
    assert np.abs(own.mean(axis=0) - checker.mean(axis=0)).max() > 10


def test_a_fit_is_chosen_by_its_result_and_equal_results_are_one(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    fits = [mode.title for mode in FITS.values()]
    button = "document.getElementById('fits-show')"
    assert edited.js(f"{button}.checkVisibility() && {button}.textContent") == "Fit: Automatic…"
    edited.js(f"{button}.click()")
    tiles = "[...document.querySelectorAll('#fits-shown button')].filter((tile) => !tile.hidden)"
    # each can be understood, and chosen, before there is a result
    explained = edited.js(f"{tiles}.map((tile) => tile.innerText.split('\\n').filter(Boolean))")
    assert [words[0].split(" ✓")[0] for words in explained] == fits
    assert all(mode.help in words for words, mode in zip(explained, FITS.values()))
    edited.wait("document.querySelector('#fits[open]') && !document.getElementById('fits-said').textContent")
    names = edited.js(f"{tiles}.map((tile) => tile.querySelector('.names').textContent.split(', '))")
    assert sorted(name for of_tile in names for name in of_tile) == sorted(fits) and len(names) < len(fits)
    is_automatic = ["Automatic" in of_tile for of_tile in names]
    assert is_automatic[0]
    pressed = edited.js(f"{tiles}.map((tile) => tile.getAttribute('aria-pressed') === 'true')")
    assert pressed == is_automatic
    assert all("stretch" in text for text in edited.js(f"{tiles}.map((tile) => tile.textContent)"))
    pictures = edited.js(f"{tiles}.map((tile) => tile.querySelector('img').naturalWidth)")
    assert len(pictures) == len(names) and min(pictures) > 100
    other = next(k for k, of_tile in enumerate(names) if "Cover all" in of_tile)
    edited.js(f"{tiles}[{other}].click()")
    assert edited.settled() == "full" and edited.scene["fit"] == "cover"
    assert not edited.js("document.getElementById('fits').open")
    assert edited.js(f"{button}.textContent") == "Fit: Cover all…"


def test_what_is_bent_is_marked_and_kept_by_one_click(page, tmp_path):
    for name in ("heart.svg", "hand.svg", "coffee.jpg"):
        shutil.copy(SAMPLES.parent / "docs" / "files" / name, tmp_path)
    edited = page("rose-leaf", "heart.svg", "hand.svg", "--texture", "coffee.jpg")
    said = edited.js("document.getElementById('status').textContent")
    assert "bent" in said and "Good fit" not in said
    counts = [
        edited.js(f"document.querySelectorAll('#{side} .bent').length") for side in ("source", "target")
    ]
    assert counts[0] == counts[1] > 0
    before = edited.picture(200, 200)
    for way, kind in (("rigid", "rigid"), ("pin", "pins")):
        edited.js(f"document.getElementById('bent-{way}').click()")
        assert edited.settled() == "full" and len(edited.scene[kind]) == counts[0]
        assert not np.array_equal(edited.picture(200, 200), before)
        edited.key("z", ctrl=True)
        assert edited.settled() == "full" and not edited.scene[kind]
        assert np.array_equal(edited.picture(200, 200), before)


LATE = """import time; from iccm.io.edit.session import Session
follow = Session.follow
Session.follow = lambda self, scene: (time.sleep(2), follow(self, scene))[1]"""  # code: a server that is busy


def test_the_picture_follows_the_hand_before_the_server_answers_and_rests_as_the_server_says(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg", before=LATE)
    edited.click("source", 259, 156)
    edited.js("(iccm.take = iccm.panes.target.painter.map.bind(iccm.panes.target.painter))")
    edited.js("(iccm.panes.target.painter.map = (floats) => { iccm.floats = floats; iccm.take(floats); })")
    before, start = edited.picture(200, 200), edited.scene["pins"][0]["target"]
    end = [start[0] + 30, start[1] - 25]
    edited.drag("target", start, end, steps=6, release=False)
    edited.wait("iccm.floats")
    assert edited.js("iccm.seq[0] > iccm.seq[1]")  # the server has not answered
    edited.driver.set_script_timeout(PATIENCE)
    first = (
        "const done = arguments[0]; import(new URL('carry.js', location.href)).then(({carry}) => {"
        + """
      const {source, target} = iccm.panes, [pin] = iccm.scene.pins, place = target.page(pin.target);
      const at = carry(iccm.floats, source.page(pin.source), 'source');
      done(Math.hypot(at[0] - place[0], at[1] - place[1])); })"""
    )
    assert edited.driver.execute_async_script(first) < 0.05  # within the tolerance that the pin had before
    following = edited.picture(200, 200)
    assert not np.array_equal(following, before)
    edited.mouse("mouseReleased", edited.at("target", *end))
    assert edited.settled() == "full"
    shown = edited.picture(200, 200)
    edited.driver.refresh()  # what is painted then comes from the server alone
    edited.wait("globalThis.iccm")
    edited.settled()
    assert np.abs(shown.astype(int) - edited.picture(200, 200)).max() <= 2


@pytest.mark.parametrize("side", ["source", "target"])
def test_the_side_under_the_hand_is_painted_with_fewer_pixels_until_it_rests(page, side):
    """Without a graphics card; the picture and the loupe are painted for each movement."""
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg")
    edited.click("source", 259, 156)
    size = f"(({{canvas}}) => canvas.width * canvas.height)(iccm.panes.{side})"
    whole, start = edited.js(size), edited.scene["pins"][0][side]
    end = [start[0] + 20, start[1] - 15]
    edited.drag(side, start, end, steps=4, release=False)
    edited.wait(f"iccm.panes.{side}.loupe && {size} <= {whole / 4 + 1000}")
    edited.mouse("mouseReleased", edited.at(side, *end))
    assert edited.settled() == "full"
    edited.wait(f"{size} === {whole}")


BOXES = """['source', 'target'].map((id) => document.getElementById(id).getBoundingClientRect())
  .map((r) => [r.left, r.top, r.width, r.height])"""
CONTROLS = """[...document.querySelectorAll('button, select, input, summary')]
  .filter((e) => e.checkVisibility() && e.offsetWidth > 1 && !e.closest('.pane')).map((e) => e.id || e.textContent)"""


def test_the_result_is_large_and_the_source_can_be_swapped_or_kept_open(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", opened=False)
    edited.screen(1, 1400, 800)
    (_, _, small, _), (_, _, large, _) = edited.js(BOXES)
    assert large >= 0.66 * 1400 and small < 0.5 * large
    assert len(edited.js(CONTROLS)) <= 14
    assert len(edited.js("document.body.innerText").split()) <= 60
    edited.key("x")
    (_, _, swapped, _), (_, _, inset, _) = edited.js(BOXES)
    assert (swapped, inset) == (large, small)
    edited.click("source", 259, 156)  # a pin is placed in the large source, and seen in both
    edited.key("x")
    edited.key("y")
    source, target = edited.js(BOXES)
    assert source[1:] == target[1:]
    edited.driver.refresh()
    edited.wait("globalThis.iccm")
    edited.settled()
    assert edited.js(BOXES)[0][2] == pytest.approx(source[2], abs=1)  # as it was left


def test_on_a_phone_there_is_one_row_of_tools_and_all_of_the_result(page):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", opened=False)
    edited.screen(1, 390, 844)
    tools, window = edited.js("[document.querySelector('[role=toolbar]').offsetHeight, innerHeight]")
    source, target = edited.js(BOXES)
    assert tools == 48 and target[2] >= 370 and target[1] + target[3] <= window
    assert source[0] >= target[0] and source[1] + source[3] <= target[1] + target[3]  # in its corner
    shown = edited.js("iccm.panes.target.shape.outline.map((p) => iccm.panes.target.pixel(p))")
    assert (
        np.min(shown) >= 0 and np.max(shown, axis=0)[0] <= target[2] and np.max(shown, axis=0)[1] <= target[3]
    )
    boxes = edited.js("""[...document.querySelectorAll('header button, header summary')]
      .filter((e) => e.checkVisibility())
      .map((e) => e.getBoundingClientRect()).map((r) => [r.left, r.right, r.top, r.bottom])""")
    assert min(box[0] for box in boxes) >= 0 and max(box[1] for box in boxes) <= 390
    assert max(box[3] for box in boxes) <= 48
    edited.js("document.getElementById('swap').click()")
    assert edited.js(BOXES)[0][2:] == pytest.approx(target[2:], abs=2)


PLACES = """[...document.querySelectorAll(arguments[0])].filter((e) => e.checkVisibility())
  .map((e) => [e.id || e.textContent, e.getBoundingClientRect()])
  .map(([name, r]) => [name, Math.round(r.left), Math.round(r.top), Math.round(r.right), Math.round(r.bottom)])"""


@pytest.mark.parametrize("width", [1400, 1024, 768, 390])
def test_title_settings_and_whatever_is_offered_are_in_sight_at_every_width(page, width):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", "--texture", "petals.jpg", opened=False)
    height = 844
    edited.screen(1, width, height)
    for control in ("fits-show", "choose", "advanced"):
        ((_, left, top, right, bottom),) = edited.js(PLACES, f"#{control}:not(details), #{control} > summary")
        assert left >= 0 and right <= width and top >= 0 and bottom <= height, control
    edited.click("source", 259, 156)
    ((text, left, top, right, bottom),) = edited.js(PLACES, "header h1")
    assert "rose.svg → leaf.svg" in text and 0 <= left < right <= width and 0 <= top < bottom <= height
    unsaved = "getComputedStyle(document.getElementById('title'), '::after').content"
    assert "not saved" in edited.js(unsaved)
    panes = edited.js(BOXES)
    offers = "document.querySelectorAll('.offers button')"
    edited.js(f"""{offers}.forEach((e) => {{
      e.hidden = false;
      e.textContent ||= 'Recompute from scratch'; }})""")
    places = edited.js(PLACES, ".offers button")
    assert len(places) == edited.js(f"{offers}.length") > 1
    for name, left, top, right, bottom in places:
        assert left >= 0 and right <= width and bottom <= height, name
        hit = "document.elementFromPoint(arguments[0], arguments[1]).closest('button')?.id"
        assert edited.js(hit, (left + right) / 2, (top + bottom) / 2) == name
    assert edited.js(BOXES) == panes  # nothing moves under the hand
    edited.key("s", ctrl=True)
    edited.wait("!document.body.classList.contains('dirty')")
    assert "not saved" not in edited.js(unsaved)


@pytest.mark.parametrize("width", [768, 390])
def test_whatever_is_touched_is_as_large_as_a_finger(page, width):
    edited = page("rose-leaf", "rose.svg", "leaf.svg", opened=False)
    edited.screen(1, width, 844)
    edited.click("source", 259, 156)
    edited.js("document.getElementById('compare').open = true")
    controls = ":is(button, select, summary, input:not([type=checkbox])):not(.pane *)"
    small = [
        (name, right - left, bottom - top)
        for name, left, top, right, bottom in edited.js(PLACES, controls)
        if min(right - left, bottom - top) < 44 and right - left > 1
    ]
    assert small == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_only_the_export_stands_out(page, scheme):
    """The tool that is chosen is marked by a paler ground and a border."""
    edited = page("rose-leaf", "rose.svg", "leaf.svg", opened=False)
    edited.screen(1, 1400, 800, scheme)
    looks = edited.js("""[...document.querySelectorAll('header :is(button, summary)')]
      .filter((e) => e.checkVisibility())
      .map((e) => [e.id, getComputedStyle(e).backgroundColor, getComputedStyle(e).borderTopColor])""")
    grounds, borders = ({row[0]: row[k] for row in looks} for k in (1, 2))
    assert [name for name, ground in grounds.items() if ground == grounds["more"]] == ["more"]
    assert [name for name, ground in grounds.items() if ground == grounds["tool-pin"]] == ["tool-pin"]
    assert borders["tool-pin"] == grounds["more"] and contrast(edited, "#tool-pin") >= 4.5


def test_an_empty_page_shows_three_samples_and_where_to_drop_files(page):
    edited = page("rose-leaf")
    text = edited.js("document.body.innerText")
    assert len(text.split()) <= 60 and "Computing" not in text and "Drop" in text
    assert edited.js("document.querySelectorAll('#welcome-samples button').length") == 3
    assert not edited.js("document.querySelector('header').checkVisibility()")
    for width in (1400, 768, 390):
        metrics = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}
        edited.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        edited.wait(f"innerWidth === {width}")
        ((_, left, top, right, bottom),) = edited.js(PLACES, "#welcome h1")
        ((_, _, first, _, _),) = edited.js(PLACES, "#welcome-files")
        assert left >= 0 and right <= width and 0 <= top < bottom <= first
        assert edited.js(
            "(({scrollHeight, clientHeight}) => scrollHeight <= clientHeight + 1)(arguments[0])",
            edited.driver.find_element("css selector", "#welcome h1"),
        )
    drop = """(() => { const data = new DataTransfer();
      data.items.add(new File([arguments[0]], 'two.svg', {type: 'image/svg+xml'}));
      const drop = new DragEvent('drop', {dataTransfer: data, bubbles: true});
      document.getElementById('welcome-files').dispatchEvent(drop); })()"""
    edited.driver.execute_script(drop, TWO.format(""))
    edited.wait("document.querySelector('[data-role=source] .name').textContent === 'two.svg'")
    assert edited.js("document.querySelector('#files').open")


def test_a_deformation_shows_only_what_applies_to_it(page):
    edited = page("limbs", "gingerbread.svg", "--texture", "icing.png")
    for name in ("fits-show", "turn", "any", "draw", "suggest"):
        assert not edited.js(f"document.getElementById('{name}').checkVisibility()"), name
    assert edited.js("document.getElementById('balance').checkVisibility()")


def test_landmarks_of_other_programs_become_pins_and_back(page, tmp_path):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    rows = [
        '"eye","true","259","156","240","200"',
        '"off","false","1","2","3","4"',
        '"chin","true","167","340","190","300"',
    ]
    (tmp_path / "bigwarp.csv").write_text("\n".join(rows))
    (tmp_path / "wrong.csv").write_text("x,y\n1,2\n")
    edited.js("document.querySelectorAll('details').forEach((e) => { e.open = true; })")
    field = edited.driver.find_element("css selector", "#landmarks")
    field.send_keys(str(tmp_path / "wrong.csv"))
    edited.wait("document.body.classList.contains('bad')")
    assert (
        "wrong.csv" in edited.js("document.getElementById('status').textContent") and not edited.scene["pins"]
    )
    field.send_keys(str(tmp_path / "bigwarp.csv"))
    edited.wait("iccm.scene.pins.length === 2")
    assert edited.settled() == "full"
    pins = [(pin["name"], pin["source"], pin["target"]) for pin in edited.scene["pins"]]
    assert pins == [("eye", [259, 156], [240, 200]), ("chin", [167, 340], [190, 300])]
    folder = tmp_path / "downloads"
    folder.mkdir()
    allowed = {"behavior": "allow", "downloadPath": str(folder)}
    edited.driver.execute_cdp_cmd("Browser.setDownloadBehavior", allowed)
    edited.js("document.querySelector('[data-landmarks=\".csv\"]').click()")
    end = time.monotonic() + PATIENCE
    while not (folder / "rose-leaf.csv").exists():
        assert time.monotonic() < end
        time.sleep(0.05)
    again = (folder / "rose-leaf.csv").read_text().replace('"', "").splitlines()
    assert again == ["eye,true,259,156,240,200", "chin,true,167,340,190,300"]
    field.send_keys(str(folder / "rose-leaf.csv"))
    edited.wait("document.getElementById('status').textContent.includes('2 are there already')")
    assert len(edited.scene["pins"]) == 2


def test_the_command_of_the_export_dialog_works_as_it_is_copied(page):
    """First it reads the files as they were opened; once a pin has moved, the button saves copies of them."""
    edited = page("pins", "round.svg", "cat.svg", "--texture", "face.png")
    allowed = {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]}
    edited.driver.execute_cdp_cmd("Browser.grantPermissions", allowed)
    edited.driver.set_script_timeout(PATIENCE)

    def picture(name):
        """The picture that the copied command writes, and the one that Save to folder writes under another name."""
        edited.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", PHONE)
        edited.js("document.getElementById('more').click()")
        edited.js(f"document.getElementById('picture').value = '{name}.png'")
        edited.js("document.getElementById('size').value = 120")
        edited.js("document.getElementById('size').oninput()")
        command = "document.getElementById('export-command').textContent"
        edited.wait(f"{command}.endsWith('-o {name}.png') && {command}.includes('--size 120 ')")
        edited.wait("document.querySelector('#preview img')")
        edited.js("document.getElementById('export-copy').click()")
        edited.wait("document.getElementById('export-said').textContent.includes('Copied')", 30)
        copied = edited.driver.execute_async_script("navigator.clipboard.readText().then(arguments[0])")
        words = [sys.executable, "-m", "iccm", *shlex.split(copied)[1:-1], f"{name}-typed.png"]
        subprocess.run(words, cwd=edited.folder, check=True)
        edited.js("document.getElementById('export-now').click()")
        edited.wait(f"document.getElementById('export-said').textContent.startsWith('Saved {name}.png in ')")
        assert edited.js("document.getElementById('export').open")
        corner = edited.js(
            "(({top, bottom}) => [top, bottom])(document.querySelector('#export .head button').getBoundingClientRect())"
        )
        assert corner[0] >= 0 and corner[1] <= PHONE["height"]
        edited.driver.find_element("css selector", "#export .head button").click()
        edited.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        edited.wait(f"innerWidth > {PHONE['width']}")  # so that the next drag finds its pin
        return [cv2.imread(str(edited.folder / f"{name}{end}.png"), -1) for end in ("-typed", "")]

    first, first_saved = picture("first")
    assert np.array_equal(first, first_saved) and not list(edited.folder.glob("*-pins*"))
    x, y = edited.scene["pins"][3]["target"]
    edited.drag("target", (x, y), (x - 30, y))
    edited.wait(f"iccm.scene.pins[3].target[0] < {x - 10}")
    edited.settled()
    moved, moved_saved = picture("moved")
    assert np.array_equal(moved, moved_saved) and not np.array_equal(moved, first)
    assert {path.name for path in edited.folder.glob("*-pins.svg")} == {"round-pins.svg", "cat-pins.svg"}

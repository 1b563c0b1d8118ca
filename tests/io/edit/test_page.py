"""The page itself in a real, headless Chromium: pins are placed and dragged with the mouse, and what it shows is what
`iccm map` writes. Skipped, loudly, where there is no Chromium and ChromeDriver."""

import base64
import shutil
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from skimage.metrics import structural_similarity

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
)  # WebGL without a graphics card, and no calls home
PATIENCE = 120


class Page:
    """An `iccm edit` and a browser that shows it."""

    def __init__(self, folder, *arguments):
        command = [
            sys.executable,
            "-c",
            "from iccm.cli import main; main()",
            "edit",
            *arguments,
            "--no-browser",
        ]
        self.process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        options = webdriver.ChromeOptions()
        for flag in (*FLAGS, f"--user-data-dir={folder / 'profile'}"):
            options.add_argument(flag)
        options.binary_location = CHROMIUM
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        options.set_capability("unhandledPromptBehavior", "ignore")
        self.driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
        self.driver.get(self.address)
        self.wait("globalThis.iccm")
        self.settled()

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
        self.wait("!document.body.classList.contains('busy') && iccm.kind !== 'coarse'")
        return self.js("iccm.kind")

    @property
    def scene(self):
        return self.js("iccm.scene")

    def at(self, side, x, y):
        """The window's pixel of a point in the file's units."""
        place = "iccm.panes[arguments[0]].units.page([arguments[1], arguments[2]])"
        corner = "iccm.panes[arguments[0]].element.getBoundingClientRect()"
        px, py = self.js(f"iccm.panes[arguments[0]].pixel({place})", side, x, y)
        left, top = self.js(f"[{corner}.left, {corner}.top]", side)
        return left + px, top + py

    def mouse(self, kind, place, buttons=0):
        event = {"type": kind, "x": place[0], "y": place[1], "buttons": buttons, "clickCount": 1}
        event["button"] = "none" if kind == "mouseMoved" and not buttons else "left"
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def click(self, side, x, y):
        count = len(self.scene["pins"])
        self.mouse("mousePressed", self.at(side, x, y), 1)
        self.mouse("mouseReleased", self.at(side, x, y))
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
                "windowsVirtualKeyCode": ord(key[0].upper()),
            }
            self.driver.execute_cdp_cmd("Input.dispatchKeyEvent", event)

    def picture(self, width, height):
        """What the target's canvas paints, as pixels with straight alpha."""
        address = self.js("iccm.panes.target.picture(arguments[0], arguments[1])", width, height)
        data = np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8)
        return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)


@pytest.fixture
def page(tmp_path):
    opened = []

    def start(sample, *arguments):
        shutil.copytree(SAMPLES / sample, tmp_path, dirs_exist_ok=True)
        opened.append(Page(tmp_path, *arguments))
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


def test_what_cannot_be_is_red_and_the_map_stays(page, tmp_path):
    edited = page("pins", "cat.svg", "round.svg", "--texture", "face.png")
    before = edited.picture(300, 300)
    assert [pin["name"] for pin in edited.scene["pins"]] == ["left-eye", "right-eye", "nose", "mouth"]
    edited.js("document.querySelector('#list input').focus()")
    edited.drag("target", edited.scene["pins"][0]["target"], (20, 20), steps=3)
    edited.wait("document.body.classList.contains('bad')")
    edited.settled()
    assert "outside" in edited.js("document.getElementById('status').textContent")
    assert edited.js("document.querySelectorAll('#target .handle.wrong').length") == 1
    edited.key("z", ctrl=True)
    edited.wait("!document.body.classList.contains('bad')")
    assert edited.settled() == "full" and np.array_equal(edited.picture(300, 300), before)


def test_the_keyboard_does_it_all_and_the_server_ends_with_the_page(page, tmp_path):
    edited = page("rose-leaf", "rose.svg", "leaf.svg")
    edited.js("document.getElementById('source').focus()")
    edited.key("p")
    edited.wait("iccm.scene.pins.length === 1")
    edited.settled()
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

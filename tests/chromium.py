"""Chromium, to compare drawings and lengths with a browser; only for slow tests."""

import io
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars"),
    *("--force-device-scale-factor=1", "--allow-file-access-from-files"),
)
needed = pytest.mark.skipif(not CHROMIUM, reason="NOT COMPARED WITH A BROWSER: install Chromium")


def _run(folder, *words):
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={folder}/profile", *words]
    return subprocess.run(command, check=True, timeout=100, capture_output=True)


def pictures(drawings, size=200):
    """Pictures (size, size, 3) of SVG files, each fitted into a white square, as Chromium paints them on one page."""
    with tempfile.TemporaryDirectory() as folder:
        images = []
        for number, drawing in enumerate(drawings):
            copy = Path(folder) / f"{number}.svg"
            copy.write_bytes(Path(drawing).read_bytes())
            images.append(
                f'<img src="{copy.name}" style="position:absolute;left:0;top:{number * size}px;'
                f'width:{size}px;height:{size}px;object-fit:contain">'
            )
        page = Path(folder) / "page.html"
        page.write_text(f"<body style='margin:0;background:#fff'>{''.join(images)}", encoding="utf-8")
        shot = Path(folder) / "shot.png"
        _run(folder, f"--window-size={size},{size * len(images)}", f"--screenshot={shot}", page.as_uri())
        pixels = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB"))
    return [pixels[number * size : (number + 1) * size] for number in range(len(images))]


def evaluate(html, expression):
    """The text that a page shows after a script replaced it by the value of an expression."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        script = f"<script>document.body.innerHTML = '<pre id=answer>' + ({expression}) + '</pre>'</script>"
        page.write_text(f"<!doctype html><body>{html}{script}", encoding="utf-8")
        out = _run(folder, "--dump-dom", page.as_uri()).stdout.decode()
    return out.partition('<pre id="answer">')[2].partition("</pre>")[0]


def differing(first, second, away=48):
    """The share of pixels that differ in a channel by more than a faint edge does."""
    return float((np.abs(first.astype(int) - second.astype(int)).max(axis=2) > away).mean())

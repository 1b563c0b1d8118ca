"""Reports of a check: the page, the summary, JSON Lines, and updating a single baseline."""

import json
import os
import re
import shlex
import shutil

import cv2
import numpy as np
import pytest

from iccm.io.check import reports

from .test_check import folders, report_with, save, scene  # noqa: F401

HOSTILE = "</script><img src=x onerror=alert(1)>`|&.png"
webdriver = pytest.importorskip("selenium.webdriver", reason="NO BROWSER TESTS: selenium is not installed")
CHROMIUM, DRIVER = shutil.which("chromium") or shutil.which("google-chrome"), shutil.which("chromedriver")


def data(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])


def pixels(address):
    import base64

    return cv2.imdecode(
        np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8), cv2.IMREAD_COLOR
    )


@pytest.fixture
def changed(folders):  # noqa: F811
    """A run with a red spot at column 30, row 20, a figure that has moved, an additional file and a missing one."""
    run, base = folders
    spot = scene()
    spot[20, 30] = (255, 0, 0, 255)
    save(run / "a.png", spot)
    (run / "r.json").write_text(report_with(lambda r: r["boundary"].update(rms=3e-4)))
    save(run / "deep" / "new.png", scene())
    (run / "other.obj").unlink()
    return run, base


def test_a_page_lists_the_differences(changed, iccm):
    run, base = changed
    assert iccm("check", run, base, "--html", "check.html").code == 1
    page = data(run.parent / "check.html")
    rows = {row["cells"][0]["text"]: row for row in page["rows"]}
    assert {name: row["cells"][1]["text"] for name, row in rows.items()} == {
        **{"a.png": "differs", "deep/b.png": "same", "deep/new.png": "new"},
        **{"other.obj": "missing", "r.json": "differs"},
    }
    assert [name for name, row in rows.items() if row["good"]] == ["deep/b.png"]
    assert rows["r.json"]["detail"]["figures"] == [["boundary.rms", "0.0003", "0.0001", "1e-09"]]
    pair = rows["a.png"]["detail"]["pair"]
    assert (pair["x"] * 64, pair["y"] * 48) == (30, 20)
    heat = pixels(pair["heat"])
    assert heat.shape == (48, 64, 3) and np.argwhere(heat.any(axis=2)).tolist() == [[20, 30]]
    assert not np.array_equal(pixels(pair["before"]), pixels(pair["after"]))
    assert "before" not in rows["deep/new.png"]["detail"]["pair"]


def test_the_line_of_a_page_accepts_one_file(changed, iccm):
    run, base = changed
    before = (base / "r.json").read_bytes()
    iccm("check", run, base, "--html", "check.html")
    rows = {row["cells"][0]["text"]: row for row in data(run.parent / "check.html")["rows"]}
    for name in ("a.png", "other.obj"):
        assert iccm(*shlex.split(rows[name]["detail"]["update"])[1:]).code == 0
    assert (base / "a.png").read_bytes() == (run / "a.png").read_bytes()
    assert not (base / "other.obj").exists() and (base / "r.json").read_bytes() == before
    assert iccm("check", run, base, "--only", "a.png").code == 0
    assert iccm("check", run, base, "--only", "*.png").code == 1
    wrong = iccm("check", run, base, "--only", "nothing.png")
    assert wrong.code == 2 and "nothing.png" in wrong.err


def test_a_summary_and_lines_of_json(changed, iccm):
    run, base = changed
    result = iccm("check", run, base, "--json", "-q")
    records = {record["name"]: record for record in map(json.loads, result.out.splitlines())}
    assert records["r.json"]["moved"][0]["limit"] == "1e-09" and records["deep/b.png"]["problems"] == []
    assert {record["schema"] for record in records.values()} == {"iccm.check/1"}
    result = iccm("check", run, base, "--summary", "-", "-q")
    assert (
        result.out.count("\n| ") == 5
        and "1 of 5 files match their baselines, 2 different, 1 new, 1 missing" in result.out
    )


@pytest.mark.skipif(os.name == "nt", reason="Windows does not allow such names")
def test_hostile_names_stay_text(changed, iccm):
    run, base = changed
    name = HOSTILE.replace("/", "")
    save(run / name, scene())
    iccm("check", run, base, "--html", "check.html", "--summary", "check.md")
    text = (run.parent / "check.html").read_text()
    assert text.count("</script>") == 2 and "<img src=x" not in text
    assert name in [row["cells"][0]["text"] for row in data(run.parent / "check.html")["rows"]]
    line = next(line for line in (run.parent / "check.md").read_text().splitlines() if "onerror" in line)
    assert line.count("|") == 4 and "<" not in line and "`" not in line


def test_heat_rises():
    ramp = reports.heat(np.linspace(0, 1, 101)[None]).astype(int).sum(axis=2)[0]
    assert ramp[0] == 0 and ramp[-1] == 3 * 255 and (np.diff(ramp) >= 0).all()


@pytest.mark.slow
def test_a_batch_on_a_page(shapes, iccm):
    (shapes / "none.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    (shapes / "jobs.jsonl").write_text(
        '{"source": "square.svg", "target": "disk.svg", "size": 32, "output": "a b.png"}\n'
        '{"source": "none.svg", "target": "disk.svg", "size": 32, "output": "c.png"}\n'
    )
    result = iccm("batch", "jobs.jsonl", "--root", "out", "-j", "1", "--html", "batch.html", "-q")
    assert result.code == 1
    good, bad = data(shapes / "batch.html")["rows"]
    assert good["cells"][1]["link"] == "out/a%20b.png" and (shapes / "out" / "a b.png").is_file()
    assert max(pixels(good["cells"][1]["image"]).shape) == 32
    assert bad["cells"][2]["text"] == "failed" and "none.svg" in bad["cells"][5]["text"]


@pytest.mark.slow
@pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="NO BROWSER TESTS: install chromium and chromium-driver"
)
def test_the_page_in_chromium(changed, iccm, tmp_path):
    """It sorts, filters, zooms to the largest difference, and shows no errors, with a hostile file name among the
    rows.
    """
    run, base = changed
    save(run / HOSTILE.replace("/", ""), scene())
    iccm("check", run, base, "--html", "check.html")
    options = webdriver.ChromeOptions()
    for flag in (
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={tmp_path / 'profile'}",
    ):
        options.add_argument(flag)
    options.binary_location = CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    with webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER)) as driver:
        driver.get((run.parent / "check.html").as_uri())

        def names():
            return driver.execute_script(
                "return [...document.querySelectorAll('#rows tr')].map(r => r.cells[0].textContent)"
            )

        def click(selector):
            driver.execute_script(f"document.querySelector({selector!r}).click()")

        assert "deep/b.png" not in names() and len(names()) == 5
        click("#only")
        assert len(names()) == 6
        click("#head th:first-child button")
        ascending = names()
        click("#head th:first-child button")
        assert names() == ascending[::-1]
        driver.execute_script("const f = document.querySelector('#filter'); f.value = 'a.png'; f.oninput()")
        assert names() == ["a.png"]
        click("#rows tr")
        click("#detail button")
        middle = driver.execute_script(
            "const i = document.querySelector('#stage img'), f = i.parentNode.getBoundingClientRect(),"
            "b = i.getBoundingClientRect();"
            "return [(f.x + f.width / 2 - b.x) / b.width * 64, (f.y + f.height / 2 - b.y) / b.height * 48]"
        )
        assert np.allclose(middle, (30, 20), atol=1)
        for mode in ("slider", "onion skin", "blink", "difference"):
            driver.execute_script(
                f"const s = document.querySelector('#detail select'); s.value = {mode!r}; s.onchange()"
            )
        assert driver.get_log("browser") == []

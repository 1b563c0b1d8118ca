"""The extension in a real Inkscape without a display: its results are rendered and compared. Skipped, with a warning,
without Inkscape.
"""

import base64
import io
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iccm.io import plugins

NEEDED = ("inkscape", "xvfb-run", "dbus-run-session")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.skipif(
        not all(map(shutil.which, NEEDED)), reason=f"NO INKSCAPE TESTS: install {', '.join(NEEDED)}"
    ),
]
SVG, LABEL = "{http://www.w3.org/2000/svg}", "{http://www.inkscape.org/namespaces/inkscape}label"
FIT, DEFORM = "org.iccm.fit", "org.iccm.deform"
HEART = (
    "M60 104C20 76 6 56 6 34C6 16 20 6 34 6C46 6 55 12 60 22C65 12 74 6 86 6"
    "C100 6 114 16 114 34C114 56 100 76 60 104Z"
)
FACE = f"""<path d="{HEART}" fill="url(#g)"/>
<path d="M24 34C24 26 30 22 36 22" fill="none" stroke="#fff" stroke-width="6" stroke-linecap="round"/>
<circle cx="40" cy="48" r="9" class="eye"/>
<path d="M48 66C54 74 68 74 74 66" fill="none" stroke="#226" stroke-width="5"/>
<g transform="rotate(30 84 50)"><rect x="76" y="44" width="18" height="8" opacity=".6" fill="#060"/></g>"""
NEAR = 0.02 + 2e-4 * 80 * 2**0.5  # the radius of an eye, and the error of paths on a target of 80 units
PLACED = "matrix(.45,.12,-.12,.45,80,10)"  # the target's layer, then the target
ONTO = "translate(30,20) scale(1.2)"
MILLIMETRES = 'width="210mm" height="148mm" viewBox="0 -5 210 148"'
PAGE = f"""<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
 xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" {MILLIMETRES}><style>.eye {{{{ fill: #226 }}}}</style>
<defs><linearGradient id="g" x2="1"><stop stop-color="#ffd166"/><stop offset="1" stop-color="#ef476f"/>
</linearGradient></defs>
{{}}</svg>"""


def page(extra="", target=f'<path id="target" d="{HEART}" transform="{ONTO}" fill="#eee"/>'):
    """A heart with a face in a layer, and another heart, rotated and larger, in another."""
    return PAGE.format(f"""<g inkscape:groupmode="layer" id="below" transform="translate(5,3)">
<g id="art" inkscape:label="face" transform="matrix(.45,.12,-.12,.45,20,10)">{FACE}{extra}</g></g>
<g inkscape:groupmode="layer" id="above" transform="{PLACED}"><g id="inner">{target}</g></g>""")


@pytest.fixture
def profile(tmp_path, monkeypatch):
    """A user's settings with the extension, and a folder, made current, for documents."""
    home = tmp_path / "profile"
    monkeypatch.setenv("INKSCAPE_PROFILE_DIR", str(home))
    monkeypatch.setenv("PATH", f"/usr/bin{os.pathsep}/bin{os.pathsep}{os.environ['PATH']}")
    assert plugins.install("inkscape") == [home / "extensions" / "iccm"]
    monkeypatch.chdir(tmp_path)
    return home


def act(document, actions, ids):
    """The result of Inkscape actions on a document whose objects are selected one after the other."""
    Path("in.svg").write_text(document)
    chosen = [f"select-by-id:{number}" for number in ids]
    commands = ";".join([*chosen, *actions, "export-filename:out.svg", "export-do"])
    command = [
        "xvfb-run",
        "-a",
        "dbus-run-session",
        "--",
        "inkscape",
        "--batch-process",
        f"--actions={commands}",
        "in.svg",
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return Path("out.svg").read_text()


def run(document, profile, *arguments):
    """The result of the extension on a document, called like Inkscape does, with its message and exit code."""
    Path("in.svg").write_text(document)
    query = ["inkscape", "--system-data-directory"]
    data = subprocess.run(query, capture_output=True, text=True, check=True).stdout.strip()
    script = profile / "extensions" / "iccm" / "iccm_inkscape.py"
    command = ["/usr/bin/python3", str(script), *arguments, "--output=out.svg", "in.svg"]
    environment = os.environ | {"PYTHONPATH": f"{data}/extensions"}
    result = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    return (Path("out.svg").read_text() if result.returncode == 0 else ""), result.stderr, result.returncode


def rendered(document):
    """A document's pixels (height, width, 3) on white, 0 to 1."""
    Path("shown.svg").write_text(document)
    command = ["inkscape", "--export-type=png", "--export-filename=shown.png", "-w", "1050", "shown.svg"]
    subprocess.run(command, check=True, capture_output=True)
    image = Image.open("shown.png").convert("RGBA")
    return np.asarray(Image.alpha_composite(Image.new("RGBA", image.size, "white"), image))[..., :3] / 255


def differing(a, b):
    """The share of pixels of the target's layer that differ visibly."""
    x = a.shape[1] // 3
    return (np.abs(a[:, x:] - b[:, x:]).max(axis=-1) > 0.15).mean()


def names(document):
    return [element.get("id") for element in ElementTree.fromstring(document).iter() if element.get("id")]


def expected(extra=""):
    """The page with the face itself in the target's place: between similar shapes, the map is the similarity."""
    return page(extra, f'<g transform="{ONTO}">{FACE}{extra}</g>')


def test_artwork_is_carried_through_all_transforms(profile):
    result = act(page(), [f"{FIT}.noprefs"], ["art", "target"])
    picture = rendered(result)
    assert differing(picture, rendered(expected())) < 1e-3 < differing(picture, rendered(page()))
    assert len(names(result)) == len(set(names(result)))
    group = next(
        element
        for element in ElementTree.fromstring(result).iter(f"{SVG}g")
        if element.get(LABEL) == "face in target"
    )
    paper, drawn = group
    assert paper.tag == f"{SVG}path" and drawn.tag == f"{SVG}g"
    assert not list(group.iter(f"{SVG}image")) and len(list(drawn.iter(f"{SVG}path"))) == 5


def test_artwork_that_paths_cannot_hold_becomes_a_picture_and_is_undone_in_one_step(profile):
    blur = '<filter id="soft"><feGaussianBlur stdDeviation="3"/></filter>'
    blur += '<circle cx="70" cy="84" r="7" filter="url(#soft)"/>'
    (profile / "preferences.xml").write_text(
        '<inkscape version="1"><group id="extensions" org.iccm.fit.result="picture"/></inkscape>'
    )
    result = act(page(blur), [f"{FIT}.noprefs"], ["art", "target"])
    assert len(list(ElementTree.fromstring(result).iter(f"{SVG}image"))) == 1
    assert (
        differing(rendered(result), rendered(expected(blur)))
        < 4e-3
        < differing(rendered(result), rendered(page(blur)))
    )
    undone = act(page(blur), [f"{FIT}.noprefs", "undo"], ["art", "target"])
    assert "image" not in undone and not np.abs(rendered(undone) - rendered(page(blur))).any()


def mark(name, x, y, number):
    return f'<circle id="m{number}" inkscape:label="{name}" cx="{x}" cy="{y}" r="1"/>'


def eyes(document):
    """The centres of elements of the class `eye`, in the coordinates of their layer."""
    centres = []
    for element in ElementTree.fromstring(document).iter(f"{SVG}path"):
        if "eye" in element.get("class", ""):
            numbers = np.array(re.findall(r"-?[\d.]+(?:e-?\d+)?", element.get("d")), float).reshape(-1, 2)
            centres.append((numbers.min(axis=0) + numbers.max(axis=0)) / 2)
    return centres


def plain(marks, extra=""):
    """A square with a small eye, and a disc, in the user units of the page."""
    drawn = '<g id="art"><path d="M10 10H70V70H10Z" fill="#dd8"/><circle class="eye" cx="30" cy="30" r=".02"/></g>'
    return PAGE.format(
        f'{drawn}<circle id="target" cx="140" cy="60" r="40" fill="#eee"/>{extra}{"".join(marks)}'
    )


def test_drawn_pins_are_met_in_any_order(profile):
    first, second = mark("pin-eye", 30, 30, 1), mark("pin-eye", 130, 50, 2)
    for marks in ([first, second], [second, first]):
        result, message, code = run(plain(marks), profile, "--id=art", "--id=target", "--exact_pins=true")
        assert (message, code) == ("", 0)
        assert np.allclose(eyes(result), [[130, 50]], atol=NEAR)
    soft, message, code = run(plain([first, second]), profile, "--id=art", "--id=target")
    assert (message, code) == ("", 0) and NEAR < np.hypot(*(eyes(soft)[0] - [130, 50])) < 4
    free = run(plain([first, second]), profile, "--id=art", "--id=target", "--pins=false")[0]
    assert np.hypot(*(eyes(free)[0] - [130, 50])) > 2


def test_the_radius_of_a_pin_determines_how_much_keeps_its_form(profile):
    def deformed(radius):
        pin = mark("pin-eye", 30, 30, 1).replace('r="1"', f'r="{radius}"')
        result, message, code = run(
            plain([pin, mark("pin-eye", 130, 45, 2)]), profile, "--id=art", "--id=target"
        )
        assert (message, code) == ("", 0)
        return eyes(result)[0]

    small, marked, large = (deformed(radius) for radius in (0.5, 1, 4))
    assert np.allclose(small, marked, atol=1e-6)
    assert np.hypot(*(large - marked)) > 0.05


def test_artwork_is_deformed_by_pins(profile):
    marks = [mark("pin-eye", 30, 30, 1), mark("pin-eye", 40, 20, 2), mark("pin-corner", 65, 65, 3)]
    result = act(plain(marks), [f"{DEFORM}.noprefs"], ["art"])
    assert np.allclose(eyes(result), [[40, 20]], atol=NEAR)
    assert "art" not in names(result) and "target" in names(result)


def test_strokes_that_are_drawn_are_met(profile):
    line = '<path inkscape:label="stroke-brow" id="{}" d="{}" fill="none" stroke="red"/>'
    lines = line.format("s1", "M20 30H40") + line.format("s2", "m 125,40 q 10,-15 30,0")
    result, message, code = run(
        plain([], lines), profile, "--id=art", "--id=target", "--result=picture", "--size=512"
    )
    assert (message, code) == ("", 0) and "data:image/png" in result
    result = run(plain([], lines), profile, "--id=art", "--id=target")[0]
    t = np.linspace(0, 1, 400)[:, None]
    curve = (1 - t) ** 2 * [125, 40] + 2 * t * (1 - t) * [135, 25] + t**2 * [155, 40]
    assert np.hypot(*(curve - eyes(result)[0]).T).min() < 0.1


def test_each_letter_gets_the_artwork_and_removed_originals_stay_for_their_clones(profile):
    word = '<g id="word"><path d="M90 10h30v50h-30z"/><path d="M130 10h40l-20 60z"/></g>'
    clone = '<use id="twin" xlink:href="#art" y="70"/>'
    arguments = ("--id=art", "--id=word", "--parts=each", "--replace=true", "--outline=box")
    result, message, code = run(plain([], word + clone), profile, *arguments)
    assert (message, code) == ("", 0)
    (left, _), (right, _) = sorted(map(tuple, eyes(result)))
    assert 90 < left < 120 and 130 < right < 170
    picture = rendered(result)
    scale = picture.shape[1] / 210
    assert (picture[int(45 * scale), int(50 * scale)] > 0.99).all()  # the artwork is gone, its clone is not
    assert np.allclose(
        picture[int(115 * scale), int(50 * scale)], [0xDD / 255, 0xDD / 255, 0x88 / 255], atol=0.01
    )


def test_all_letters_of_a_word_go_into_the_target(profile):
    bars = "".join(f'<path id="bar{x}" d="M{x} 30h6v{h}h-6z" fill="#03{k}"/>' for k, (x, h) in enumerate(
        ((10, 40), (20, 30), (30, 36), (40, 25))
    ))  # fmt: skip
    document = plain([]).replace('<g id="art">', f'<g id="word">{bars}</g><g id="art">')
    result, _, code = run(document, profile, "--id=word", "--id=target")
    assert code == 0
    drawn = [
        path
        for path in ElementTree.fromstring(result).iter(f"{SVG}path")
        if path.get("fill", "").startswith("#03")
    ]
    assert (
        sorted({path.get("fill") for path in drawn}) == ["#030", "#031", "#032", "#033"] and len(drawn) == 8
    )
    largest = run(document, profile, "--id=word", "--id=target", "--outline=largest")
    assert largest[2] == 0 and "3 × shape outside the source, omitted" in largest[1]


PHOTO = """<image id="photo" x="10" y="10" width="60" height="40" preserveAspectRatio="none"
 xlink:href="data:image/png;base64,{}"/>"""


def photo():
    """A picture of four colours."""
    pixels = np.repeat(
        np.repeat(np.array([[[200, 30, 30], [30, 150, 30]], [[30, 30, 200], [220, 200, 30]]]), 20, 0), 30, 1
    )
    buffer = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).save(buffer, "PNG")
    return PHOTO.format(base64.b64encode(buffer.getvalue()).decode())


@pytest.mark.parametrize("chosen", ["photo", "group"])
def test_a_photo_goes_onto_a_shape_with_its_rectangle_by_default(profile, chosen):
    drawn = f'<g id="group">{photo()}<rect x="30" y="20" width="8" height="8" fill="#111"/></g>'
    document = plain([], drawn if chosen == "group" else photo())
    result, message, code = run(document, profile, f"--id={chosen}", "--id=target")
    assert (message, code) == ("", 0)
    made = [e for e in ElementTree.fromstring(result).iter(f"{SVG}image") if e.get("id") != "photo"]
    assert made and all("{http://www.w3.org/1999/xlink}href" in each.attrib for each in made)
    picture = rendered(result)
    scale = picture.shape[1] / 210
    for x, y, colour in (
        (120, 45, (200, 30, 30)),
        (160, 45, (30, 150, 30)),
        (120, 75, (30, 30, 200)),
        (160, 75, (220, 200, 30)),
    ):
        assert np.allclose(picture[int((y + 5) * scale), int(x * scale)], np.array(colour) / 255, atol=0.05)
    assert len(set(names(result))) == len(names(result))


def test_gaps_between_letters_are_no_alarm(profile):
    word = '<g id="word"><path d="M90 10h30v50h-30z"/><path d="M130 10h40l-20 60z"/></g>'
    result, message, code = run(plain([], word), profile, "--id=art", "--id=word")
    assert result and (message, code) == ("", 0)


def test_the_menu_and_the_page_of_the_docs_use_the_same_words():
    root = Path(__file__).parents[2]
    text = (root / "docs" / "plugins" / "inkscape.md").read_text(encoding="utf-8")
    menu = ElementTree.parse(root / "plugins" / "inkscape" / "iccm_fit.inx").getroot()
    space = "{http://www.inkscape.org/namespace/inkscape/extension}"
    words = [
        option.text
        for name in ("result", "outline", "parts")
        for option in menu.find(f"{space}param[@name='{name}']")
    ]
    assert [word for word in words if f"*{word}*" not in text] == []


def test_omissions_are_reported_with_the_result(profile):
    aside = '<circle cx="20" cy="120" r="5"/>'
    document = plain([]).replace('<g id="art">', f'<g id="art">{aside}')
    result, message, code = run(document, profile, "--id=art", "--id=target", "--outline=largest")
    assert code == 0 and "1 × shape outside the source, omitted" in message
    assert len(eyes(result)) == 1


def test_artwork_that_was_selected_last_is_noticed(profile):
    result, message, code = run(page(), profile, "--id=target", "--id=art")
    assert code == 0 and result and "target" in message.splitlines()[0] and "face" in message.splitlines()[0]
    _, message, code = run(page(), profile, "--id=art", "--id=target")
    assert code == 0 and "last" not in message


@pytest.mark.parametrize(
    ("arguments", "marks", "expected"),
    [
        (["--id=art"], [], "Select the artwork, then Shift-click"),
        (
            ["--id=art", "--id=target"],
            [mark("pin-a", 30, 30, 1)],
            "pin-a is drawn 1 times; draw it once on the artwork",
        ),
        (["--id=art", "--id=target"], [mark("pin-a", 30, 30, 1), mark("pin-a", 5, 120, 2)], "pin"),
        (["--id=art", "--id=target", "--turn=left"], [], "'left' is not an angle"),
        (["--id=art", "--job=deform"], [], "There are no pins."),
        (["--id=line", "--id=target"], [], "the artwork"),
        (["--id=line", "--id=target", "--result=picture"], [], "The selected objects have no area."),
        (["--id=art", "--id=open"], [], "open"),
    ],
)
def test_impossible_requests_are_reported_and_change_nothing(profile, arguments, marks, expected):
    line = '<path id="line" d="M10 120H60"/>'
    line += '<path id="open" d="M10 130C40 120 60 140 90 130" style="fill:none;stroke:#000;stroke-width:.3"/>'
    result, message, code = run(plain(marks, line), profile, *arguments)
    assert expected in message and "Traceback" not in message and code not in (0, 1) and not result


def test_a_moved_python_is_reported(profile):
    (profile / "extensions" / "iccm" / "iccm_python.txt").write_text("/nowhere/python\n")
    _, message, code = run(plain([]), profile, "--id=art", "--id=target")
    assert code and "/nowhere/python" in message and "`iccm plugins install inkscape`" in message
    assert len(message.strip().splitlines()) == 1

"""A drawing that is written contains no references to other files, in any notation."""

import re
from xml.etree import ElementTree

import pytest

from iccm.io.artwork import references

AWAY = "http://away.example/x"
RED = (
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5E"
    "rkJggg=="
)
SHEETS = [
    f'@import "{AWAY}";',
    f'@import "{AWAY}"{{}}',
    f'@unknown "{AWAY}";',
    f'1e9@import "{AWAY}";.a{{fill:red}}',
    f"@import url({AWAY});",
    f'@\\69mport "{AWAY}";',
    f"a{{fill:url({AWAY})}}",
    f"a{{fill:u\\72l({AWAY})}}",
    f'a{{fill:url( "{AWAY}" )}}',
    f'a{{fill:src("{AWAY}")}}',
    f"a{{--x:url({AWAY})}}",
    f'a{{cursor:image-set("{AWAY}" 1x)}}',
    f"a{{filter:url(file:///etc/passwd#x) url({AWAY})}}",
    f"@media print{{a{{fill:url({AWAY})}}}}",
    f"@media print{{@supports (x:y){{a{{fill:url({AWAY})}}}}}}",
    f"@font-face{{font-family:x;src:url({AWAY})}}",
    f"a{{b{{fill:url({AWAY})}}}}",
    "a{fill:url(//away.example/x)}/*",
    f'a{{fill:url("{AWAY}',
    f"a{{fill:url({AWAY}",
    f"a{{behavior:url({AWAY})}}",
    f"a{{fill:url(data:image/svg+xml,{AWAY})}}",
    "a{fill:url(data:text/html,away)}",
    f"a{{width:{'9' * 5000};fill:url({AWAY})}}",
    f"a{{fill:{'(' * 5000}url({AWAY})}}",
    f"<!-- a{{fill:url({AWAY})}} -->",
]


@pytest.mark.parametrize("text", SHEETS)
def test_a_style_sheet_leads_nowhere(text):
    kept, lost = references.sheet(f".ok{{fill:red}}{text}")
    assert lost and "away" not in kept and "passwd" not in kept
    assert references.sheet(kept)[1] == 0


@pytest.mark.parametrize("text", [s[2:] for s in SHEETS if s.startswith("a{f")])
def test_a_style_attribute_leads_nowhere(text):
    kept, lost = references.style(f"stroke:red;{text}")
    assert lost and "away" not in kept and "passwd" not in kept


KEPT = [
    ".a{fill:red;stroke:url(#g)}",
    f".a{{fill:url({RED})}}",
    '.a{fill:url("#g") red;transform:rotate(3deg)}#b{x:1}',
    "@media screen{.a{fill:red}}",
    '@namespace svg url(http://www.w3.org/2000/svg);.a{d:path("M0 0")}',
]


@pytest.mark.parametrize("text", KEPT)
def test_internal_references_are_unchanged(text):
    assert references.sheet(text) == (text, 0)


DRAWING = f"""<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
xmlns:h="http://www.w3.org/1999/xhtml" viewBox="0 0 100 100" style="fill:url({AWAY})">
<style>@import "{AWAY}"; .a{{fill:url({AWAY});stroke:red}}</style>
<metadata><h:script>away</h:script><h:img src="{AWAY}"/></metadata><desc onclick="away()">d</desc>
<defs><pattern id="p" width="9" height="9"><image href="{AWAY}" width="9" height="9"/><script>away</script>
<rect width="5" height="5" onload="away()"/><use href="other.svg#away"/></pattern>
<marker id="m"><path d="M0 0H1V1z" style="fill:url({AWAY})"/><set attributeName="href" to="{AWAY}"/></marker>
<filter id="f"><feImage xlink:href="{AWAY}"/><feOffset dx="1"/></filter>
<linearGradient id="g" xlink:href="{AWAY}#away"><stop stop-color="red"/></linearGradient></defs>
<path id="o" class="a" d="M10 10H90V90H10Z" fill="url(#p)"/>
<path d="M20 20H50V60z" style="fill:url(#g);filter:url(file:///away#x)" marker-start="url(#m)" cursor="url({AWAY})"/>
<path d="M20 20H50V60z" filter="url(#f)" mask="url({AWAY}#m)"/>
<a xlink:href="{AWAY}"><path d="M30 30H50V60z" stroke="u\\72l({AWAY})"/></a>
<image href="{RED}" x="20" y="20" width="20" height="20"/></svg>"""


def test_artwork_leads_nowhere(shapes, iccm):
    (shapes / "a.svg").write_text(DRAWING)
    result = iccm("map", "a.svg#o", "blob.svg", "--method", "paper", "--vertices", "60", "-o", "out.svg")
    assert result.code == 0, result.err
    text = (shapes / "out.svg").read_text()
    assert (
        "away" not in text and "stroke:red" in text and "data:image/png;base64," in text and "url(#" in text
    )
    assert "reference to another file, omitted" in result.err
    for element in ElementTree.fromstring(text).iter():
        for name, value in element.attrib.items():
            assert not name.lower().startswith("on")
            assert not re.search(r"(?i)(https?|file):", value), (name, value)


@pytest.mark.parametrize("value", ["M0 0L1 nanZ", "NaN", "matrix(1 0 0 1 inf 0)", "1,-Infinity"])
def test_attributes_with_invalid_numbers_are_removed(value):
    top = ElementTree.fromstring('<svg xmlns="http://www.w3.org/2000/svg"><path id="nan" class="inf"/></svg>')
    top[0].set("d", value)
    references.confine(top)
    assert top[0].attrib == {"id": "nan", "class": "inf"}


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("data:;base64,iVBORw0KGgoAAA", "data:image/png;base64,iVBORw0KGgoAAA"),
        ("data:;base64,\n/9j/4AAQ", "data:image/jpeg;base64,/9j/4AAQ"),
        ("data:;base64,PHN2Zz4=", "data:;base64,PHN2Zz4="),
        (RED, RED),
        (AWAY, AWAY),
    ],
)
def test_pictures_of_old_drawings_get_their_kind(address, message):
    assert references.typed(address) == message

"""Tables of points as spreadsheets and statistics programs write them."""

import json

import numpy as np
import pytest

from iccm.errors import InputError
from iccm.io import limits
from iccm.io.geometry import columns, document
from iccm.io.geometry.document import Images


def read(tmp_path, content, suffix=".csv", **options):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return document.read(str(path), **options)


def moved(table):
    """The table with its points moved by 0.5."""
    return table.text(Images(table.geometry.points + 0.5, [], [], True, ".csv"))


@pytest.mark.parametrize(
    "content, delimiter",
    [
        ("name;x;y\na;12,5;-3,25\nb;7;8,0\n", ";"),
        ("12,5;-3,25\n7;8,0\n", ";"),
        ("x\ty\n12,5\t-3,25\n7\t8,0\n", "\t"),
        ("12,5;-3,25;1,5\n7;8,0;2,5\n", ";"),
    ],
)
@pytest.mark.keeps("tables", "delimiter, decimal commas")
def test_decimal_commas_are_read_and_written(tmp_path, content, delimiter):
    table = read(tmp_path, content)
    assert table.delimiter == delimiter and np.array_equal(table.geometry.points, [12.5 - 3.25j, 7 + 8j])
    first = moved(table).splitlines()[bool(table.head)].split(delimiter)
    assert "13,0" in first and "-3,25" in first


@pytest.mark.parametrize(
    "content",
    [
        "x,y\n12.5,-3.25\n",
        "12.5,-3.25\n",
        'x,y,note\n12.5,-3.25,"a;b"\n',
        "x,y,kind;sort\n12.5,-3.25,a;b\n",
        "x;y\n12.5;-3.25\n",
    ],
)
def test_points_stay_points(tmp_path, content):
    table = read(tmp_path, content)
    assert np.array_equal(table.geometry.points, [12.5 - 3.25j])
    assert "13.0" in moved(table)


def test_values_that_are_missing_have_no_place(tmp_path):
    table = read(tmp_path, "x,y\n1,2\nNA,NA\n3,N/A\nnan,4\n,\n5,6\n")
    assert np.isnan(table.geometry.points).tolist() == [False, True, True, True, True, False]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "cp1252"])
def test_encodings_of_spreadsheets(tmp_path, encoding):
    table = read(tmp_path, "name\tx\ty\nM\u00fcnchen\t1.5\t2\n".encode(encoding), ".tsv")
    assert table.rows[0][0] == "M\u00fcnchen" and np.array_equal(table.geometry.points, [1.5 + 2j])


NAMED = [
    ("cell,cx,cy", "cx cy"),
    ("Image,Name,Centroid X µm,Centroid Y µm", "2 3"),
    ("Centroid X px,Centroid Y px,Centroid X µm,Centroid Y µm", "0 1"),
    ("label,centroid-0,centroid-1", "2 1"),
    ("index,axis-0,axis-1,axis-2", "3 2"),
    ("LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,POSITION_Z,FRAME", "3 4"),
    ("name,lat,lon", "2 1"),
    ("decimalLatitude,decimalLongitude,year", "1 0"),
    ("Easting,Northing,Height", "0 1"),
    ("ImageNumber,Location_Center_X,Location_Center_Y,AreaShape_Area", "1 2"),
    ("AreaShape_BoundingBoxMinimum_X,AreaShape_BoundingBoxMinimum_Y,AreaShape_Center_X,AreaShape_Center_Y", "2 3"),
    (" ,Area,XM,YM", "2 3"),
    ("cell_id,x_centroid,y_centroid,transcript_counts", "1 2"),
    ("in_tissue,array_row,array_col,pxl_row_in_fullres,pxl_col_in_fullres", "4 3"),
    ("frame,x [nm],y [nm],sigma [nm]", "1 2"),
    ("transcript_id,x_location,y_location", "1 2"),
    ("FID,POINT_X,POINT_Y", "1 2"),
    ("velocity_x,velocity_y,pos_x,pos_y", "2 3"),
]  # fmt: skip


@pytest.mark.parametrize(("head", "columns"), NAMED)
def test_coordinates_are_found_by_the_names_of_columns(tmp_path, head, columns):
    names = head.split(",")
    row = ",".join(str(k + 1) for k in range(len(names)))
    x, y = (names.index(word) if word in names else int(word) for word in columns.split())
    table = read(tmp_path, f"{head}\n{row}\n")
    assert table.columns == (x, y) and table.geometry.points == [complex(x + 1, y + 1)]


@pytest.mark.parametrize(
    ("content", "columns", "guessed"),
    [
        ("name,a,b\np,1,2\n", (1, 2), True),
        ("id,a,b\n1,10,20\n", (1, 2), True),
        ("1,10,20\n2,30,40\n3,30,41\n", (1, 2), True),
        ("10,20\n30,40\n", (0, 1), False),
        ("x,y\n10,20\n", (0, 1), False),
        ("Label,X,Y,XM,YM\na,1,2,3,4\n", (1, 2), True),
    ],
)
def test_an_id_is_not_a_coordinate_and_a_guess_is_noted(tmp_path, content, columns, guessed):
    table = read(tmp_path, content)
    assert table.columns == columns and bool(table.notes) == guessed


@pytest.mark.parametrize("content", ["cell,a,b,c\n40,60,30,1\n", "p,q,r,s\n1,2,3,4\n", "id,count\n1,2\n"])
def test_columns_that_cannot_be_known_are_asked_for(tmp_path, content):
    with pytest.raises(InputError, match="--columns"):
        read(tmp_path, content)


TRACKMATE = (
    "LABEL,ID,POSITION_X,POSITION_Y\nLabel,Spot ID,X,Y\nLabel,Spot ID,X,Y\n,,(micron),(micron)\nID1,7,60,30\n"
)


@pytest.mark.keeps("tables", "rows of units, comments")
def test_rows_of_units_and_comments_are_kept(tmp_path):
    table = read(tmp_path, TRACKMATE)
    assert table.unit == "micron" and table.geometry.points == [60 + 30j]
    assert moved(table) == TRACKMATE.replace("60,30", "60.5,30.0")
    content = "# saved by a program\n# y x\n4 5\n".replace(" ", ",")
    table = read(tmp_path, content.replace("#,y,x", "#y,x"))
    assert moved(table).splitlines()[:2] == ["#,saved,by,a,program", "#y,x"]
    assert table.geometry.points == [5 + 4j]


@pytest.mark.parametrize(
    "titles",
    [
        " \nPosition\n====================\n",  # Imaris
        "scorer,net,net,net\nbodyparts,nose,nose,nose\n",  # DeepLabCut
    ],
)
@pytest.mark.keeps("tables", "titles above the names of columns")
def test_titles_above_the_names_of_columns_are_kept(tmp_path, titles):
    table = read(tmp_path, titles + "coords,x,y,likelihood\n0,3,4,0.9\n")
    assert table.geometry.points == [3 + 4j] and len(table.rows) == 1
    assert moved(table) == titles + "coords,x,y,likelihood\n0,3.5,4.0,0.9\n"


@pytest.mark.keeps("tables", "Excel's line that names the delimiter")
def test_the_line_by_which_excel_knows_the_delimiter_is_kept(tmp_path):
    content = "sep=;\r\nName;X;Y\r\na,b;12,5;3\r\n"
    table = read(tmp_path, content)
    assert table.geometry.points == [12.5 + 3j]
    assert moved(table) == content.replace("12,5;3", "13,0;3,0")


@pytest.mark.keeps("tables", "all columns")
@pytest.mark.loses("tables", "quotes that are not needed; places in other columns stay as they are")
def test_other_columns_stay_as_they_are(tmp_path):
    content = 'Name,X,Y,BX,BY\n"a",12,3,10,1\n"b, c",13,4,11,2\n'
    table = read(tmp_path, content)
    assert moved(table) == 'Name,X,Y,BX,BY\na,12.5,3.0,10,1\n"b, c",13.5,4.0,11,2\n'


@pytest.fixture
def squares(tmp_path, monkeypatch, iccm):
    """A map that shifts and doubles: from a square of 50 mm onto one of 100 mm at (40, 20)."""
    monkeypatch.chdir(tmp_path)
    svg = '<svg xmlns="http://www.w3.org/2000/svg" {}><path d="{}"/></svg>'
    (tmp_path / "a.svg").write_text(
        svg.format('width="50mm" height="40mm" viewBox="0 0 100 80"', "M0 0H100V80H0Z")
    )
    (tmp_path / "b.svg").write_text(
        svg.format('width="240mm" height="180mm" viewBox="0 0 240 180"', "M40 20H240V180H40Z")
    )
    assert iccm("map", "a.svg", "b.svg", "-o", "m.npz").code == 0
    return tmp_path


@pytest.mark.parametrize(
    ("more", "row", "expected"),
    [
        ((), "10,20", (60, 60)),
        (("--pixel-size", "0.5"), "5,10", (30, 30)),
        (("--unit", "mm"), "5,10", (60, 60)),
        (("--unit", "cm"), ".5,1", (6, 6)),
    ],
)
def test_units_and_pixel_sizes_convert_coordinates(squares, iccm, more, row, expected):
    (squares / "t.csv").write_text(f"id,x_um,y_um\n9,{row}\n")
    result = iccm("apply", "m.npz", "t.csv", *more, "-o", "o.csv")
    assert result.code == 0 and ("--pixel-size" in result.err) == (not more)
    cells = (squares / "o.csv").read_text().splitlines()[1].split(",")
    assert cells[0] == "9" and np.allclose([float(cell) for cell in cells[1:]], expected, atol=1e-6)


def test_counts_are_those_of_the_rows_that_are_written(squares, iccm):
    (squares / "t.csv").write_text("id,x,y\n1,50,40\n2,NA,NA\n3,,\n4,500,40\n")
    result = iccm("apply", "m.npz", "t.csv", "-o", "o.csv", "--report", "r.json")
    assert result.code == 0 and "carried 1 point" in result.err and "2 without a position" in result.err
    assert len((squares / "o.csv").read_text().splitlines()) == 2
    report = json.loads((squares / "r.json").read_text())
    assert report["points"] == 4 and report["written"]["points"] == 1


def test_names_of_columns_are_paired_as_if_all_were_compared():
    random = np.random.default_rng(78)
    words = [
        "x",
        "y",
        "cx",
        "cy",
        "xpos",
        "ypos",
        "position",
        "Width",
        "pos_x",
        "pos_y",
        "(mm)",
        "lon",
        "lat",
        "t",
    ]
    for _ in range(300):
        head = [" ".join(random.choice(words, random.integers(0, 4))) for _ in range(random.integers(1, 9))]
        split = [columns._words(name) for name in head]
        pairs = sorted(
            (kind, i, j)
            for i, first in enumerate(split)
            for j, second in enumerate(split)
            if i != j
            and columns.unit_of(head[i]) == columns.unit_of(head[j])
            and (kind := columns._kind(first, second)) is not None
        )
        chosen = columns.of_names(head)
        assert (chosen is None) == (not pairs), head
        if chosen is not None:
            assert (chosen.x, chosen.y) == pairs[0][1:], head
            several = len(pairs) > 1 and pairs[1][0] == pairs[0][0]
            assert several == ("are kept as they are" in chosen.note), head


@pytest.mark.parametrize("name", ["", "x", "x position", "a b c"])
def test_tables_of_many_columns_are_read(tmp_path, name):
    head = ",".join([name] * 20_000)
    assert read(tmp_path, f"{head}\n1,2\n").geometry.points.tolist() == [1 + 2j]
    table = read(tmp_path, f"{head},gx,gy\n{',' * 20_000}3,4\n", columns="gx,gy")
    assert table.geometry.points.tolist() == [3 + 4j]


@pytest.mark.parametrize("row", ["# a comment", "4", "", "x"])
def test_rows_that_are_shorter_than_the_first_end_in_a_line(tmp_path, row):
    try:
        read(tmp_path, f'"a",1,2,3\n"b",2,3,4\n{row}\n"c",3,4,5\n')
    except InputError as error:
        assert "row" in str(error) or "column" in str(error)


@pytest.mark.parametrize("cells", [("{0},2,3", "3,4,5"), ("1,2,3", "{0},3,4"), ("1,{0},3", "2,3,4")])
def test_numbers_of_thousands_of_digits_in_tables_are_no_error_of_ours(tmp_path, cells):
    digits = "9" * 5000
    with pytest.raises(InputError, match="not finite"):
        read(tmp_path, "\n".join(cells).format(digits))
    with pytest.raises(InputError, match="no column"):
        read(tmp_path, "1,2\n3,4\n", columns=f"{digits},1")


def test_a_table_with_more_columns_than_the_limit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "TABLE_COLUMNS", 5)
    assert read(tmp_path, "x,y,a,b,c\n1,2\n").geometry.points.tolist() == [1 + 2j]
    with pytest.raises(InputError, match="6 columns"):
        read(tmp_path, "x,y,a,b,c\n1,2,3,4,5,6\n")

"""The server: access control, answers, and lifetime."""

import json
import os
import struct
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from iccm.io.edit import routes
from iccm.io.edit.workspace import KEPT_DAYS, EditedFiles, remove_old_copies

pytestmark = pytest.mark.usefixtures("solve_once")

PORT, TOKEN = 4321, "a-token"
HERE = {"origin": f"http://127.0.0.1:{PORT}"}
SCENE = {"pins": [{"source": [40, 45], "target": [45, 50]}]}


@pytest.fixture
def gone():
    return threading.Event()


@pytest.fixture
def client(shapes, gone):
    workspace = EditedFiles(source="square.svg", target="blob.svg")
    application = routes.app(workspace, TOKEN, PORT, gone.set, grace=0.05)
    with TestClient(application, base_url=f"http://127.0.0.1:{PORT}") as test_client:
        test_client.session = workspace.session
        yield test_client


def linked(client, headers=HERE):
    return client.websocket_connect(f"ws://127.0.0.1:{PORT}/{TOKEN}/link", headers=headers)


def map_of(socket):
    """Return the next message with a map: its head and its patches."""
    data = socket.receive_bytes()
    length = struct.unpack("<I", data[:4])[0]
    assert (4 + length) % 4 == 0
    return json.loads(data[4 : 4 + length]), np.frombuffer(data[4 + length :], "<f4").reshape(-1, 18)


def asked(socket, **message):
    socket.send_json({"id": 7, **message})
    message = socket.receive()
    while "bytes" in message:  # of a map
        message = socket.receive()
    answer = json.loads(message["text"])
    assert answer["type"] == "answer" and answer["id"] == 7
    return answer


@pytest.mark.parametrize("name", ["", "app.js", "style.css", "gl.js", "texture.png"])
def test_its_own_files_are_served_to_who_knows_the_token(client, name):
    response = client.get(f"/{TOKEN}/{name}")
    assert response.status_code == 200 and response.content
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert (
        response.headers["cache-control"] == "no-store"
        and "access-control-allow-origin" not in response.headers
    )
    assert client.get(f"/{TOKEN}/{name}", headers=HERE).status_code == 200


def test_the_page_names_nothing_but_its_own_files():
    text = b"".join(content for content, _ in routes.page_files().values()).decode()
    assert "//" not in text.replace("http://www.w3.org/", "").replace("// ", "").replace("///", "")
    for name in ("app.js", "style.css", "icon.svg"):
        assert f'"{name}"' in text and name in routes.page_files()


@pytest.mark.parametrize(
    "path",
    ["/", "/app.js", "/other/", "/other/app.js",
     f"/{TOKEN[:-1]}/", f"/{TOKEN}x/", f"//{TOKEN}/", f"/{TOKEN.upper()}/", "/é/"],
)  # fmt: skip
def test_without_the_token_nothing_is(client, path):
    assert client.get(path).status_code == 403


@pytest.mark.parametrize(
    "name",
    ["../server.py", "..%2fserver.py", "%2e%2e/server.py", "../../../../etc/passwd", "server.py", "page/app.js",
     "app.js/", "//etc/passwd", "app.js%00.png", "link"],
)  # fmt: skip
def test_nothing_else_is_a_file(client, name):
    assert client.get(f"/{TOKEN}/{name}").status_code in (403, 404)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH"])
def test_nothing_is_taken_by_http(client, method):
    assert client.request(method, f"/{TOKEN}/app.js").status_code == 405


@pytest.mark.parametrize(
    "headers",
    [{"origin": "http://evil.example"}, {"origin": "null"}, {"origin": f"https://127.0.0.1:{PORT}"},
     {"origin": "http://127.0.0.1:1"}, {"host": "evil.example"}, {"host": f"evil.example:{PORT}"},
     {"sec-fetch-site": "cross-site"}, {"sec-fetch-site": "same-site"}],
)  # fmt: skip
def test_other_pages_get_nothing(client, headers):
    assert client.get(f"/{TOKEN}/app.js", headers=headers).status_code == 403
    with pytest.raises(WebSocketDisconnect), linked(client, {**HERE, **headers}):
        pass


def test_a_conversation_needs_an_origin(client):
    with pytest.raises(WebSocketDisconnect), linked(client, {}):
        pass


def test_a_map_is_made_followed_and_placed_on(client):
    with linked(client) as socket:
        hello = socket.receive_json()
        assert hello["source"]["name"] == "square.svg" and hello["scene"]["pins"] == []
        socket.send_json({"type": "solve", "seq": 1, "scene": {}})
        head, patches = map_of(socket)
        assert (head["kind"], head["seq"], head["ok"]) == ("full", 1, True) and len(patches) > 1000
        assert head["command"] == "iccm map square.svg blob.svg -o square-blob.png"
        socket.send_json({"type": "follow", "seq": 2, "scene": SCENE})
        head, coarse = map_of(socket)
        assert (head["kind"], head["seq"]) == ("coarse", 2) and 100 < len(coarse) <= len(patches)
        [point] = asked(socket, type="place", side="source", points=[[40, 45]])["points"]
        assert np.hypot(point[0] - 45, point[1] - 50) < head["patches"][0]["tolerance"]
        assert "outside" in asked(socket, type="place", side="source", points=[[0, 0]])["error"]
        socket.send_json(
            {"type": "solve", "seq": 3, "scene": {"pins": [{"source": [0, 0], "target": [45, 50]}]}}
        )
        head = socket.receive_json()
        assert (head["type"], head["kind"], head["wrong"]["pins"]) == ("map", "error", [0])


def test_bad_messages_are_answered_and_change_nothing(client):
    with linked(client) as socket:
        socket.receive_json()
        for text in ("", "{", "[]", '{"type": "open", "path": "/etc/passwd"}', "\0", "[" * 5000):
            socket.send_text(text)
            answer = socket.receive_json()
            assert answer["type"] == "error" and "invalid message" in answer["message"]
        socket.send_json({"type": "solve", "seq": 1, "scene": {}})
        assert map_of(socket)[0]["ok"]


@pytest.mark.slow
def test_files_are_written_when_asked_and_replaced_when_confirmed(client, shapes):
    with linked(client) as socket:
        socket.receive_json()
        before = {path.name for path in shapes.iterdir()}
        (shapes / "c.json").write_text("mine")
        save = {"type": "save", "scene": SCENE, "name": "c.json"}
        assert asked(socket, **save)["exists"] == ["c.json"] and (shapes / "c.json").read_text() == "mine"
        answer = asked(socket, **save, replace=True)
        assert answer["written"] == ["c.json"] and "--constraints c.json" in answer["command"]
        assert asked(socket, **save)["written"] == ["c.json"]
        assert asked(socket, type="draw", scene=SCENE, name="-p")["written"] == ["square-p.svg", "blob-p.svg"]
        export = {"type": "export", "scene": SCENE, "size": 40}
        assert asked(socket, **export, name="o.png")["written"] == ["o.png"]
        assert "suffix" in asked(socket, **export, name="o.xyz")["error"]
        assert "folder" in asked(socket, **export, name="../o.png")["error"]
        for name in ("o.xyz", "o", ".o.png", "../o.png", "o.glb", "o.json"):  # no command that would fail
            answer = asked(socket, **export, name=name, write=False)
            assert answer["error"] and "command" not in answer
        answers = [asked(socket, **export, name=name, write=False) for name in ("o.png", "o.svg")]
        assert [answer["sized"] for answer in answers] == [True, False]  # a drawing has no pixels
        assert ["--size 40" in answer["command"] for answer in answers] == [True, False]
        paths = {"c.json", "square-p.svg", "blob-p.svg", "o.png"}
        assert {path.name for path in shapes.iterdir()} == before | paths


@pytest.mark.slow
def test_a_page_that_is_loaded_again_has_what_was_there(client, gone):
    with linked(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "solve", "seq": 1, "scene": SCENE})
        map_of(socket)
    with linked(client) as socket:
        hello = socket.receive_json()
        assert hello["scene"]["pins"][0]["target"] == [45, 50] and hello["saved"]["pins"] == []


def test_the_newest_page_edits_and_the_other_takes_over_when_asked(client, gone):
    with linked(client) as first:
        first.receive_json()
        with linked(client) as second:
            second.receive_json()
            assert first.receive_json() == {"type": "taken"}
            second.send_json({"type": "solve", "seq": 1, "scene": SCENE})
            assert map_of(second)[0]["ok"]
            first.send_json({"type": "solve", "seq": 9, "scene": {}})  # nobody listens
            first.send_json({"type": "take"})
            while "bytes" in (message := second.receive()) or "taken" not in message["text"]:
                pass  # of the map
            hello = first.receive_json()
            assert hello["type"] == "hello" and hello["scene"]["pins"][0]["target"] == [45, 50]
        assert not gone.wait(0.2)  # the first one is open
        first.send_json({"type": "solve", "seq": 2, "scene": {}})
        assert map_of(first)[0]["ok"]
    assert gone.wait(5)


def test_the_file_to_download_is_the_one_that_the_command_writes(client, shapes, iccm):
    ask = {"scene": {}, "name": "square-blob.png", "size": 64}
    answer = client.post(f"/{TOKEN}/export", json=ask, headers=HERE)
    assert (
        answer.headers["x-file-name"] == "square-blob.png" and answer.headers["content-type"] == "image/png"
    )
    assert iccm("map", "square.svg", "blob.svg", "--size", "64", "-o", "written.png").code == 0
    assert answer.content == (shapes / "written.png").read_bytes()
    assert not (shapes / "square-blob.png").exists()
    drawn = client.post(f"/{TOKEN}/export", json={**ask, "name": "a.svg"}, headers=HERE)
    assert drawn.headers["content-type"].startswith("image/svg+xml") and b"<svg" in drawn.content
    wrong = client.post(f"/{TOKEN}/export", json={**ask, "name": "../a.png"}, headers=HERE).json()
    assert "../a.png" in wrong["error"]


@pytest.mark.slow
def test_notes_on_a_file_to_download_come_with_it(shapes, gone):
    line = '<path transform="scale(1 .4)" d="M20 50L70 160" stroke="red" stroke-width="3"/>'
    drawing = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><path d="M10 10H90V80H10Z"/>{line}</svg>'
    (shapes / "lined.svg").write_text(drawing)
    workspace = EditedFiles(source="lined.svg", target="blob.svg")
    application = routes.app(workspace, TOKEN, PORT, gone.set, grace=0.05)
    with TestClient(application, base_url=f"http://127.0.0.1:{PORT}") as client:
        notes = {}
        for name in ("a.svg", "a.png"):
            ask = {"scene": {}, "name": name, "size": 64}
            answer = client.post(f"/{TOKEN}/export", json=ask, headers=HERE)
            notes[name] = json.loads(unquote(answer.headers["x-notes"]))
    assert any("constant width" in note for note in notes["a.svg"])
    assert not any("constant width" in note for note in notes["a.png"])


def test_it_ends_when_the_page_is_closed_and_not_while_it_is_loaded_again(client, gone):
    assert not gone.is_set()
    with linked(client) as socket:
        socket.receive_json()
        assert not gone.wait(0.2)
    with linked(client) as socket:
        socket.receive_json()
        assert not gone.wait(0.2)


def test_a_page_that_was_asked_for_is_waited_for(client, gone):
    with linked(client) as socket:
        socket.receive_json()
        client.get(f"/{TOKEN}/", headers=HERE)  # a browser requests the page before it leaves the present one
    assert not gone.wait(0.5)
    with linked(client) as socket:
        socket.receive_json()
    assert gone.wait(5)


def test_a_mistake_of_ours_does_not_end_the_page(client, monkeypatch):
    monkeypatch.setattr(client.session, "answer", lambda scene, **_: 1 / 0)
    with linked(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "solve", "seq": 1, "scene": {}})
        message = socket.receive_json()
        assert (message["type"], message["kind"]) == ("map", "error") and "internal error" in message[
            "message"
        ]
        assert "points" not in asked(socket, type="place", side="source", points=[[40, 45]])


def started(shapes, *options, browser=False):
    # a shell's background job ignores SIGINT, and so would processes started here
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{heard}; from iccm.cli import main; main()"]
    options = options if browser else ("--no-browser", *options)
    return subprocess.Popen([*command, "edit", "square.svg", "blob.svg", *options],
                            cwd=shapes, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize(("number", "code"), [(2, 130), (15, 143)])
def test_the_command_serves_this_machine_alone_until_a_signal(shapes, number, code):
    process = started(shapes)
    try:
        address = process.stdout.readline().strip()
        assert address.startswith("http://127.0.0.1:") and len(address.split("/")[3]) >= 32
        assert b"iccm edit" in urllib.request.urlopen(address).read()
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address.rsplit("/", 2)[0] + "/")
        busy = started(shapes, "--port", address.split("/")[2].split(":")[1])
        out, err = busy.communicate(timeout=60)
        assert (
            busy.returncode == 2
            and not out
            and err.startswith("error: --port ")
            and len(err.splitlines()) == 1
        )
        process.send_signal(number)
        _, err = process.communicate(timeout=30)
        assert process.returncode == code and len(err.split("\n\n")[-1].strip().splitlines()) == 1
    finally:
        process.kill()


OTHER_USER = """
import json, os, re, sys
readable = {}
for process in filter(str.isdigit, os.listdir("/proc")):
    try:
        with open(f"/proc/{process}/cmdline", "rb") as file:
            readable[process] = os.fsdecode(file.read())
    except OSError:
        continue
for name in re.findall(r"file://([^\\0\\s]+)", " ".join(readable.values())):
    try:
        with open(name) as file:
            readable[name] = file.read()
    except OSError as error:
        readable[name] = type(error).__name__
json.dump(readable, sys.stdout)
"""
"""Prints the command lines of all processes, and the files that these name as addresses."""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="command lines are read from /proc")
def test_no_other_user_can_read_the_address_of_the_page(shapes, tmp_path, monkeypatch):
    opened, browser = tmp_path / "opened", tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}.part\nmv {opened}.part {opened}\nsleep 60\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s &")
    process = started(shapes, browser=True)
    try:
        address = process.stdout.readline().strip()
        token = address.split("/")[3]
        for _ in range(600):
            if opened.exists():
                break
            time.sleep(0.05)
        page = Path(unquote(opened.read_text().strip().removeprefix("file://")))
        is_root = os.getuid() == 0  # otherwise the command lines alone are compared
        nobody = {"user": 65534, "group": 65534, "extra_groups": []} if is_root else {}
        spy = ["/usr/bin/python3" if is_root else sys.executable, "-c", OTHER_USER]
        readable = json.loads(subprocess.run(spy, capture_output=True, check=True, **nobody).stdout)
        assert any("iccm-edit.html" in line for line in readable.values())
        found = [name for name, content in readable.items() if token in content]
        assert not found or (not is_root and found == [str(page)])
        assert page.stat().st_mode & 0o777 == 0o600 and page.parent.stat().st_mode & 0o777 == 0o700
        assert address in page.read_text()
        assert urllib.request.urlopen(address).status == 200 and not page.exists()
    finally:
        process.terminate()
        process.wait(timeout=30)
    assert not page.parent.exists()


def test_a_visit_from_the_file_of_the_browser_gets_the_page_and_nothing_else(client):
    visit = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    assert client.get(f"/{TOKEN}/", headers=visit).status_code == 200
    assert client.get("/other/", headers=visit).status_code == 403
    for path in ("app.js", "workspace", "texture.png"):
        assert client.get(f"/{TOKEN}/{path}", headers=visit).status_code == 403
    for changed in ({"sec-fetch-dest": "iframe"}, {"sec-fetch-mode": "no-cors"}, {"origin": "null"}):
        assert client.get(f"/{TOKEN}/", headers={**visit, **changed}).status_code == 403


def test_without_the_extra_one_line_says_so(shapes, iccm, monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets", None)
    typed = iccm("edit", "square.svg", "blob.svg")
    assert typed.code == 2 and len(typed.lines) == 1 and "pip install 'iccm[edit]'" in typed.lines[0]


@pytest.mark.slow
def test_what_was_let_go_of_is_solved_however_many_drags_came_before(client):
    with linked(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "solve", "seq": 1, "scene": {}})
        map_of(socket)
        for k in range(1, 4):  # all at once, like a page
            for j in range(5):
                moved = {"pins": [{"source": [40, 45], "target": [45 + 0.2 * j + 0.1 * k, 50]}]}
                socket.send_json({"type": "follow", "seq": 100 * k + j, "scene": moved})
            socket.send_json({"type": "solve", "seq": 100 * k + 9, "scene": moved})
            heads = [map_of(socket)[0]]
            while heads[-1]["kind"] != "full":
                heads.append(map_of(socket)[0])
            assert heads[-1]["seq"] == 100 * k + 9 and heads[-1]["ok"]


def test_files_that_were_chosen_are_opened_and_no_others(shapes, state):
    workspace = EditedFiles()
    with TestClient(
        routes.app(workspace, TOKEN, PORT, lambda: None), base_url=f"http://127.0.0.1:{PORT}"
    ) as client:
        with linked(client) as socket:
            assert socket.receive_json()["empty"] and client.get(f"/{TOKEN}/texture.png").status_code == 404
        names = {}
        for role, name in (("source", "square.svg"), ("target", "other.svg")):
            content = (shapes / "square.svg").read_bytes() + b"\n" * (role == "target")
            response = client.put(f"/{TOKEN}/files/{name}?role={role}", content=content).json()
            assert len(response["parts"]) == 1
            names[role] = response["path"]
        assert (
            names["source"] == "square.svg" and str(state) in names["target"]
        )  # the one in this folder, unchanged
        opened = client.post(f"/{TOKEN}/workspace", json=names | {"target": str(shapes / "blob.svg")}).json()
        assert "choose this file again" in opened["error"] and workspace.session is None
        assert "source" in client.post(f"/{TOKEN}/workspace", json={"target": "square.svg"}).json()["error"]
        assert client.post(f"/{TOKEN}/workspace", json=names).json() == {}
        with linked(client) as socket:
            assert socket.receive_json()["source"]["name"] == "square.svg"
        assert client.post(f"/{TOKEN}/workspace", json=[1]).status_code == 400
        for name in (".hidden.svg", "-x.svg", "a%0Ab.svg"):
            assert "error" in client.put(f"/{TOKEN}/files/{name}", content=b"x").json()
        wrong = client.put(f"/{TOKEN}/files/broken.svg?role=source", content=b"<svg").json()
        assert "broken.svg" in wrong["error"]
        assert (
            client.put(
                f"/{TOKEN}/files/a.svg", content=b"", headers={"origin": "http://evil.example"}
            ).status_code
            == 403
        )


def test_copies_of_files_are_removed_when_they_are_old_and_never_what_is_the_users(shapes, state):
    old = Path(EditedFiles().put("old.svg", b"old"))
    opened, changed = (Path(EditedFiles().put(name, name.encode())) for name in ("opened.svg", "changed.svg"))
    changed.write_bytes(b"drawn on")
    beside, users_file = old.parent / "notes.txt", shapes / "old.svg"
    for path in (beside, users_file):
        path.write_bytes(b"old" if path is users_file else b"mine")
    past = time.time() - (KEPT_DAYS + 1) * 86400
    for path in (old, opened, changed, beside, users_file):
        os.utime(path, (past, past))
    assert EditedFiles().put("opened.svg", b"opened.svg") == str(opened)
    remove_old_copies()
    assert not old.exists() and all(path.exists() for path in (opened, changed, beside, users_file))
    remove_old_copies(time.time() + (KEPT_DAYS + 1) * 86400)
    assert not opened.parent.exists() and changed.exists()


@pytest.mark.parametrize("empty", [False, True])
def test_bytes_end_the_conversation_with_a_code(shapes, gone, empty):
    workspace = EditedFiles() if empty else EditedFiles(source="square.svg", target="blob.svg")
    with TestClient(
        routes.app(workspace, TOKEN, PORT, gone.set), base_url=f"http://127.0.0.1:{PORT}"
    ) as client:
        with linked(client) as socket:
            assert socket.receive_json()["type"] == "hello"
            socket.send_bytes(b"\0\1\2")
            with pytest.raises(WebSocketDisconnect) as closed:
                while True:
                    socket.receive_bytes()
        assert closed.value.code == 1003
        with linked(client) as socket:  # the next page is served as ever
            assert socket.receive_json()["type"] == "hello"


def test_what_nobody_can_mean_is_refused_as_the_clients_mistake(client):
    assert client.put(f"/{TOKEN}/files/{'a' * 300}.svg", content=b"x").status_code == 400
    assert client.put(f"/{TOKEN}/files/a%00b.svg", content=b"x").status_code < 500
    for content in (b"[" * 100_000, b'{"a":' * 5000, b"\xff", b"3", b'{"source": 3}'):
        assert client.post(f"/{TOKEN}/workspace", content=content).status_code == 400, content[:9]
    assert client.post(f"/{TOKEN}/workspace", content=b" " * (1 << 23)).status_code == 413
    with linked(client) as socket:
        socket.receive_json()
        socket.send_text("[" * 100_000)
        assert socket.receive_json()["type"] == "error"


@pytest.mark.parametrize("place", ["v3", [1, 2, 3]])
def test_pins_of_meshes_are_refused_on_drawings(client, place, shapes):
    scene = {"pins": [{"source": [40, 45], "target": place}]}
    with linked(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "solve", "seq": 1, "scene": SCENE})
        assert map_of(socket)[0]["type"] != "error"
        for message in (
            {"type": "draw", "scene": scene, "name": "-pinned"},
            {"type": "export", "scene": scene, "name": "o.png", "size": 16},
            {"type": "place", "side": "target", "points": [place]},
        ):
            error = asked(socket, **message).get("error", "")
            assert error and "internal" not in error, (message["type"], error)
    assert not list(shapes.glob("*-pinned*"))


def test_the_files_to_choose_are_those_that_can_be_read():
    """The page has no separate list: a format that is added to the table is offered."""
    suffixes = EditedFiles().describe()["suffixes"]
    for role in ("source", "target"):
        assert {".svg", ".glb", ".stl", ".png"} <= set(suffixes[role])
        assert not {".npz", ".toml"} & set(suffixes[role])
    assert ".exr" in suffixes["texture"] and ".obj" not in suffixes["texture"]
    text = b"".join(content for content, _ in routes.page_files().values())
    assert b".stl" not in text and b".exr" not in text.replace(b".stmap.exr", b"")


@pytest.mark.slow
def test_a_change_that_arrives_as_a_solve_begins_is_answered(client, monkeypatch):
    session, answer = client.session, client.session.answer
    begun, changed = threading.Event(), threading.Event()

    def late(scene, **how):
        """Begin when the next change has arrived."""
        begun.set()
        while not changed.is_set() and session.scene is scene:
            time.sleep(0.001)
        changed.set()
        return answer(scene, **how)

    with linked(client) as socket:
        socket.receive_json()
        socket.send_json({"type": "solve", "seq": 1, "scene": {}})
        map_of(socket)
        monkeypatch.setattr(session, "answer", late)
        socket.send_json({"type": "solve", "seq": 2, "scene": {"balance": 2}})
        assert begun.wait(20)
        socket.send_json({"type": "solve", "seq": 3, "scene": {"balance": 3}})
        head, _ = map_of(socket)
        assert (head["kind"], head["seq"], head["ok"]) == ("full", 3, True) and session.scene.balance == 3


@pytest.mark.slow
def test_a_better_map_is_shown_while_the_hand_rests_and_is_what_it_releases(client, monkeypatch):
    monkeypatch.setattr("iccm.io.edit.link.IDLE_SECONDS", 0.0)
    monkeypatch.setattr("iccm.io.edit.session.same", lambda one, other: False)
    monkeypatch.setattr("iccm.io.edit.session.NOTABLE_COST_RATIO", 0.0)
    moved = {"pins": [{"source": [40, 45], "target": [52, 47]}]}
    with linked(client) as socket:
        socket.receive_json()
        for seq, asking in enumerate(({}, SCENE), start=1):
            socket.send_json({"type": "solve", "seq": seq, "scene": asking})
            map_of(socket)
        socket.send_json({"type": "follow", "seq": 3, "scene": moved})
        socket.send_json({"type": "solve", "seq": 4, "scene": moved, "hand": "resting"})
        (head, patches), seen = map_of(socket), []
        while head["kind"] != "full" or head["other"] != "kept":
            seen.append(head["kind"])
            head, patches = map_of(socket)
        assert "full" in seen and head["seq"] == 4 and len(patches) > 1000
        socket.send_json({"type": "solve", "seq": 5, "scene": moved, "way": "fresh", "hand": "released"})
        head = socket.receive_json()  # without patches: the page keeps the map that it shows
        assert (head["kind"], head["seq"], head["ok"], head["other"]) == ("full", 5, True, "kept")

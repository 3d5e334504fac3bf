"""The server of the page on which a mechanism is drawn: whom it answers, what it writes, when it ends; links."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import socket
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from click.testing import CliRunner

import planar
from planar.cli import main
from planar.document.files import read_asset
from planar.document.texts.json_layout import format_json
from planar.document.texts.mechanism_link import read_link, write_link
from planar.foundation.errors import BadInput, NoAnswer
from planar.pages.editor import server as serving
from planar.pages.editor.answer import BLANK, conflict_answer, edit_answer, nearest_places
from planar.pages.editor.authors_file import carry_over
from planar.pages.editor.edit_page import edit_page
from planar.pages.editor.worker import ComputationStopped, Superseded, Worker
from tests.hostile import HARMFUL_LINE, harmful_mechanism
from tests.pencil import served
from tests.watchdog import watched

FOUR_BAR = planar.to_dict("four-bar")


def asked(server, method="POST", what="answer", body=None, token=None, **headers):
    """The status and the body of an answer, to a request that is right but for what is said."""
    line = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    own = {"Host": server.origin.removeprefix("http://"), "Content-Type": "application/json"}
    if method == "POST":
        own["Origin"] = server.origin
    sent = {key: value for key, value in {**own, **headers}.items() if value is not None}
    content = None
    if method == "POST":
        value = {"document": FOUR_BAR} if body is None else body
        content = value if isinstance(value, bytes) else json.dumps(value).encode()
    line.putrequest(method, f"/{token or server.token}/{what}", skip_host=True, skip_accept_encoding=True)
    for key, value in sent.items():
        line.putheader(key.replace("_", "-"), value)
    if content is not None:
        line.putheader("Content-Length", sent.get("Length", str(len(content))))
    line.endheaders(content)
    answer = line.getresponse()
    found = answer.status, answer.read().decode(), answer.headers
    line.close()
    return found


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with served(FOUR_BAR, folder=tmp_path_factory.mktemp("drawn")) as running:
        yield running


def test_it_listens_on_this_machine_alone_and_its_token_cannot_be_guessed(server):
    assert server.server_address[0] == "127.0.0.1"
    assert len(server.token) >= 32
    with served() as other:
        assert other.token != server.token


def test_its_own_page_is_answered_and_kept_by_nobody(server):
    status, text, headers = asked(server, "GET", "")
    assert status == 200
    assert "<h1>Four-bar chain</h1>" in text
    assert headers["Cache-Control"] == "no-store"
    assert headers["X-Frame-Options"] == "DENY"
    assert "Access-Control-Allow-Origin" not in headers
    status, text, _ = asked(server)
    assert status == 200
    assert json.loads(text)["mobility"] == "mobility 1, 1 input"


@pytest.mark.parametrize(
    ("status", "changed"),
    [
        (404, {"token": "guessed"}),
        (404, {"what": "../answer"}),
        (404, {"what": "files"}),
        (403, {"Host": "rebound.example:80"}),
        (403, {"Host": None}),
        (403, {"Origin": "https://other.example"}),
        (403, {"Origin": "null"}),
        (403, {"Origin": None}),
        (403, {"Sec_Fetch_Site": "cross-site"}),
        (403, {"method": "GET", "what": "", "Sec_Fetch_Site": "cross-site"}),
        (403, {"method": "GET", "what": "", "Host": "localhost.other.example"}),
        (404, {"method": "GET", "what": "answer"}),
        (413, {"Length": "99999999999"}),
    ],
)
def test_whoever_else_asks_is_refused_in_a_sentence(server, status, changed):
    changed = dict(changed)
    found, text, _ = asked(server, changed.pop("method", "POST"), changed.pop("what", "answer"), **changed)
    assert found == status
    assert "Traceback" not in text
    assert "Four-bar" not in text


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ({"document": 3}, 200),
        ({"document": {"links": 3}}, 200),
        ([], 400),
        ({"other": 1}, 400),
        (b"", 400),
        (b"{", 400),
        (b'{"document": {}, "name": "\xff\xfe"}', 400),
    ],
)
def test_what_is_no_mechanism_is_told_in_a_sentence(server, body, expected):
    for what in ("answer", "save"):
        status, text, _ = asked(server, what=what, body=body)
        assert status == expected
        assert json.loads(text)["problem"]


def test_it_writes_only_what_is_saved_and_only_beside(tmp_path):
    path = tmp_path / "own.json"
    written = {"name": "Mine", **{key: value for key, value in FOUR_BAR.items() if key != "name"}}
    path.write_text(json.dumps(written))
    before = path.read_bytes()
    with served(written, path, tmp_path) as server:
        asked(server)
        assert path.read_bytes() == before
        for name in ("../out", "/tmp/out", "a/b.json", "..", "", "a\\b", "a\nb"):
            answer = json.loads(asked(server, what="save", body={"document": written, "name": name})[1])
            assert "name" in answer["problem"]
        (tmp_path / "taken.json").write_text("{}")
        save = {"document": written, "name": "taken", "mark": server.mark}
        assert json.loads(asked(server, what="save", body=save)[1]) == {"taken": "taken.json", "own": False}
        assert (tmp_path / "taken.json").read_text() == "{}"
        assert json.loads(asked(server, what="save", body={"document": {"links": 1}})[1])["problem"]
        assert path.read_bytes() == before
        saved = json.loads(asked(server, what="save", body={"document": written, "mark": server.mark})[1])
        assert saved == {"file": "own.json", "mark": server.mark}
    assert sorted(each.name for each in tmp_path.iterdir()) == ["own.json", "taken.json"]
    assert next(iter(json.loads(path.read_text()))) == "name"
    assert planar.load(path).links == planar.load("four-bar").links


def test_it_ends_when_its_page_is_closed_and_not_when_that_is_loaded_again(monkeypatch):
    with served() as server:
        assert not server.is_over()  # nobody has come yet
        server.hear("one", True)
        monkeypatch.setattr(serving, "CLOSING_PAUSE", -1.0)
        assert not server.is_over()
        server.hear("one", False)
        server.hear("two", True)
        assert not server.is_over()
        monkeypatch.setattr(serving, "SILENCE", -1.0)  # a browser that is gone says nothing
        assert server.is_over()


# what is written


def test_of_two_servers_that_save_at_once_one_writes_and_the_other_is_refused(tmp_path):
    path = tmp_path / "shared.json"
    documents = [FOUR_BAR | {"name": name} for name in ("first", "second")]
    for round_number in range(30):
        path.write_text(json.dumps(FOUR_BAR | {"name": str(round_number)}))
        name = None if round_number % 2 else "new"  # a file that there is already, and one that both begin
        servers = [serving.EditServer(FOUR_BAR, path, tmp_path) for _ in documents]
        barrier = threading.Barrier(2)

        def save(server, document, barrier=barrier, name=name):
            barrier.wait()
            return server.save(document, name, server.mark)

        with ThreadPoolExecutor(2) as pool:
            answers = list(pool.map(save, servers, documents))
        for server in servers:
            server.server_close()
        target = path if name is None else tmp_path / "new.json"
        (accepted,) = [k for k, answer in enumerate(answers) if "file" in answer]
        assert answers[1 - accepted]["taken"] == target.name
        assert json.loads(target.read_text())["name"] == documents[accepted]["name"]
        (tmp_path / "new.json").unlink(missing_ok=True)
    assert [each.name for each in tmp_path.iterdir()] == ["shared.json"]


@pytest.mark.parametrize("name", [5, ["a"], {}, True, "x" * 300, "é" * 130, "\udcff", "a\0b", "", "../a", "a/b"])
def test_what_no_file_can_be_called_is_refused_in_a_sentence(server, name):
    status, text, _ = asked(server, what="save", body={"document": FOUR_BAR, "name": name})
    assert status == 400
    assert json.loads(text)["problem"].startswith("name: ")
    assert list(server.folder.iterdir()) == []


@pytest.mark.parametrize("length", ["9" * 5000, "\u00b2", "-1", "1e3", "", " "])
def test_a_request_whose_length_is_no_number_is_refused_in_a_sentence(server, length):
    status, text, _ = asked(server, Length=length)
    assert status in (400, 413)
    assert len(text.splitlines()) == 1


def test_pipes_folders_and_links_out_of_the_folder_are_not_written(tmp_path):
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    for made in (folder, outside, folder / "sub.json"):
        made.mkdir()
    os.mkfifo(folder / "pipe.json")
    (outside / "there.json").write_text("{}")
    for name, target in {"dangling": outside / "new.json", "live": outside / "there.json", "ring": "ring.json"}.items():
        (folder / f"{name}.json").symlink_to(target)
    (folder / "beside.json").symlink_to("new.json")
    with watched(), served(FOUR_BAR, None, folder) as server:
        for name in ("sub", "pipe", "dangling", "live", "ring"):
            for replaces in (False, True):
                body = {"document": FOUR_BAR, "name": name, "replaces": replaces}
                status, text, _ = asked(server, what="save", body=body)
                assert status == 400, name
                assert json.loads(text)["problem"].startswith("name: ")
        assert server.save(FOUR_BAR, "beside")["file"] == "beside.json"
    assert (folder / "new.json").is_file()
    assert [each.name for each in outside.iterdir()] == ["there.json"]
    assert (outside / "there.json").read_text() == "{}"


def test_a_page_that_is_loaded_again_shows_what_another_server_saved(tmp_path):
    path = tmp_path / "own.json"
    path.write_text(json.dumps(FOUR_BAR))
    with served(FOUR_BAR, path, tmp_path) as server:
        assert "own.json was written by" not in asked(server, "GET", "")[1]
        other = serving.EditServer(FOUR_BAR, path, tmp_path)
        other.save(FOUR_BAR | {"name": "Changed elsewhere"}, None, other.mark)
        other.server_close()
        text = asked(server, "GET", "")[1]
        assert "<h1>Changed elsewhere</h1>" in text
        assert "own.json was written by another window or program" in text
        assert server.mark == serving.file_mark(path)
        server.save(FOUR_BAR, None, server.mark)
        assert "own.json was written by" not in asked(server, "GET", "")[1]
        for broken in ("[", "[1]"):
            path.write_text(broken)
            text = asked(server, "GET", "")[1]
            assert "the page shows the drawing as it was before" in text
            assert "<h1>Four-bar chain</h1>" in text
        path.unlink()
        assert "there is no such file any more" in asked(server, "GET", "")[1]


def test_a_file_whose_name_is_no_text_is_drawn_and_saved(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.json")
    path.write_text(json.dumps(FOUR_BAR))
    with served(FOUR_BAR, path, tmp_path) as server:
        assert "\ufffd.json" in asked(server, "GET", "")[1]
        saved = json.loads(asked(server, what="save", body={"document": FOUR_BAR, "mark": server.mark})[1])
        assert saved["file"] == "\ufffd.json"
    assert path.stat().st_size > 0


# the process that computes


@pytest.fixture(scope="module")
def worker():
    return Worker(int)  # nothing is imported: it starts fast


def interrupted(worker, page):
    """A computation without an end, begun in another thread: its future, once it is computed."""
    pool = ThreadPoolExecutor(1)
    future = pool.submit(worker.compute, time.sleep, 3600, page=page)
    pool.shutdown(wait=False)
    while not worker._turn.locked():
        time.sleep(0.01)
    return future


def test_a_newer_computation_of_a_page_stops_the_older(worker):
    with watched():
        older = interrupted(worker, "one")
        with pytest.raises(ComputationStopped, match="another drawing"):
            worker.compute(abs, -3, page="two", queue_limit=0.1)
        assert worker.compute(abs, -3, page="one") == 3
        with pytest.raises(Superseded):
            older.result()


def test_a_computation_ends_at_its_limit_and_with_its_client(worker):
    with watched():
        with pytest.raises(ComputationStopped, match="more than 0 s"):
            worker.compute(time.sleep, 3600, limit=0.1)
        with pytest.raises(Superseded):
            worker.compute(time.sleep, 3600, has_client=lambda: False)
        assert worker.compute(abs, -3) == 3


def test_what_goes_wrong_in_a_computation_is_a_sentence(worker):
    with watched():
        with pytest.raises(BadInput, match="folders"):
            worker.compute(serving._file_name, "a/b")
        with pytest.raises(ComputationStopped, match="ValueError: invalid literal"):
            worker.compute(int, "three")
        with pytest.raises(ComputationStopped, match="ended without an answer"):
            worker.compute(os._exit, 3)
        assert worker.compute(abs, -3) == 3


def test_the_server_saves_hears_and_sends_its_page_while_it_computes(server):
    with watched():
        older = interrupted(serving.WORKER, "a page")
        text = asked(server, "GET", "")[1]
        assert '"is_pending":true' in text.replace(" ", "")
        assert "<h1>Four-bar chain</h1>" in text
        assert asked(server, what="open", body={"page": "b"})[0] == 200
        saved = json.loads(asked(server, what="save", body={"document": FOUR_BAR, "name": "meanwhile"})[1])
        assert saved["file"] == "meanwhile.json"
        assert not older.done()
        answer = json.loads(asked(server, body={"document": FOUR_BAR, "page": "a page"})[1])
        assert answer["mobility"] == "mobility 1, 1 input"
        with pytest.raises(Superseded):
            older.result()


def test_a_client_that_is_gone_stops_its_computation(server, worker):
    handler = object.__new__(serving._Handler)
    handler.server, (handler.connection, client) = server, socket.socketpair()
    assert handler._has_client()
    client.close()
    with handler.connection, watched(), pytest.raises(Superseded):
        worker.compute(time.sleep, 3600, has_client=handler._has_client)


# searches

WISHED = {
    "planar": 1,
    "name": "Wanted",
    "units": {"length": "mm", "angle": "deg"},
    "start": FOUR_BAR,
    "wanted": [{"point": "E", "through": [[0, 25], [52, 10], [80, 4], [95, -20]], "in_order": True}],
}


def test_a_search_tells_how_far_it_is_and_what_it_has_found_once_it_is_stopped(server):
    told = json.loads(asked(server, what="synthesise", body={"task": WISHED})[1])
    stopped = {"search": told["search"], "stops": True}
    with watched():
        while not told["is_over"]:
            told = json.loads(asked(server, what="search", body=stopped)[1])
    assert "problem" not in told
    assert "the search was interrupted" in told["remarks"][0] or told["designs"]
    other = json.loads(asked(server, what="search", body={"search": told["search"] + 1})[1])
    assert other["is_over"]
    assert other["problem"]


@pytest.mark.parametrize("task", [3, {"wanted": []}, WISHED | {"start": "four-bar"}, WISHED | {"wanted": [{}]}])
def test_what_is_no_task_of_the_drawing_is_not_searched_for(server, task):
    told = json.loads(asked(server, what="synthesise", body={"task": task})[1])
    assert told["problem"].startswith("$.")


def test_a_design_keeps_what_its_author_wrote_and_changes_only_what_differs():
    own = {"name": "Mine", "links": {"b": {"length": "40 mm"}, "a": {"length": 2}}, "notes": [1], "sketch": {"C": 1}}
    before = {"name": "Mine", "links": {"a": {"length": 2.0}, "b": {"length": 4.0}}, "filled": 1, "sketch": {"C": 1}}
    after = {"name": "Mine", "links": {"a": {"length": 3.5}, "b": {"length": 4.0}}, "filled": 1, "sketch": {"D": 5}}
    found = carry_over(own, before, after)
    links = {"b": {"length": "40 mm"}, "a": {"length": 3.5}}
    assert found == {"name": "Mine", "links": links, "notes": [1], "sketch": {"D": 5}}
    assert list(found["links"]) == ["b", "a"]


# answers


def test_what_is_loose_held_twice_and_in_conflict_is_told():
    loose = {**FOUR_BAR, "inputs": []}
    found = edit_answer(loose)
    assert found["loose"] == ["AB", "BC", "DC"]
    assert "give an input at 'A'" in found["problem"]
    assert "data" not in found
    value = planar.to_dict("crank-rocker")
    value["links"]["coupler"]["length"] = 1000
    assert edit_answer(value)["conflicts"]
    found = conflict_answer(value)
    assert "stays open by" in found["problem"]
    assert found["nearest"]["crank"]["A"] == pytest.approx(found["nearest"]["coupler"]["A"], abs=1e-12)
    assert nearest_places(planar.from_dict(FOUR_BAR)) == nearest_places(planar.from_dict(loose)) == {}
    assert any("it goes together with coupler.length" in each for each in found["remedies"])
    assert edit_answer(BLANK)["place"] == "$.links.frame"
    twice = edit_answer(planar.to_dict("three-parallel-cranks"))
    assert "held twice" in twice["mobility"]
    assert twice["data"]


def test_what_is_driven_and_cannot_move_is_told_at_once():
    """A crank's pin in a slot of the frame: nothing moves, and no motion is looked for."""
    value = BLANK | {
        "links": {"frame": {"points": {"A": [0, 0]}}, "AB": {"ends": ["A", "B"], "length": 40}},
        "pairs": [
            {"turning": "A"},
            {"slot": "slot", "links": ["frame", "AB"], "line": {"through": [40, 0], "angle": 45}, "point": "B"},
        ],
        "inputs": [{"pair": "A", "position": 0, "velocity": "10 rad/s"}],
    }
    found = edit_answer(value)
    assert "nothing moves: it is a structure of link 'AB'" in found["problem"]
    assert "remove the input at 'A', or remove pair 'slot'" in found["problem"]
    assert found["mobility"] == "mobility 0, 1 input"
    assert "data" not in found
    with pytest.raises(NoAnswer, match="nothing moves"):
        planar.circuits(planar.from_dict(value))


def test_texts_of_a_file_stay_texts_on_the_page():
    text = edit_page(planar.to_dict(harmful_mechanism()), "<b>.json")
    assert HARMFUL_LINE not in text
    assert "<b>" not in text
    assert text.count("</script>") == edit_page(FOUR_BAR, None).count("</script>")
    assert "connect-src 'self'" in text


# links and texts


def test_a_link_holds_the_whole_file_and_one_cut_short_says_so():
    link = write_link(FOUR_BAR)
    assert json.loads(read_link(link)) == FOUR_BAR
    assert planar.load(link) == planar.load("four-bar")
    assert len(link) < len(json.dumps(FOUR_BAR))
    for broken in (link[:-9], "planar:", "planar:???", f"{link}AAAA&"):
        with pytest.raises(BadInput, match="holds no whole mechanism"):
            read_link(broken)


@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node here to run a page's scripts in")
def test_the_pages_own_links_are_read_by_python():
    text = f"{read_asset('additions/links.js')}\nMechanismLink.write({json.dumps(FOUR_BAR)}).then((link) => "
    text += "{ console.log(link); MechanismLink.read(link).then((file) => console.log(JSON.stringify(file))); });"
    ran = subprocess.run(["node", "-"], input=text, capture_output=True, text=True, check=True, timeout=60)
    link, read = ran.stdout.splitlines()
    assert json.loads(read_link(link)) == json.loads(read) == FOUR_BAR


def test_a_link_is_viewed(tmp_path):
    link = write_link(planar.to_dict("walschaerts-valve-gear"))
    assert len(link) > 255  # no file has so long a name
    (tmp_path / "a.html").touch()
    done = CliRunner().invoke(main, ["view", write_link(FOUR_BAR), "-o", str(tmp_path / "a.html")])
    assert done.exit_code == 0, done.output
    done = CliRunner().invoke(main, ["gallery", link, "-o", str(tmp_path / "pages")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "pages" / "link.html").exists()
    assert "<h1>Four-bar chain</h1>" in (tmp_path / "a.html").read_text(encoding="utf-8")


def test_a_text_keeps_the_order_of_keys_and_short_lists_in_one_line():
    value = {"b": [1, 2.5], "a": {"x" * 60: "y" * 60, "l": [{"m": "n" * 50}, {"o": "p" * 50}]}, "e": {}}
    text = format_json(value)
    assert json.loads(text) == value
    assert list(json.loads(text)) == ["b", "a", "e"]
    assert '"b": [1, 2.5],' in text.splitlines()[1]
    assert max(map(len, text.splitlines())) <= 140


def test_the_command_refuses_what_is_no_mechanism(tmp_path):
    (tmp_path / "list.json").write_text("[1]")
    for model in ("planar:x", str(tmp_path / "list.json"), "no-such-model"):
        done = CliRunner().invoke(main, ["edit", "--no-browser", model])
        assert done.exit_code == 2
        assert "Traceback" not in done.output

"""Files that are written: whole or not at all, whatever stands there, and nothing left beside them."""

import errno
import os
import stat
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

from planar.foundation import safe_files
from planar.foundation.errors import BadInput, WriteFailure
from planar.foundation.safe_files import save_file
from tests.command import run

OLD, NEW = b"the old result", b"new " * 1000
FULL = Path("/dev/full")
full = pytest.mark.skipif(not FULL.exists(), reason="there is no device that is always full")


@contextmanager
def room(most):
    """No file may be longer than so many bytes: more fails as on a full disk."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture
def old(tmp_path):
    """A file that is there, alone in its folder."""
    path = tmp_path / "own" / "result.csv"
    path.parent.mkdir()
    path.write_bytes(OLD)
    return path


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_full_disk_leaves_the_old_file_and_nothing_else(old):
    with room(2000), pytest.raises(WriteFailure, match=r"result\.csv: the file cannot be written: File too large"):
        save_file(old, NEW)
    assert content(old.parent) == {old.name: OLD}
    save_file(old, NEW)
    assert content(old.parent) == {old.name: NEW}


def test_a_full_disk_leaves_no_new_file(tmp_path):
    with room(2000), pytest.raises(WriteFailure):
        save_file(tmp_path / "new.csv", NEW)
    assert content(tmp_path) == {}


@pytest.mark.parametrize(
    "words",
    [
        "solve four-bar -o OUT.txt",
        "solve four-bar -o OUT.html",
        "cycle four-bar --steps 60 -o OUT.csv",
        "cycle four-bar --steps 60 -o OUT.json",
        "cycle four-bar --steps 60 -o OUT.npz",
        "cycle four-bar --steps 60 -o OUT.parquet",
        "plot four-bar scheme -o OUT.svg",
        "plot four-bar scheme -o OUT.pdf",
        "view four-bar -o OUT.html",
    ],
)
def test_no_command_loses_what_an_earlier_one_wrote(words, tmp_path, monkeypatch):
    really = safe_files.write_atomically

    def without_room(path, whole):
        with room(100):  # only here: libraries keep files of their own
            really(path, whole)

    monkeypatch.setattr(safe_files, "write_atomically", without_room)
    name = words.split()[-1]
    (tmp_path / name).write_bytes(OLD)
    sentence = run(tmp_path, *words.split()).refused(3)
    assert f"{name}: the file cannot be written" in sentence
    assert content(tmp_path) == {name: OLD}


def test_what_is_interrupted_leaves_the_old_file_and_nothing_else(old, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        save_file(old, NEW)
    assert content(old.parent) == {old.name: OLD}


@pytest.mark.skipif(os.name != "posix", reason="there are no such permissions")
def test_permissions_stay_and_those_of_a_new_file_are_the_usual_ones(old):
    for mode in (0o640, 0o600, 0o755, 0o666):
        old.chmod(mode)
        save_file(old, NEW)
        assert stat.S_IMODE(old.stat().st_mode) == mode
    before = os.umask(0o027)
    try:
        save_file(old.with_name("new.csv"), NEW)
    finally:
        os.umask(before)
    assert stat.S_IMODE(old.with_name("new.csv").stat().st_mode) == 0o640


def test_what_may_not_be_written_is_refused(old, monkeypatch):
    old.chmod(0o444)
    monkeypatch.setattr(os, "access", lambda path, what: what != os.W_OK)  # root may write anywhere
    with pytest.raises(BadInput, match="Permission denied") as refused:
        save_file(old, NEW)
    assert not isinstance(refused.value, WriteFailure)
    assert content(old.parent) == {old.name: OLD}


def test_a_link_stays_one_and_what_it_leads_to_is_written(old, tmp_path):
    first, second, nowhere = tmp_path / "first.csv", tmp_path / "second.csv", tmp_path / "nowhere.csv"
    first.symlink_to("second.csv")
    second.symlink_to(old)
    nowhere.symlink_to("own/new.csv")
    save_file(first, NEW)
    save_file(nowhere, NEW)
    assert first.is_symlink() and second.is_symlink() and nowhere.is_symlink()
    assert content(old.parent) == {old.name: NEW, "new.csv": NEW}
    round_ = tmp_path / "round.csv"
    round_.symlink_to(round_)
    with pytest.raises(BadInput, match="symbolic links"):
        save_file(round_, NEW)


def test_a_file_of_two_names_keeps_both(old):
    os.link(old, old.with_name("also.csv"))
    save_file(old, NEW)
    assert content(old.parent) == {old.name: NEW, "also.csv": NEW}
    save_file(old, OLD)
    assert content(old.parent) == {old.name: OLD, "also.csv": OLD}


@pytest.mark.parametrize("number", [errno.EBUSY, errno.EACCES])
def test_where_no_other_file_may_take_its_place_the_file_itself_is_written(old, number, monkeypatch):
    def refused(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "replace", refused)
    known = old.stat().st_ino
    if hasattr(os, "posix_fallocate"):
        with room(2000), pytest.raises(WriteFailure):
            save_file(old, NEW)
        assert content(old.parent) == {old.name: OLD}
    for each in (NEW, b"short", b""):
        save_file(old, each)
        assert content(old.parent) == {old.name: each}
    assert old.stat().st_ino == known


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_pipe_takes_the_bytes_and_stays_one(tmp_path):
    path, found = tmp_path / "pipe.csv", []
    os.mkfifo(path)
    reading = threading.Thread(target=lambda: found.append(path.read_bytes()), daemon=True)
    reading.start()
    save_file(path, NEW)
    reading.join()
    assert found == [NEW]
    assert stat.S_ISFIFO(path.stat().st_mode)


@full
def test_a_device_stays_one():
    save_file(Path(os.devnull), NEW)
    assert stat.S_ISCHR(Path(os.devnull).stat().st_mode)
    with pytest.raises(WriteFailure, match="No space left on device"):
        save_file(FULL, NEW)
    assert stat.S_ISCHR(FULL.stat().st_mode)
    assert not [path for path in FULL.parent.iterdir() if safe_files.PARTIAL_FILE_NAME.fullmatch(path.name)]


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="there is no such folder")
def test_what_is_open_is_written_on_where_it_stands(old, capfd):
    save_file(Path("/dev/stdout"), NEW)
    assert capfd.readouterr().out == NEW.decode()
    with old.open("ab") as file:
        for _ in range(2):
            save_file(Path(f"/dev/fd/{file.fileno()}"), NEW)
    assert content(old.parent) == {old.name: OLD + NEW + NEW}


@pytest.mark.parametrize("name", ["", "..", "no/such.csv", "result.csv/below", "a\0b", "a" * 300])
def test_where_there_can_be_no_file_is_one_sentence(name, old):
    with pytest.raises(BadInput, match="cannot be written") as refused:
        save_file(old.parent / name, NEW)
    assert not isinstance(refused.value, WriteFailure)
    assert content(old.parent) == {old.name: OLD}

"""Machine code on disk: found again by other processes, and never run where anything about it is amiss."""

import ctypes
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest

from planar.codegen import llvm_compile
from planar.codegen.llvm_compile import MACHINE_CODE
from planar.foundation import safe_files
from planar.foundation.private_cache import CACHE_TAG_NAME, CACHE_TAG_TEXT, CHECKSUM_LENGTH

TIMES = """
define void @times(ptr %at) {
  %is = load double, ptr %at
  %made = fmul double %is, FACTOR
  store double %made, ptr %at
  ret void
}
"""


def text(factor):
    return TIMES.replace("FACTOR", f"{float(factor):e}")


def times(factor):
    """What the compiled function makes of 2."""
    llvm_compile.compile_function.cache_clear()
    function, number = llvm_compile.compile_function(text(factor), "times", "array"), ctypes.c_double(2.0)
    function(ctypes.addressof(number))
    return number.value


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder of code."""
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path))
    return tmp_path / MACHINE_CODE.folder_name


@pytest.fixture
def made(monkeypatch):
    """Whatever is compiled from now on, in turn."""
    told, really = [], llvm_compile._compile_object

    def making(asked):
        told.append(asked)
        return really(asked)

    monkeypatch.setattr(llvm_compile, "_compile_object", making)
    return told


def only(place):
    (path,) = codes(place)
    return path


def codes(place):
    """The files of code that are kept."""
    assert (place / CACHE_TAG_NAME).read_bytes() == CACHE_TAG_TEXT
    return [path for path in place.iterdir() if path.name != CACHE_TAG_NAME]


def key(letter):
    """A fingerprint."""
    return sha256(letter.encode()).hexdigest()


HEAD = len(MACHINE_CODE.header) + CHECKSUM_LENGTH


def test_code_is_compiled_once_and_read_from_then_on(place, made):
    assert (times(3), times(3), times(5), times(3)) == (6.0, 6.0, 10.0, 6.0)
    assert made == [text(3), text(5)]
    assert len(codes(place)) == 2


def test_another_process_does_not_compile_again(place):
    assert times(3) == 6.0
    code = (
        "import ctypes\nfrom planar.codegen import llvm_compile\nimport tests.codegen.test_code_cache as here\n"
        "llvm_compile._made = None  # cannot be called\nprint(here.times(3))"
    )
    root = Path(llvm_compile.__file__).parents[2]
    ended = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=False)
    assert (ended.stdout, ended.stderr) == ("6.0\n", "")


@pytest.mark.parametrize("where", [0, len(MACHINE_CODE.header), HEAD - 1, HEAD, 200, -1])
def test_a_damaged_file_is_compiled_again_and_replaced(place, made, where):
    times(3)
    path = only(place)
    whole = bytearray(path.read_bytes())
    right = bytes(whole)
    whole[where] ^= 1
    path.write_bytes(whole)
    assert times(3) == 6.0
    assert len(made) == 2
    assert path.read_bytes() == right


@pytest.mark.parametrize("length", [0, 10, len(MACHINE_CODE.header), HEAD, 300])
def test_a_part_of_a_file_is_compiled_again(place, made, length):
    times(3)
    path = only(place)
    path.write_bytes(path.read_bytes()[:length])
    assert times(3) == 6.0
    assert len(made) == 2


def test_a_file_under_another_name_is_not_run(place, made):
    times(3)
    only(place).rename(place / f"{llvm_compile.fingerprint(text(5))}{MACHINE_CODE.suffix}")
    assert times(5) == 10.0
    assert len(made) == 2


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="there are no users")
def test_what_another_user_wrote_or_could_write_is_not_run(place, made, monkeypatch):
    times(3)
    path, mine = only(place), os.getuid()
    assert (path.stat().st_mode & 0o777, place.stat().st_mode & 0o777) == (0o600, 0o700)
    for each, mode in ((path, 0o620), (path, 0o602), (place, 0o770), (place, 0o707)):
        usual = each.stat().st_mode
        each.chmod(mode)
        assert safe_files.read_private(path) is None
        each.chmod(usual)
    assert safe_files.read_private(path) is not None
    monkeypatch.setattr(os, "getuid", lambda: mine + 1)
    assert safe_files.read_private(path) is None
    before = path.stat().st_mtime_ns
    assert times(3) == 6.0  # nor is anything written into a folder of another
    assert (len(made), path.stat().st_mtime_ns) == (2, before)


def test_code_runs_where_nothing_can_be_kept(tmp_path, made, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path / "file" / "below"))
    assert (times(3), times(3)) == (6.0, 6.0)
    monkeypatch.setenv("PLANAR_CACHE", " Off ")
    monkeypatch.chdir(tmp_path)
    assert times(3) == 6.0
    assert len(made) == 3
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_write_that_fails_leaves_nothing_behind(place, monkeypatch):
    MACHINE_CODE.write(key("a"), b"one")
    monkeypatch.setattr(Path, "replace", lambda self, target: (_ for _ in ()).throw(OSError("no room")))
    assert not MACHINE_CODE.write(key("b"), b"two")
    assert [path.name for path in codes(place)] == [f"{key('a')}{MACHINE_CODE.suffix}"]
    assert MACHINE_CODE.read(key("a")) == b"one"


def test_what_was_not_read_for_longest_goes_first(place, monkeypatch):
    size = len(b"code") + HEAD
    monkeypatch.setattr(MACHINE_CODE, "max_bytes", 3 * size)
    for age, letter in enumerate("abc"):
        assert MACHINE_CODE.write(key(letter), b"code")
        os.utime(place / f"{key(letter)}{MACHINE_CODE.suffix}", (1000 + age, 1000 + age))
    assert MACHINE_CODE.read(key("a")) == b"code"
    MACHINE_CODE.write(key("d"), b"code")
    assert {path.stem for path in codes(place)} == {key(letter) for letter in "acd"}


def test_only_what_was_written_here_is_ever_removed(place, tmp_path, monkeypatch):
    MACHINE_CODE.write(key("a"), b"code")
    names = (
        "notes.code",
        "my.part",
        f"{key('b')}{MACHINE_CODE.suffix}",
        "thesis.code",
        ".hidden.part",
        f"{key('c')}.txt",
    )
    for folder in (tmp_path, place):
        for name in names:
            (folder / name).write_bytes(b"another's, and long" * 100)
            os.utime(folder / name, (1000, 1000))
    unfinished = place / f".{'0f' * 12}.part"
    unfinished.write_bytes(b"of a process that was killed")
    os.utime(unfinished, (2000, 2000))
    monkeypatch.setattr(MACHINE_CODE, "max_bytes", 0)
    MACHINE_CODE.write(key("d"), b"code")
    assert {path.name for path in codes(place)} == set(names)
    assert {path.name for path in tmp_path.iterdir()} == {*names, MACHINE_CODE.folder_name}
    assert all(path.stat().st_size == 1900 for folder in (tmp_path, place) for path in map(folder.joinpath, names))


def test_the_folder_is_where_each_system_has_such_things(monkeypatch, tmp_path):
    for name in ("PLANAR_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(sys, "platform", "linux")
    assert MACHINE_CODE.folder() == tmp_path / ".cache" / "planar" / MACHINE_CODE.folder_name
    monkeypatch.setenv("XDG_CACHE_HOME", "not/absolute")
    assert MACHINE_CODE.folder() == tmp_path / ".cache" / "planar" / MACHINE_CODE.folder_name
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert MACHINE_CODE.folder() == tmp_path / "other" / "planar" / MACHINE_CODE.folder_name
    monkeypatch.setattr(sys, "platform", "darwin")
    assert MACHINE_CODE.folder() == tmp_path / "Library" / "Caches" / "planar" / MACHINE_CODE.folder_name
    monkeypatch.setattr(sys, "platform", "win32")
    assert MACHINE_CODE.folder() == tmp_path / "AppData" / "Local" / "planar" / "Cache" / MACHINE_CODE.folder_name
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert MACHINE_CODE.folder() == tmp_path / "local" / "planar" / "Cache" / MACHINE_CODE.folder_name
    monkeypatch.setenv("PLANAR_CACHE", str(tmp_path / "told"))
    assert MACHINE_CODE.folder() == tmp_path / "told" / MACHINE_CODE.folder_name


def test_code_for_another_processor_or_compiler_has_another_fingerprint(monkeypatch):
    usual = {llvm_compile.fingerprint(text(3))}
    assert usual == {llvm_compile.fingerprint(text(3))}
    for holder, name, value in (
        (llvm_compile, "_processor", lambda: ("another", llvm_compile.llvm.get_host_cpu_features().flatten())),
        (llvm_compile, "_processor", lambda: (llvm_compile.llvm.get_host_cpu_name(), "+none")),
        (llvm_compile.llvmlite, "__version__", "0.0"),
        (llvm_compile, "PASS_LEVEL", 3),
        (llvm_compile, "CODEGEN_LEVEL", 0),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(holder, name, value)
            usual.add(llvm_compile.fingerprint(text(3)))
    usual.add(llvm_compile.fingerprint(text(4)))
    assert len(usual) == 7
    assert all(len(each) == len(sha256().hexdigest()) for each in usual)

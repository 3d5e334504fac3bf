"""Stores of sweeps: what memory has, whatever ends a sweep, and whatever becomes of the files."""

import json
import re
from hashlib import sha256

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, WriteFailure
from tests.builders import designs_around, four_bar
from tests.checks import ORDERS
from tests.closed_forms import ROCKER, TRIPLE, TURN
from tests.draws import covering, first_cases


def swept(store, **more):
    """By one worker, so that blocks come in their order."""
    mechanism = four_bar(*TRIPLE, 1.2)
    return planar.sweep(
        mechanism, designs_around(mechanism, 0.05, 9), 20, ["E", "C"], block=4, workers=1, store=store, **more
    )


@pytest.fixture(params=["zarr", "parquet"])
def store(request, tmp_path):
    pytest.importorskip({"zarr": "zarr", "parquet": "pyarrow"}[request.param])
    return tmp_path / f"sweep.{request.param}"


def same(found, wanted):
    for order in ORDERS:
        np.testing.assert_array_equal(getattr(found, order)["E"][:], getattr(wanted, order)["E"])
    np.testing.assert_array_equal(found.status[:], wanted.status)
    np.testing.assert_array_equal(found.input, wanted.input)
    assert (found.general, found.remarks) == (wanted.general, wanted.remarks)


def test_a_store_has_what_memory_has(store):
    same(swept(store), swept(None))


def test_a_sweep_goes_on_with_the_blocks_that_are_missing(store):
    def stop(done, many):
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        swept(store, progress=stop)
    told = []
    found = swept(store, progress=lambda done, many: told.append(done))
    assert told == [8, 9]
    same(found, swept(None))
    told.clear()
    same(swept(store, progress=lambda done, many: told.append(done)), swept(None))
    assert told == [9]


def test_a_sweep_goes_on_in_the_blocks_of_the_store_whatever_size_is_asked_for(store):
    def stop(done, many):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        little(store, progress=stop)
    told = []
    found = little(store, block=3, progress=lambda done, many: told.append(done))
    assert told == [4, 5]
    equal(found, little(None))


LITTLE = four_bar(*TRIPLE, 1.2)


def little(store, **more):
    """A sweep of three blocks, in few files, whose designs come to dead points."""
    lengths, there = {"BC.length": [0.7, 0.72, 0.73, 0.74, 0.76]}, {"start": 1.2, "stop": 1.5}
    more = {"block": 2} | more
    return planar.sweep(LITTLE, lengths, 6, "E", rates=False, workers=1, store=store, **there, **more)


def equal(found, wanted, again=None):
    """Where it is given, what is said of blocks solved again."""
    for one, other in ((found.position["E"], wanted.position["E"]), (found.status, wanted.status)):
        np.testing.assert_array_equal(one[:], other)
    np.testing.assert_array_equal(found.input, wanted.input)
    said = tuple(each for each in found.remarks if not each.endswith("not whole, and solved again"))
    assert (found.general, said) == (wanted.general, wanted.remarks)
    assert again is None or found.remarks[len(said) :] == again


def flip(path):
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 4
    path.write_bytes(whole)


AGAIN = "1 of 3 blocks in the store was not whole, and solved again"
DAMAGES = {
    "deleted": lambda path: path.unlink(),
    "flipped": flip,
    "halved": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "emptied": lambda path: path.write_bytes(b""),
}


def files_of(store):
    return sorted(path for path in store.rglob("*") if path.is_file())


def test_whatever_file_of_a_store_is_damaged_its_block_is_solved_again_or_the_store_refused(store):
    wanted = little(None)
    little(store)
    sound = {path: path.read_bytes() for path in files_of(store)}
    of_all = {"zarr.json", "_planar.json"}
    # of three blocks that are alike, one
    paths = [path for path in sound if "c" not in path.parts or {"1", "designs"} & {*path.parts}]
    for k, path in enumerate(covering(paths, lambda path: (path.parent.parent == store, path.suffix, path.stem))):
        damage, told = [*DAMAGES.values()][k % len(DAMAGES)], []
        damage(path)
        if path.parent == store and path.name in of_all:
            with pytest.raises(BadInput, match="something else than this sweep"):
                little(store)
            path.write_bytes(sound[path])
            continue
        found = little(store, progress=lambda done, many, told=told: told.append(done))
        equal(found, wanted, (AGAIN,) if len(told) == 2 else None)
        number = next((int(part) for part in reversed(path.parts) if part.isdecimal() and "c" in path.parts), None)
        if number is not None and "designs" not in path.parts:
            assert len(told) == 2, path  # the blocks that are there, then the one
        assert {each.name for each in files_of(store)} == {each.name for each in sound}


def test_a_store_whose_own_mark_is_damaged_is_refused(store):
    little(store)
    mark = store / {".zarr": "zarr.json", ".parquet": "_planar.json"}[store.suffix]
    sound = mark.read_text()
    for wrong in (
        re.sub(r'"block": 2', '"block": 0', sound),
        sound[:-3],
        sound.replace('"fingerprint"', '"fingerprinu"'),
    ):
        assert wrong != sound
        mark.write_text(wrong)
        with pytest.raises(BadInput, match="something else than this sweep"):
            little(store)


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_never_read_as_a_number(store, damage):
    found = little(store)
    assert np.isnan(found.position["E"][2][-1]).all()
    for path in files_of(store):
        if path.match("position/E/c/1/*/*") or path.name == "part-000001.parquet":
            DAMAGES[damage](path)
    said = r"block 1 of .* \(designs 2 to 3\) is missing or damaged; the same sweep into this store solves it again"
    with pytest.raises(BadInput, match=said):
        found.position["E"][:]
    equal(little(store), little(None))


def test_a_status_that_is_missing_is_no_success(tmp_path):
    pytest.importorskip("zarr")
    found = little(tmp_path / "a.zarr")
    (tmp_path / "a.zarr" / "status" / "c" / "2" / "0").unlink()
    for read in (lambda: found.status[4], lambda: found.whole):
        with pytest.raises(BadInput, match=r"block 2 .* missing"):
            read()


class Killed(BaseException):
    """Ends a sweep where it stands."""


@pytest.mark.parametrize("writes", first_cases((0, 4, 10, 2, 6, 8), 3))
def test_a_store_may_be_killed_at_any_time(store, writes, monkeypatch):
    left = [writes]

    def counted(really):
        def write(*given, **more):
            left[0] -= 1
            if left[0] < 0:
                raise Killed
            return really(*given, **more)

        return write

    with monkeypatch.context() as patch:
        if store.suffix == ".zarr":
            from zarr.storage import _local

            patch.setattr(_local, "_put", counted(_local._put))
        else:
            from planar.batch.stores import parquet_store

            patch.setattr(parquet_store, "write_atomically", counted(parquet_store.write_atomically))
        try:
            little(store)
        except Killed:
            assert left[0] < 0
    equal(little(store), little(None))


def test_what_a_killed_process_left_is_taken_away_or_passed_over(store):
    store.mkdir()
    (store / f".{'0f' * 12}.part").write_bytes(b"part")
    (store / "zarr.0f.partial").write_bytes(b"part")
    equal(little(store), little(None))


def test_a_full_disk_ends_in_a_sentence_and_the_sweep_goes_on_later(store):
    def full(done, many):
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, before[1]))

    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        with pytest.raises(WriteFailure, match=f"store: {re.escape(str(store))} cannot be written: File too large"):
            little(store, progress=full)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    told = []
    equal(little(store, progress=lambda done, many: told.append(done)), little(None))
    assert told == [2, 4, 5]


def test_a_store_that_is_a_file_or_below_one_is_refused(store):
    store.write_bytes(b"mine")
    for path in (store, store / f"below{store.suffix}"):
        with pytest.raises(BadInput, match=r"is a file|Not a directory") as refused:
            little(path)
        assert refused.value.place == "store"
    assert store.read_bytes() == b"mine"


def test_a_folder_of_others_is_left_alone(store):
    store.mkdir()
    (store / "part-000000.parquet").write_bytes(b"mine")
    with pytest.raises(BadInput, match="something else than this sweep"):
        little(store)
    assert [path.name for path in files_of(store)] == ["part-000000.parquet"]
    assert (store / "part-000000.parquet").read_bytes() == b"mine"


def test_the_checksums_of_parquet_files_are_as_other_programs_write_them(tmp_path):
    pytest.importorskip("pyarrow")
    little(tmp_path / "a.parquet")
    for number in range(3):
        name = f"part-{number:06d}.parquet"
        made = sha256((tmp_path / "a.parquet" / name).read_bytes()).hexdigest()
        assert (tmp_path / "a.parquet" / f"_part-{number:06d}.sha256").read_text() == f"{made}  {name}\n"


def test_a_store_of_another_sweep_is_left_alone(store):
    swept(store)
    with pytest.raises(BadInput, match="something else than this sweep"):
        planar.sweep(four_bar(*TRIPLE, 1.2), {"BC.length": [0.7]}, 20, store=store)


def test_a_store_of_inputs_that_differ_has_them_by_design(store):
    mechanism = four_bar(*ROCKER, 0.8)
    found = planar.sweep(mechanism, {"A.position": [0.7, 0.8, 0.9]}, 4, "C", block=2, store=store, rates=False)
    np.testing.assert_allclose(found.input[:], np.array([[0.7], [0.8], [0.9]]) + np.linspace(0, TURN, 5))
    assert found.velocity is None


def test_a_parquet_folder_is_one_table_for_other_readers(tmp_path):
    pq = pytest.importorskip("pyarrow.parquet")
    swept(tmp_path / "a.parquet")
    table = pq.read_table(tmp_path / "a.parquet")
    assert table.num_rows == 9 * 21
    assert {"design", "step", "input", "status", "BC.length", "E x [m]", "C vy [m/s]", "E ax [m/s^2]"} <= {
        *table.column_names
    }
    about = json.loads(pq.read_schema(tmp_path / "a.parquet" / "part-000000.parquet").metadata[b"planar"])
    assert about["outcomes"][0] == "solved"


def test_a_zarr_group_says_what_it_is(tmp_path):
    zarr = pytest.importorskip("zarr")
    swept(tmp_path / "a.zarr")
    group = zarr.open_group(str(tmp_path / "a.zarr"), mode="r")
    assert files.from_dict(group.attrs["mechanism"]) == four_bar(*TRIPLE, 1.2)
    assert group["position/E"].shape == (9, 21, 2)
    assert group["position/E"].chunks == (4, 21, 2)
    assert group["designs/BC.length"].shape == (9,)

"""Data sets of random linkages: what they hold is what single mechanisms do; resumed, repeated, refused."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.structures import linkage_store
from planar.structures.random_linkages import random_linkages, structures
from tests.command import run

zarr = pytest.importorskip("zarr")


@pytest.fixture(scope="module")
def linkages(tmp_path_factory):
    return planar.generate(tmp_path_factory.mktemp("set") / "six.zarr", links=6, count=60, steps=36, seed=4)


def test_every_linkage_turns_fully_and_its_paths_are_those_of_its_mechanism(linkages):
    for k in (0, 59):
        mechanism = linkages[k]
        motion = planar.cycle(mechanism, 36)
        pins = linkages.start.shape[1]
        paths = np.stack([motion.point(f"P{pin}").position for pin in range(pins)], axis=1)
        assert paths.shape == linkages.path[k].shape
        np.testing.assert_allclose(linkages.path[k], paths, atol=2e-6)
        assert np.ptp(motion.inputs[motion.running_input].position) == pytest.approx(2.0 * np.pi)


def test_links_keep_their_shapes_and_the_structure_is_that_of_the_chain(linkages):
    chains = planar.chains(6)
    for k in range(0, 60, 7):
        chain, path = chains[int(linkages.chain_number[k])], linkages.path[k].astype(float)
        for link in range(6):
            own = [joint for joint, edge in enumerate(chain.edges) if link in edge]
            own += [7] * int(link == linkages.coupler_link[k])
            apart = np.linalg.norm(path[:, own][:, :, None] - path[:, own][:, None], axis=-1)
            np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), atol=5e-6)
            if link == linkages.frame[k]:
                np.testing.assert_allclose(path[:, own], np.broadcast_to(path[0, own], (37, len(own), 2)))
        assert linkages.frame[k] in chain.edges[linkages.drive[k]]


def test_all_structures_come_alike():
    found = random_linkages(6, 900, 12, (1,)).structure
    counts = np.bincount(found, minlength=len(structures(6)))
    assert len(counts) == 9
    # ten standard deviations of a binomial distribution would be 94
    assert np.all(np.abs(counts - 100) < 94)


def test_what_was_interrupted_goes_on_and_is_the_same_by_whatever_workers(tmp_path, monkeypatch):
    monkeypatch.setattr(linkage_store, "BLOCK_SIZE", 20)
    whole = planar.generate(tmp_path / "a.zarr", links=4, count=70, steps=12, seed=2, workers=1)
    told = []

    def interrupt(done, total):
        told.append((done, total))
        if done >= 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        planar.generate(tmp_path / "b.zarr", links=4, count=70, steps=12, seed=2, workers=1, progress=interrupt)
    begun = []
    with ThreadPoolExecutor(2) as executor:
        again = planar.generate(
            tmp_path / "b.zarr", 4, 70, steps=12, seed=2, executor=executor, progress=lambda *each: begun.append(each)
        )
    assert begun[0] == (20, 70)
    assert begun[-1] == (70, 70)
    for name in ("chain_number", "frame", "drive", "coupler_link", "start", "path"):
        np.testing.assert_array_equal(getattr(again, name)[:], getattr(whole, name)[:])
    other = planar.generate(tmp_path / "c.zarr", links=4, count=70, steps=12, seed=3, workers=1)
    assert np.any(other.start[:] != whole.start[:])


def test_a_damaged_block_is_made_again(tmp_path):
    made = planar.generate(tmp_path / "a.zarr", links=4, count=30, steps=12)
    before = made.path[:]
    (chunk,) = (each for each in (tmp_path / "a.zarr" / "path" / "c").rglob("*") if each.is_file())
    chunk.write_bytes(chunk.read_bytes()[:-9] + b"123456789")
    again = planar.generate(tmp_path / "a.zarr", links=4, count=30, steps=12)
    np.testing.assert_array_equal(again.path[:], before)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"links": 7}, "an even number of links"),
        ({"links": 14}, "from 4 to 12"),
        ({"count": 0}, "from 1 on"),
        ({"seed": -1}, "from 0 on"),
        ({"steps": 0}, "a whole number of steps"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(tmp_path, given, told):
    with pytest.raises(BadInput, match=told):
        planar.generate(tmp_path / "a.zarr", **given)
    assert not (tmp_path / "a.zarr").exists()


def test_a_folder_with_something_else_is_left_alone(tmp_path):
    planar.generate(tmp_path / "a.zarr", links=4, count=10, steps=12)
    for other in ({"count": 11}, {"steps": 13}, {"seed": 1}):
        with pytest.raises(BadInput, match="something else"):
            planar.generate(tmp_path / "a.zarr", **({"links": 4, "count": 10, "steps": 12} | other))
    with pytest.raises(BadInput, match=r"ends in \.zarr"):
        planar.generate(tmp_path / "a", links=4)


def test_the_command_writes_a_data_set(tmp_path):
    done = run(tmp_path, "generate", "--links", "4", "--count", "20", "--steps", "12", "-o", "four.zarr")
    done.done()
    assert "20 linkages of 4 links at 13 positions" in done.out
    assert zarr.open_group(str(tmp_path / "four.zarr"), mode="r")["path"].shape == (20, 13, 5, 2)

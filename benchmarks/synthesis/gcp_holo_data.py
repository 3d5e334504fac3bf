"""Test curves of GCP-HOLO, from a copy of mfogelson/gcp_holo in the folder that GCP_HOLO_FOLDER names.

M. Fogelson, C. Tucker, J. Cagan, *GCP-HOLO: Generating High-Order Linkage Graphs for Path Synthesis*, Journal of
Mechanical Design 145 (2023) 073303. The licence of its repository keeps the curves out of here. They stand in it as
pickled arrays; nothing else is unpickled.
"""

from __future__ import annotations

import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.synthesis.misses import Array

FOLDER = "GCP_HOLO_FOLDER"
CURVES = {
    "eight": "test_curves/eight",
    "dual loop": "test_curves/dualloop",
    "hourglass": "test_curves/hourglass",
    "letter B": "test_curves/letterB",
    "moon": "test_curves/moon",
    "trefoil": "test_curves/trifoil",
    "outer trefoil": "test_curves/outerTrifoil",
    "triangle": "test_curves/triangle",
    "Jansen's foot": "other_curves/jansen_traj",
    "Klann's foot": "other_curves/klann_traj",
    "strider's foot": "other_curves/strider_traj",
    "TrotBot's foot": "other_curves/trot_traj",
}
ALLOWED = {("multiarray", "_reconstruct"), ("numpy", "ndarray"), ("numpy", "dtype")}


def is_there() -> bool:
    """Whether a copy is named."""
    return _folder().is_dir()


def _folder() -> Path:
    return Path(os.environ.get(FOLDER, os.devnull)) / "data"


class _ArraysAlone(pickle.Unpickler):
    """Makes numpy's arrays and refuses all else."""

    def find_class(self, module: str, name: str) -> Any:
        """Of numpy, by the last part of its module's name, which differs from version to version."""
        if module.split(".", maxsplit=1)[0] != "numpy" or (module.rsplit(".", maxsplit=1)[-1], name) not in ALLOWED:
            raise pickle.UnpicklingError(f"{module}.{name} is no array")
        return np.empty(0).__reduce__()[0] if name == "_reconstruct" else getattr(np, name)


def read_array(path: Path) -> Array:
    """The pickled array in a file. Raises UnpicklingError where there is anything else."""
    with path.open("rb") as file:
        return np.asarray(_ArraysAlone(file).load())


def read_curve(name: str) -> Array:
    """The places (n, 2) of a closed curve, the first not again at the end."""
    places = np.squeeze(read_array(_folder() / f"{CURVES[name]}.pkl"))
    places = places.T if places.shape[0] == 2 else places
    return places[:-1] if np.allclose(places[0], places[-1]) else places

"""Random cases: a mechanism, and designs of it whose dimensions are drawn widely; many do not go together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

import planar
from benchmarks import refusals
from benchmarks.linkages import SliderCrank
from benchmarks.swept import SWEPT
from planar.batch.design_arrays import design_variables
from planar.document.files import model_files
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.stops import Stops
from tests.linkages import random_linkage

Array = np.ndarray

DESIGNS = 8
"""Of a case, unless asked otherwise."""
WIDTHS = (0.01, 0.1, 0.3, 0.8)
"""The logarithm of a dimension's factor lies between minus this and this."""
STEPS = (24, 60, 200)
MOST_LINKS = 9
HIGHER = 0.2
"""The share of joints made of higher pairs, in every third random linkage."""
BOX = (0.2, 1.5)
"""m: lengths of four-bars."""


@dataclass(frozen=True)
class Case:
    """Designs (name: one number each) of a mechanism, a turn or from limit to limit, at `steps` + 1 positions."""

    kind: str
    seed: int
    mechanism: Mechanism
    pair: str
    designs: dict[str, Array]
    steps: int
    rates: bool

    def __len__(self) -> int:
        """How many designs there are."""
        return len(next(iter(self.designs.values())))


def random_case(kind: str, seed: int, designs: int = DESIGNS) -> Case | None:
    """The case of a kind, seed and count of designs, always the same; None where what is drawn does not run."""
    rng = np.random.default_rng([seed, *kind.encode()])
    try:
        mechanism = KINDS[kind](seed)
    except planar.BadInput:
        return None
    if not mechanism.inputs or not design_variables(mechanism):
        return None
    pair = mechanism.inputs[int(rng.integers(len(mechanism.inputs)))].pair
    values = (
        _draw_box(rng, designs)
        if kind == "four-bars"
        else _scale_dimensions(rng, mechanism, float(rng.choice(WIDTHS)), designs)
    )
    return Case(kind, seed, mechanism, pair, values, int(rng.choice(STEPS)), bool(rng.random() < 0.7))


def _scale_dimensions(rng: np.random.Generator, mechanism: Mechanism, width: float, designs: int) -> dict[str, Array]:
    """Every length in times of itself, coordinates moved too; in one case of four the inputs' positions as well."""
    known = design_variables(mechanism)
    size = max((abs(each.value) for each in known.values() if each.kind == "length"), default=1.0)
    turned, found = rng.random() < 0.25, {}
    for name, each in known.items():
        factor = np.exp(rng.uniform(-width, width, designs))
        off = width * rng.normal(size=designs)
        if each.kind == "length":
            shifted = 0.1 * size * off if name.endswith((".x", ".y")) else 0.0
            found[name] = each.value * factor + shifted
        elif name.endswith(".position") and turned:
            found[name] = each.value + off
    return found


def _draw_box(rng: np.random.Generator, designs: int) -> dict[str, Array]:
    lengths = rng.uniform(*BOX, (4, designs))
    return dict(zip(("AB.length", "BC.length", "DC.length", "AD.D.x"), lengths, strict=True))


@cache
def model_names() -> tuple[str, ...]:
    """All models, those of the textbook too."""
    return tuple(str(file) for file in model_files())


def _model(seed: int) -> Mechanism:
    names = model_names()
    return planar.load(names[seed % len(names)])


def _linkage(seed: int) -> Mechanism:
    return planar.from_dict(random_linkage(seed, 1 + seed % MOST_LINKS, 0.01, HIGHER * (seed % 3 == 2)).value)


def _six_bars(seed: int) -> Mechanism:
    return planar.from_dict(SWEPT[1 + seed % (len(SWEPT) - 1)].document())


def _with_stops(seed: int) -> Mechanism:
    """A mechanism of another kind, one or two of whose pairs have stops, mostly about where they are."""
    rng = np.random.default_rng([seed, 7])
    others = [make for kind, make in KINDS.items() if kind != "stops"]
    mechanism = others[seed % len(others)](seed // len(others))
    motions = relative_motions(mechanism)
    try:
        solved = planar.solve(mechanism)
    except planar.NoAnswer as problem:
        raise planar.BadInput("stops", str(problem)) from None
    stops = []
    for name in rng.permutation(sorted(motions))[: int(rng.integers(1, 3))].tolist():
        at = float(next(iter(solved.pair(name).values())) or 0.0)
        size = 1.0 if motions[name].input_kind is MeasureKind.ANGLE else max(abs(at), 1e-3)
        low, high = (size * float(rng.choice([0.1, 1.0, 4.0])) * rng.uniform(-0.1, 1.0) for _ in range(2))
        if low + high <= 0.02 * size:
            low, high = abs(low) + 0.1 * size, abs(high)
        ends: list[float | None] = [at - low, at + high]
        if rng.random() < 0.4:
            ends[int(rng.integers(2))] = None
        stops.append(Stops(name, *ends))
    return replace(mechanism, stops=tuple(stops))


KINDS: dict[str, Callable[[int], Mechanism]] = {
    "models": _model,
    "linkages": _linkage,
    "four-bars": lambda _: refusals.base(),
    "slider-cranks": lambda _: planar.from_dict(SliderCrank().document()),
    "six-bars": _six_bars,
    "stops": _with_stops,
}

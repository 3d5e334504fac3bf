"""Random tasks that a known linkage meets, and how many conditions they set, by the rank of the Jacobian there."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from benchmarks.known_linkages.closed_forms import Structure
from benchmarks.known_linkages.makers import MAKERS, KnownLinkage, angles_about, is_assembled, write_mechanism
from benchmarks.known_linkages.vectors import Vector, unit_vector
from planar.foundation.arrays import Array

STEP = 1e-30
"""Of the complex steps."""
RANK_TOLERANCE = 1e-7
"""Of the greatest singular value: what is less is zero."""
CLEAR = 1e-4
"""Of the greatest: the least singular value of a task that is drawn for a list."""
NEIGHBOUR = 1e-3
"""m or rad: how far the numbers of a linkage are from those of one beside it."""
MIN_RANGE = 120
"""Of the positions of the input that are tried: fewer without a dead point are too short a motion."""
MORE_ENTRIES = 14
"""Entries by which it is told how many independent numbers there are."""


class Verdict(StrEnum):
    """What the rank says of a task."""

    LIST = "list"
    """As many conditions as independent numbers, all independent."""
    TOO_MANY = "too many conditions"
    """They depend on each other, so that other tasks of this kind have no solution."""
    OPEN = "open numbers"


class Item(NamedTuple):
    """Something wanted: "places" (n, 2) of P, "poses" (n, 3) of the coupler, or values (n, 1) of a "function"."""

    what: str
    targets: Array
    inputs: Array | None
    is_absolute: bool

    @property
    def has_open_inputs(self) -> bool:
        """Whether the input is anywhere at every entry."""
        return self.inputs is None

    def positions(self, parameters: Any) -> Any:
        """Where the input is at the entries, by what is open: each, the first, or nothing."""
        if self.inputs is None:
            return parameters
        if self.is_absolute:
            return self.inputs
        return parameters[..., :1] + (self.inputs - self.inputs[0])

    @property
    def parameter_count(self) -> int:
        """How many positions of the input are open."""
        if self.inputs is None:
            return len(self.targets)
        return 0 if self.is_absolute else 1


def item_rows(item: Item, structure: Structure, numbers: Mapping[str, Any], angles: Any, signs: Any) -> Any:
    """The misses (rows, ..., entries) of an item: lengths in m, angles by their sines."""
    position = structure.kinematics(numbers, angles, signs)
    if item.what == "function":
        return _function_rows(item, position.output)
    link = structure.coupler
    assert link is not None
    if item.what == "places":
        return _place_rows(position.place(numbers, link, "P"), item)
    turn = _angle_miss(unit_vector(item.targets[:, 2]), position.directions[link])
    return np.stack(np.broadcast_arrays(*_place_rows(position.origins[link], item), turn))


def _place_rows(place: Vector, item: Item) -> Any:
    return np.stack(np.broadcast_arrays(place.x - item.targets[:, 0], place.y - item.targets[:, 1]))


def _angle_miss(wanted: Vector, direction: Vector) -> Any:
    """The sine of the angle between directions, 2 more where these are opposite."""
    return wanted.cross(direction) + np.where(np.real(wanted.dot(direction)) < 0.0, 2.0, 0.0)


def _function_rows(item: Item, output: Any) -> Any:
    values = item.targets[:, 0]
    if not isinstance(output, Vector):
        first = 0.0 if item.is_absolute else output[..., :1] - values[0]
        return (output - first - values)[None, ..., 0 if item.is_absolute else 1 :]
    if item.is_absolute:
        return _angle_miss(unit_vector(values), output)[None]
    since = output.turned_back(Vector(output.x[..., :1], output.y[..., :1]))
    return _angle_miss(unit_vector(values - values[0]), since)[None, ..., 1:]


class KnownTask(NamedTuple):
    """A task, the linkage that meets it, and where its input is at the entries of each item (rad)."""

    name: str
    linkage: KnownLinkage
    items: tuple[Item, ...]
    angles: tuple[Array, ...]
    free: tuple[str, ...]
    verdict: Verdict
    condition: float
    "of the Jacobian with columns of length 1"
    value: dict[str, Any]
    "the file"


def jacobian(
    linkage: KnownLinkage, items: Sequence[Item], angles: Sequence[Array], names: Sequence[str]
) -> tuple[Array, Array]:
    """Of all rows by these numbers, and by the positions of the input that are open, by complex steps."""
    parameters = [_parameters(item, own) for item, own in zip(items, angles, strict=True)]

    def rows(numbers: Mapping[str, Any], values: Sequence[Any]) -> Array:
        every = [
            item_rows(item, linkage.structure, numbers, item.positions(own), linkage.signs).ravel()
            for item, own in zip(items, values, strict=True)
        ]
        return np.concatenate(every)

    by_number = [
        rows({**linkage.numbers, name: linkage.numbers[name] + 1j * STEP}, parameters).imag / STEP for name in names
    ]
    by_parameter = []
    for k, own in enumerate(parameters):
        for index in range(len(own)):
            changed = [each.astype(complex) for each in parameters]
            changed[k][index] += 1j * STEP
            by_parameter.append(rows(linkage.numbers, changed).imag / STEP)
    count = sum(_row_count(item, len(own)) for item, own in zip(items, angles, strict=True))
    shape = [np.array(each).T if each else np.zeros((count, 0)) for each in (by_number, by_parameter)]
    return shape[0], shape[1]


def _parameters(item: Item, angles: Array) -> Array:
    if item.inputs is None:
        return angles
    return angles[:0] if item.is_absolute else angles[:1]


def _row_count(item: Item, entries: int) -> int:
    if item.what == "function":
        return entries if item.is_absolute else entries - 1
    return entries * (2 if item.what == "places" else 3)


def conditions_on_numbers(by_number: Array, by_parameter: Array) -> Array:
    """The rows on the numbers alone, the positions of the input eliminated."""
    if not by_parameter.shape[1]:
        return by_number
    left, values, _ = np.linalg.svd(by_parameter)
    rank = int((values > RANK_TOLERANCE * values[0]).sum())
    rows: Array = left[:, rank:].T @ by_number
    return rows


def rank(matrix: Array) -> int:
    """The rank, with columns of length 1."""
    values = singular_values(matrix)
    return int((values > RANK_TOLERANCE).sum())


def singular_values(matrix: Array) -> Array:
    """Of a matrix whose columns are divided by their lengths, those that are not zero; at most 1 or so."""
    if 0 in matrix.shape:
        return np.zeros(0)
    lengths = np.linalg.norm(matrix, axis=0)
    found: Array = np.linalg.svd(matrix / np.where(lengths > 1e-9, lengths, 1.0), compute_uv=False)
    return found


def judge(linkage: KnownLinkage, items: Sequence[Item], angles: Sequence[Array], free: Sequence[str]) -> Verdict:
    """Whether a task has a list, by the rank at the linkage that meets it."""
    own = conditions_on_numbers(*jacobian(linkage, items, angles, free))
    found = rank(own)
    if found < len(own):
        return Verdict.TOO_MANY
    most = max(independent_count(each, items, free) for each in (linkage, beside(linkage, free)))
    return Verdict.OPEN if most > found else Verdict.LIST


def beside(linkage: KnownLinkage, names: Collection[str]) -> KnownLinkage:
    """A linkage beside it with other numbers of these names: that of a fold, as where a coordinate is zero, is none."""
    rng = np.random.default_rng(7)
    moves = {name: NEIGHBOUR * rng.normal() for name in linkage.numbers}
    numbers = {name: value + moves[name] * (name in names) for name, value in linkage.numbers.items()}
    return linkage._replace(numbers=numbers)


def is_rank_special(linkage: KnownLinkage, items: Sequence[Item], angles: Sequence[Array], free: Sequence[str]) -> bool:
    """Whether linkages beside it, with the tasks that they meet, have a greater rank."""
    other = beside(linkage, linkage.numbers)
    near = [
        make_item(other, item.what, own, item.inputs is not None, item.is_absolute)
        for item, own in zip(items, angles, strict=True)
    ]
    ranks = [
        rank(np.nan_to_num(conditions_on_numbers(*jacobian(each, wanted, angles, free))))
        for each, wanted in ((linkage, items), (other, near))
    ]
    return ranks[1] > ranks[0]


def independent_count(linkage: KnownLinkage, items: Sequence[Item], free: Sequence[str]) -> int:
    """How many independent numbers among these any task of this kind depends on; 0 of one that hardly moves."""
    many, their = [], []
    range_ = angles_about(linkage)
    if len(range_) < MIN_RANGE:
        return 0
    for item in items:
        own = np.linspace(range_[3], range_[-4], MORE_ENTRIES)
        inputs = None if item.inputs is None else own
        many.append(make_item(linkage, item.what, own, inputs is not None, item.is_absolute))
        their.append(own)
    return rank(conditions_on_numbers(*jacobian(linkage, many, their, free)))


def make_item(linkage: KnownLinkage, what: str, angles: Array, has_inputs: bool, is_absolute: bool) -> Item:
    """What the linkage does at these positions of its input."""
    position = linkage.position(angles)
    if what == "function":
        output = position.output
        if isinstance(output, Vector):
            output = np.unwrap(np.arctan2(output.y, output.x))
        return Item(what, np.asarray(output)[:, None], angles, is_absolute)
    link = linkage.structure.coupler
    assert link is not None
    if what == "places":
        place = position.place(linkage.numbers, link, "P")
        targets = np.stack([place.x, place.y], axis=1)
    else:
        origin, way = position.origins[link], position.directions[link]
        targets = np.stack([origin.x, origin.y, np.unwrap(np.arctan2(way.y, way.x))], axis=1)
    return Item(what, targets, angles if has_inputs else None, is_absolute and has_inputs)


def write_item(item: Item, linkage: KnownLinkage, length: float, turn: float) -> dict[str, Any]:
    """An item as a task's file has it."""
    inputs = None if item.inputs is None else (item.inputs * turn).tolist()
    more = {"absolute": True} if item.is_absolute else {}
    if item.what == "function":
        assert inputs is not None
        scale = length if linkage.structure.output == "s" else turn
        pairs = [list(each) for each in zip(inputs, (item.targets[:, 0] * scale).tolist(), strict=True)]
        return {"from": linkage.structure.inputs, "to": linkage.structure.output, "pairs": pairs} | more
    places = (item.targets[:, :2] * length).tolist()
    if item.what == "places":
        through: list[Any] = places
        if inputs is not None:
            through = [{"at": at, "input": at_input} for at, at_input in zip(places, inputs, strict=True)]
        return {"point": "P", "through": through} | more
    poses = [{"at": at, "angle": angle} for at, angle in zip(places, (item.targets[:, 2] * turn).tolist(), strict=True)]
    for pose, at_input in zip(poses, inputs or (), strict=False):
        pose["input"] = at_input
    return {"link": linkage.structure.coupler, "poses": poses} | more


class Plan(NamedTuple):
    """What a task wants: kinds of items with their numbers of entries, and whether it gives the input."""

    kind: str
    items: tuple[tuple[str, int], ...]
    inputs: str
    '"", "absolute" or "relative"'

    @property
    def name(self) -> str:
        """In words."""
        told = " and ".join(f"{count} {what if what != 'function' else 'pairs'}" for what, count in self.items)
        with_inputs = f", inputs {self.inputs}" if self.inputs and self.items[0][0] != "function" else ""
        is_relative = ", relative" if self.items[0][0] == "function" and self.inputs == "relative" else ""
        return f"{self.kind}: {told}{with_inputs}{is_relative}"

    @property
    def condition_count(self) -> int:
        """How many conditions it sets on the numbers."""
        sizes = {"function": 1, "places": 2, "poses": 3}
        rows = sum(count * (sizes[what] - (not self.inputs)) for what, count in self.items)
        relative = 2 if self.items[0][0] == "function" else 1
        return rows - relative * (self.inputs == "relative")


MOST_CONDITIONS = 6
"""Of a task, on the free numbers."""


def draw_plan(rng: np.random.Generator, kind: str) -> Plan:
    """What a task of a kind of linkage wants."""
    while True:
        plan = _any_plan(rng, kind)
        if 1 <= plan.condition_count <= MOST_CONDITIONS:
            return plan


def _any_plan(rng: np.random.Generator, kind: str) -> Plan:
    choices = ["places", "poses", "mixed", "function"]
    if kind in ("slotted lever", "Watt II"):
        choices = ["function"]
    what = str(rng.choice(choices))
    inputs = str(rng.choice(["", "absolute", "relative"], p=[0.5, 0.25, 0.25]))
    if what == "function":
        inputs = str(rng.choice(["absolute", "relative"]))
        return Plan(kind, (("function", int(rng.integers(1, 5) + 2 * (inputs == "relative"))),), inputs)
    if what == "mixed":
        return Plan(kind, (("poses", int(rng.integers(1, 3))), ("places", int(rng.integers(1, 4)))), "")
    most = {"places": {"": 6, "absolute": 4, "relative": 4}, "poses": {"": 4, "absolute": 3, "relative": 3}}[what]
    return Plan(kind, ((what, int(rng.integers(1, most[inputs]))),), inputs)


def draw_task(kind: str, seed: int) -> KnownTask:
    """The task of a kind of linkage and a seed."""
    rng = np.random.default_rng([[*MAKERS].index(kind), seed])
    plan = draw_plan(rng, kind)
    for _ in range(2000):
        made = _try_task(rng, plan, f"{kind} {seed}")
        if made is not None:
            return made
    raise RuntimeError(f"no task was found for {plan.name}, seed {seed}")


def _try_task(rng: np.random.Generator, plan: Plan, name: str) -> KnownTask | None:
    linkage = MAKERS[plan.kind](rng)
    range_ = angles_about(linkage)
    if len(range_) < MIN_RANGE:
        return None
    items, angles = [], []
    for what, count in plan.items:
        own = _entry_angles(rng, range_, count)
        items.append(make_item(linkage, what, own, bool(plan.inputs), plan.inputs == "absolute"))
        angles.append(own)
    names = influential(linkage, items)
    wish = str(rng.choice(["right", "few", "many", "any"], p=[0.7, 0.1, 0.1, 0.1]))
    free = _draw_free(rng, conditions_on_numbers(*jacobian(linkage, items, angles, names)), names, wish)
    if free is None:
        return None
    verdict = judge(linkage, items, angles, free)
    values = singular_values(conditions_on_numbers(*jacobian(linkage, items, angles, free)))
    wanted = {"right": [Verdict.LIST], "any": [Verdict.TOO_MANY, Verdict.OPEN]}.get(wish, [*Verdict])
    value = _write_task(rng, plan, name, linkage, items, free)
    if verdict not in wanted or not _is_clear(verdict, values[-1]) or value is None:
        return None
    if verdict is Verdict.TOO_MANY and is_rank_special(linkage, items, angles, free):
        return None
    condition = float(values[0] / values[-1]) if values[-1] > 0.0 else np.inf
    return KnownTask(plan.name, linkage, tuple(items), tuple(angles), free, verdict, condition, value)


def _is_clear(verdict: Verdict, least: float) -> bool:
    """Whether the rank is beyond doubt, by the least singular value."""
    if verdict is Verdict.LIST:
        return least > CLEAR
    return verdict is Verdict.OPEN or not 1e-10 < least < 1e-5


def _entry_angles(rng: np.random.Generator, range_: Array, count: int) -> Array:
    """Positions of the input, not too near each other or the ends of the range."""
    low, high = range_[8], range_[-9]
    while True:
        found = np.sort(rng.uniform(low, high, count))
        if count == 1 or np.diff(found).min() > 0.25 * (high - low) / count:
            return found


def influential(linkage: KnownLinkage, items: Sequence[Item]) -> list[str]:
    """The numbers on which what is wanted depends at all."""
    names, range_ = [*linkage.numbers], angles_about(linkage)
    own = np.linspace(range_[3], range_[-4], MORE_ENTRIES)
    many = [make_item(linkage, each.what, own, each.inputs is not None, each.is_absolute) for each in items]
    rows = conditions_on_numbers(*jacobian(linkage, many, [own] * len(many), names))
    lengths = np.linalg.norm(rows, axis=0)
    return [name for name, size in zip(names, lengths, strict=True) if size > 1e-9 * lengths.max()]


def _draw_free(rng: np.random.Generator, rows: Array, names: list[str], wish: str) -> tuple[str, ...] | None:
    """Numbers that are free: as many independent ones as there are conditions, one fewer, one more, or any."""
    count = len(rows)
    wanted = {"right": count, "few": count - 1, "many": count + 1, "any": count}[wish]
    if not 1 <= wanted <= min(len(names), MOST_CONDITIONS + 1) or count > MOST_CONDITIONS:
        return None
    order = rng.permutation(len(names))
    chosen: list[int] = []
    if wish == "any":
        chosen = order[:wanted].tolist()
    for k in order.tolist():
        if len(chosen) >= wanted:
            break
        own = rows[:, [*chosen, k]]
        if rank(own) > min(len(chosen), count - 1) or (wish == "many" and len(chosen) == count):
            chosen.append(k)
    if len(chosen) < wanted:
        return None
    return tuple(names[k] for k in sorted(chosen))


def _write_task(
    rng: np.random.Generator, plan: Plan, name: str, linkage: KnownLinkage, items: Sequence[Item], free: Sequence[str]
) -> dict[str, Any] | None:
    """The task's file, whose start has other numbers where these are free."""
    units = str(rng.choice(["m", "mm"]))
    length, turn = (1000.0, 180.0 / np.pi) if units == "mm" else (1.0, 1.0)
    for start in _starts(rng, linkage, free):
        position = linkage.structure.kinematics(start, linkage.angle, linkage.signs)
        if bool(is_assembled(position)):
            return {
                "planar": 1,
                "name": f"{plan.name} ({name})",
                "units": {"length": units, "angle": "deg" if units == "mm" else "rad"},
                "start": write_mechanism(linkage, start, position, units),
                "wanted": [write_item(item, linkage, length, turn) for item in items],
                "free": [*free],
            }
    return None


def _starts(rng: np.random.Generator, linkage: KnownLinkage, free: Sequence[str]) -> Iterator[dict[str, float]]:
    """The numbers of the linkage, those that are free changed a little."""
    for _ in range(10):
        changed = {
            each: linkage.numbers[each] * (1.0 + 0.1 * rng.uniform(-1, 1)) + 0.05 * rng.uniform(-1, 1) for each in free
        }
        yield {**linkage.numbers, **changed}

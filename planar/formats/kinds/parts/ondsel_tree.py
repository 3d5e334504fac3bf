"""The tree of an `.asmt` file, indented by tabs, and the places of its markers in space."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from typing import NamedTuple

from planar.foundation.errors import BadInput

MAX_DEPTH, MAX_NODES = 40, 400_000
Triple = tuple[float, float, float]


@dataclass
class Node:
    """A line of the tree, with those that stand under it."""

    text: str
    line: int
    children: list[Node] = field(default_factory=list)

    def find(self, key: str) -> Node | None:
        """The first child with this text."""
        return next((item for item in self.children if item.text == key), None)

    def value(self, key: str) -> str | None:
        """The first line under a child."""
        result = self.find(key)
        return result.children[0].text if result is not None and result.children else None

    def walk(self, key: str) -> list[Node]:
        """The children of a child; none where that is not there."""
        result = self.find(key)
        return [] if result is None else result.children


class Pose(NamedTuple):
    """A place in space and the rows of a turning."""

    at: Triple
    rows: tuple[Triple, Triple, Triple]

    def place(self, other: Pose) -> Pose:
        """Where a pose lies that is given in this one's axes."""
        moved = _turned(self.rows, other.at)
        columns = [_turned(self.rows, other.column(index)) for index in range(3)]
        x, y, z = (self.at[i] + moved[i] for i in range(3))
        return Pose((x, y, z), tuple(tuple(column[i] for column in columns) for i in range(3)))  # type: ignore[arg-type]

    def column(self, index: int) -> Triple:
        """An axis of it."""
        return self.rows[0][index], self.rows[1][index], self.rows[2][index]


IDENTITY = Pose((0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))


def parse_tree(text: str, place: str) -> Node:
    """The tree of a file, up to its results. Raises BadInput where it is nested too deeply or too large."""
    root = Node("", 0)
    path: list[tuple[int, Node]] = [(-1, root)]
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("TimeSeries"):  # results, which follow from the rest
            break
        body = line.strip()
        if not body:
            continue
        depth = len(line) - len(line.lstrip("\t"))
        if depth > MAX_DEPTH or number > MAX_NODES:
            raise BadInput(f"{place}, line {number}", "the file is larger or nested deeper than an assembly can be")
        while path[-1][0] >= depth:
            path.pop()
        node = Node(body, number)
        path[-1][1].children.append(node)
        path.append((depth, node))
    return root


def read_pose(node: Node, place: str) -> Pose:
    """The pose of a part, a reference point or a marker. Raises BadInput at its line."""
    at = node.find("Position3D")
    rows = node.walk("RotationMatrix")
    if at is None or len(at.children) != 1 or len(rows) != 3:
        raise BadInput(f"{place}, line {node.line}", f"{node.text!r:.40} has no Position3D and RotationMatrix")
    first, second, third = (numbers(row, 3, place) for row in rows)
    return Pose(numbers(at.children[0], 3, place), (first, second, third))


def numbers(node: Node, count: int, place: str) -> Triple:
    """The numbers of a line. Raises BadInput at it."""
    try:
        result = [float(word) for word in node.text.split()]
    except ValueError:
        result = []
    if len(result) != count or not all(isfinite(item) and abs(item) < 1e100 for item in result):
        raise BadInput(f"{place}, line {node.line}", f"{count} numbers are wanted here, not {node.text!r:.60}")
    return tuple(result)  # type: ignore[return-value]


def markers(node: Node, pose: Pose, place: str) -> Iterator[tuple[str, Pose]]:
    """The markers of a part, or of the assembly, by their names, in space."""
    for point in node.walk("RefPoints"):
        base = pose.place(read_pose(point, place))
        for marker in point.walk("Markers"):
            yield marker.value("Name") or "", base.place(read_pose(marker, place))


def dot(one: Triple, other: Triple) -> float:
    """The scalar product."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def cross(one: Triple, other: Triple) -> Triple:
    """The vector product."""
    (a, b, c), (x, y, z) = one, other
    return b * z - c * y, c * x - a * z, a * y - b * x


def _turned(rows: tuple[Triple, Triple, Triple], vector: Triple) -> Triple:
    return dot(rows[0], vector), dot(rows[1], vector), dot(rows[2], vector)

"""The random members that come with the package, with all their solutions: `python -m benchmarks.exact_records KIND`.

Of nine places one of each class is sought: S. Roberts' cognates of a four-bar trace the same path.
"""

from __future__ import annotations

import argparse

import numpy as np

import planar
from benchmarks.exact_makers import KINDS, UNITS
from planar.foundation.arrays import ComplexArray
from planar.foundation.safe_files import save_file
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.family_names import name_family
from planar.synthesis.exact.tracking.generic_solutions import (
    KNOWN,
    MAX_POINTS,
    GenericSolutions,
    find_generic_solutions,
    pack_record,
    trace_test,
    write_record,
)
from planar.synthesis.exact.tracking.member_homotopy import (
    Images,
    affine_solutions,
    exchange_images,
    homogeneous_solutions,
    representatives,
)
from planar.synthesis.task.starts import start_mechanisms

PLACE = 0.3 + 0.2j, -0.1 + 0.4j
"""Where the point of nine places is at the first: there the cognates are turned out."""


class PlacedFamily(Family):
    """A family whose first place stays where it is."""

    def random_member(self, rng: np.random.Generator) -> Member:
        """A random member."""
        found = super().random_member(rng)
        found.parts[0][0, 0] = PLACE
        return found


def cognate_images(pivots: tuple[int, int], joints: tuple[int, int], exchanged: Images) -> Images:
    """The three linkages of a coupler curve, by the places of pivots and joints among the unknowns."""

    def images(V: ComplexArray) -> list[ComplexArray]:
        x, found = affine_solutions(V), []
        half = x.shape[1] // 2
        for number in range(3):
            y = x.copy()
            for side, e in enumerate(PLACE):
                a, d, b, c = (x[:, side * half + k] for k in (*pivots, *joints))
                ratio = (e - b) / (c - b)
                third = a + ratio * (d - a)
                if number == 1:
                    b, c, d = a + e - b, a + e - b + ratio * (b - a), third
                elif number == 2:
                    a, b, c, d = d, d + e - c, d + e - c + (ratio - 1.0) * (d - c), third
                for k, value in zip((*pivots, *joints), (a, d, b, c), strict=True):
                    y[:, side * half + k] = value
            found += exchanged(homogeneous_solutions(y))
        return found

    return images


def main() -> None:
    """Find the solutions of one kind and write them into the package."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exact_records")
    parser.add_argument("kind", choices=[*KINDS])
    parser.add_argument("--enough", type=int, default=None, help="the number that is known, where the search may end")
    parser.add_argument("--source", default="", help="where their number is published")
    parser.add_argument("--points", type=int, default=MAX_POINTS, help="the most points of a slice of the trace test")
    wanted = parser.parse_args()
    value, entries, more = KINDS[wanted.kind](np.random.default_rng(0))
    task = planar.read_task({"planar": 1, "units": UNITS, "start": value, "wanted": entries} | more)
    problem = ExactProblem(task, next(iter(start_mechanisms(task))))
    for component in {name_family(each.family).text: each for each in problem.components}.values():
        name = name_family(component.family)
        exchanged = exchange_images(name.exchanges)
        family, images, members = component.family, exchanged, 1
        if wanted.kind == "nine places":
            order = [each.own for each in component.unknowns]
            places = [("AD", "A"), ("AD", "D"), ("AB", "B"), ("DC", "C")]
            a, d, b, c = (order.index(min(problem.pose.place(*each).symbols)) for each in places)
            family, members = PlacedFamily(*component.family), 3
            images = cognate_images((a, d), (b, c), exchanged)
        found = find_generic_solutions(family, images, enough=wanted.enough, progress=print)
        every = images(found.V)[:: len(name.exchanges)]
        V = np.concatenate([representatives(each, exchanged) for each in every]) if members > 1 else found.V
        classes = np.arange(len(V)).reshape(members, -1).T
        whole = GenericSolutions(found.member, V)
        is_traced = members == 1 and trace_test(component.family, whole, name.exchanges, most_points=wanted.points)
        content = write_record(pack_record(name, whole, classes, is_traced, wanted.source))
        save_file(KNOWN / f"{name.text[:16]}.npz", content)
        print(len(classes), "classes of", members, "traced" if is_traced else "not traced")


if __name__ == "__main__":
    main()

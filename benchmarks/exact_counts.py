"""Published counts of exact synthesis, counted again, and times: `python -m benchmarks.exact_counts`.

The nine points are those of problem 3 of C. W. Wampler, A. P. Morgan, A. J. Sommese, Complete solution of the
nine-point path synthesis problem for four-bar linkages, J. Mech. Des. 114 (1992) 153: 64 of its 1442 classes are real,
192 linkages, which J. D. Hauenstein and F. Sottile certified (Algorithm 921: alphaCertified, ACM Transactions on
Mathematical Software 38, 2012).
"""

from __future__ import annotations

from time import process_time

import numpy as np
from rich.console import Console

import planar
from benchmarks.exact_makers import KINDS, UNITS
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.tracking.member_solutions import solve_components
from planar.synthesis.task.starts import start_mechanisms

NINE_POINTS = (
    (0.25, 0.00),
    (0.52, 0.10),
    (0.80, 0.70),
    (1.20, 1.00),
    (1.40, 1.30),
    (1.10, 1.48),
    (0.70, 1.40),
    (0.20, 1.00),
    (0.02, 0.40),
)


def time_five_poses(console: Console, many: int = 50) -> None:
    """How long the dyads of five poses take, found and proved, of tasks drawn at random."""
    times = []
    for seed in range(many):
        value, wanted, more = KINDS["five poses"](np.random.default_rng(seed))
        task = planar.read_task({"planar": 1, "units": UNITS, "start": value, "wanted": wanted} | more)
        start = next(iter(start_mechanisms(task)))
        began = process_time()
        components = ExactProblem(task, start).components
        written = process_time()
        solve_components(components, lambda _: None)
        times.append((written - began, process_time() - written))
    rows, dyads = 1e3 * np.median(times, axis=0)
    console.print(f"five poses: rows {rows:.0f} ms, dyads found and proved {dyads:.0f} ms in the median of {many}")


def main() -> None:
    """Count what is published."""
    console = Console()
    time_five_poses(console)
    began = process_time()
    wanted = [{"point": "E", "through": [list(place) for place in NINE_POINTS]}]
    task = {"planar": 1, "units": UNITS, "start": "four-bar", "wanted": wanted}

    def say(done: planar.SearchProgress) -> None:
        console.print(f"{process_time() - began:7.1f} s  {done.stage}", highlight=False)

    found = planar.synthesise(task, complete=True, progress=say)
    seconds = process_time() - began
    certified, sound = sum(each.certified for each in found), sum(not each.defects for each in found)
    console.print(*found.summary, *found.remarks, sep="\n")
    console.print(
        f"{found.found} classes (published: 1442), {len(found)} real linkages (published: 3 x 64 = 192), "
        f"{certified} certified, {sound} without a defect; {seconds:.0f} s"
    )


if __name__ == "__main__":
    main()

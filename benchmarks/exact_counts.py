"""Published counts of exact synthesis, counted again: `python -m benchmarks.exact_counts`.

The nine points are those of problem 3 of C. W. Wampler, A. P. Morgan, A. J. Sommese, Complete solution of the
nine-point path synthesis problem for four-bar linkages, J. Mech. Des. 114 (1992) 153: 64 of its 1442 classes are real,
192 linkages, which J. D. Hauenstein and F. Sottile certified (Algorithm 921: alphaCertified, ACM Transactions on
Mathematical Software 38, 2012).
"""

from __future__ import annotations

from time import process_time

from rich.console import Console

import planar

UNITS = {"length": "m", "angle": "rad"}
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


def main() -> None:
    """Count what is published."""
    console, began = Console(), process_time()
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

"""A mechanism, a position or a motion as a page: written to a file, opened in the browser, or shown in a notebook."""

from __future__ import annotations

from pathlib import Path
from tempfile import mkdtemp
from typing import Any, NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.notebook_display import Displayable
from planar.foundation.safe_files import save_file
from planar.foundation.time_limit import stop_if_over, stops_in_time
from planar.model.mechanism import Drive, Mechanism, replace_inputs, running_input_index
from planar.pages.data.wanted_data import apply_task
from planar.pages.notebook import must_carry_scripts, output_html
from planar.pages.page import PageRange, page
from planar.pages.still_picture import still_svg
from planar.reports.files.html import to_html
from planar.results.motion import Motion, State
from planar.solving.position import solved_mechanism
from planar.synthesis.task.synthesis_task import SynthesisTask
from planar.synthesis.task.task_reader import TaskSource, read_task

MAX_LISTED_ASSEMBLIES = 12
"""Assemblies of the table that a notebook shows."""


@takes_result("Mechanism", "State", "Motion")
@stops_in_time
def view(
    shown: Mechanism | State | Motion,
    path: str | Path | None = None,
    *,
    task: TaskSource | None = None,
    pair: str | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Path:
    """Write the page of a mechanism, of a position, or of a motion, which keeps its range.

    Without a path it is written to a folder of its own and opened in the browser. A `task`, as `planar.synthesise`
    takes it, is shown under the mechanism: what is wanted can be dragged, and the free dimensions follow. `pair` names
    the input that runs first, by default the first that has a velocity. While no input has a velocity, rates are those
    at the unit rate of the input that runs, and the page says so. The page of a structure, and of a mechanism without
    inputs as it is drawn, says that nothing moves it. Returns the file's path.

    Raises NoAnswer where the mechanism has no position to start from, and after `timeout` s, or a Ctrl-C, with the
    outcome "interrupted"; BadInput where the file cannot be written, the task is none of this mechanism, or there is no
    input at `pair`.

    >>> import planar
    >>> from tempfile import mkdtemp
    >>> planar.view(planar.load("four-bar"), mkdtemp() + "/page.html").name
    'page.html'
    """
    if not isinstance(shown, Mechanism | State | Motion):
        raise BadInput("view", f"a Mechanism, a State or a Motion is wanted, not {type(shown).__name__}")
    stop_if_over("before the page was begun")
    text = page_of(shown, None if task is None else read_task(task), pair)
    if path is not None:
        save_file(Path(path), text)
        return Path(path)
    from webbrowser import open_new_tab  # only where one is opened

    made = Path(mkdtemp(prefix="planar-")) / "page.html"
    save_file(made, text)
    open_new_tab(made.as_uri())
    return made


class PageSubject(NamedTuple):
    """What a page is of: a mechanism at its inputs, the unknowns of an assembly, and a range."""

    mechanism: Mechanism
    z: np.ndarray | None = None
    window: PageRange | None = None


def page_of(shown: Mechanism | State | Motion, task: SynthesisTask | None = None, pair: str | None = None) -> str:
    """The text of the page of a mechanism, a position or a motion, with what a task wants of it.

    `pair` names the input that runs first.
    """
    subject = _page_subject(shown)
    if pair is not None:
        running = running_input_index(subject.mechanism, pair)
        if subject.window is None or subject.window.running != running:
            subject = subject._replace(window=PageRange(running))
    if task is None:
        return page(*subject)
    # a task is refused of a mechanism without inputs, which the page shows with some
    mechanism, wanted = apply_task(shown if isinstance(shown, Mechanism) else subject.mechanism, task)
    return page(mechanism, subject.z, subject.window, wanted=wanted)


def _page_subject(shown: Mechanism | State | Motion) -> PageSubject:
    if isinstance(shown, Mechanism):
        return PageSubject(shown if shown.inputs else solved_mechanism(shown).completed_mechanism)
    if isinstance(shown, State):
        return PageSubject(shown.mechanism, _unknowns(shown, shown.mechanism))
    ends = {name: given.position for name, given in shown.inputs.items()}
    # of inputs that run in time together the one that goes farthest runs on the page
    pair = max(ends, key=lambda name: float(np.ptp(ends[name])))
    low, high = float(ends[pair].min()), float(ends[pair].max())
    row = _start_row(shown, pair)
    there = replace_inputs(shown.mechanism, tuple(Drive(name, float(at[row])) for name, at in ends.items()))
    window = PageRange(list(ends).index(pair), low, high) if low < high else None
    return PageSubject(there, _unknowns(shown, there, row), window)


def _start_row(motion: Motion, pair: str) -> int:
    """The row nearest to the file's position, among those that are no dead points."""
    rates = [
        np.broadcast_to(frame.angle.parts[1], (len(motion),)) for frame in motion.frames.values() if not frame.fixed
    ]
    lost = ~np.isfinite(rates).all(axis=0)
    filed = next(given.position for given in motion.mechanism.inputs if given.pair == pair)
    return int(np.argmin(np.abs(motion.inputs[pair].position - filed) + np.where(lost & ~lost.all(), np.inf, 0.0)))


def notebook_html(shown: Displayable) -> str | None:
    """What a notebook shows of a mechanism or a result: tables of a result, a still picture, the page over it.

    None where there is nothing of these, so that the text is shown.
    """
    moving, layers, table = _presentation(shown)
    try:
        subject = _page_subject(moving)
        picture = still_svg(subject.mechanism, subject.z)
        text = page(*subject, layers=layers, library=must_carry_scripts())
    except (BadInput, NoAnswer):
        return table or None
    return output_html(subject.mechanism.name, table, picture, text)


def _presentation(shown: Any) -> tuple[Mechanism | State | Motion, tuple[str, ...], str]:
    """Of what the page is, its layers, and the tables above it."""
    from planar.analysis.centres.centres import Centres
    from planar.assemblies.circuits.circuits import Circuits
    from planar.assemblies.modes import Modes, modes
    from planar.dynamics.forces import Forces
    from planar.reports.tables import centres, circuits
    from planar.reports.tables import modes as assemblies
    from planar.reports.tables.forces import forces_over_motion
    from planar.reports.tables.forces import position_forces as forces

    if isinstance(shown, Forces):
        over = isinstance(shown.moving, Motion)
        return (
            shown.moving,
            ("paths", "forces"),
            to_html(forces_over_motion.tables(shown) if over else forces.tables(shown, {})),
        )
    if isinstance(shown, Centres):
        return shown.state, ("centres",), to_html(centres.table(shown))
    if isinstance(shown, Modes):
        return shown.mechanism, ("paths",), to_html(assemblies.table(shown, MAX_LISTED_ASSEMBLIES))
    if isinstance(shown, Circuits):
        return shown.mechanism, ("paths",), to_html(circuits.table(shown, modes(shown.mechanism, certify=False)))
    return shown, ("paths",), ""


def _unknowns(shown: State | Motion, mechanism: Mechanism, row: int = 0) -> np.ndarray:
    """The unknowns of a position, or of a row of a motion, in the equations of its mechanism."""
    solver = solved_mechanism(mechanism).solver
    w = np.atleast_2d(solver.coordinates(shown.frames, shown.own))
    return w[row if len(w) > 1 else 0, list(solver.equations.unknowns)]

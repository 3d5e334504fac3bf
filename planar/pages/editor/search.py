"""Linkages searched for what a page wants, in a process of its own, which is asked how far it is, and stopped."""

from __future__ import annotations

import multiprocessing
import threading
from _thread import interrupt_main
from collections.abc import Mapping
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection
from typing import Any

from planar.document.files import from_dict, to_dict
from planar.foundation.errors import BadInput, PlanarError
from planar.model.wording import amount
from planar.pages.editor.authors_file import carry_over
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign
from planar.synthesis.synthesise import SearchProgress, TaskSearch, progress_words
from planar.synthesis.task.starts import miss_text
from planar.synthesis.task.task_reader import read_task

DESIGNS = 6
"""That are listed."""
ENDING_TIME = 2.0
"""s for a process that is told to end."""
_NUMBERS = count(1)


class BackgroundSearch:
    """A search for designs for a task, given as the JSON value of its file; it begins at once.

    Raises BadInput where that is no task, or starts from anything but a mechanism that stands in it.
    """

    def __init__(self, task: Any):
        if not isinstance(task, dict) or not isinstance(task.get("start"), dict):
            raise BadInput("$.start", "the mechanism that is drawn is wanted here")
        read_task(task)
        self.number = next(_NUMBERS)
        self.told: dict[str, Any] = {"search": self.number, "progress": "begins", "is_over": False}
        context = multiprocessing.get_context("spawn")  # a copy of this process would hold its threads' locks
        self._line, other = context.Pipe()
        self._process = context.Process(target=search_for, args=(other, task), daemon=True)
        self._process.start()
        other.close()

    def tell(self) -> dict[str, Any]:
        """How far it is: {search, progress, is_over}, once it is over with `designs` or a `problem`."""
        try:
            while self._line.poll():
                self.told = self.told | self._line.recv()
        except (EOFError, OSError):
            if not self.told["is_over"]:
                self.told |= {"is_over": True, "problem": "The search broke off; nothing of it is left."}
        return self.told

    def stop(self) -> None:
        """Begin nothing new: what was found is told in a moment."""
        with suppress(OSError):
            self._line.send("stop")

    def end(self) -> None:
        """End the process, whatever it does."""
        self._process.terminate()
        self._process.join(ENDING_TIME)
        self._line.close()


def search_for(line: Connection, value: dict[str, Any]) -> None:
    """What the process does: search, tell how far it is, stop when it is told to, end when nobody hears it."""
    task = read_task(value)

    def tell(done: SearchProgress) -> None:
        line.send({"progress": progress_words(done, task)})

    search = TaskSearch(task, DESIGNS, seed=0, progress=tell)
    is_running = threading.Event()

    def listen() -> None:
        with suppress(EOFError, OSError):
            line.recv()
        if is_running.is_set():
            interrupt_main()

    def tell_result() -> None:
        line.send({"progress": "", "is_over": True} | _result(search.result(), value["start"]))

    try:
        with suppress(KeyboardInterrupt):
            is_running.set()
            threading.Thread(target=listen, daemon=True).start()
            search.run()
        is_running.clear()
        try:
            tell_result()
        except KeyboardInterrupt:  # it came as the search ended
            tell_result()
    except PlanarError as problem:
        line.send({"progress": "", "is_over": True, "problem": str(problem)})
    except OSError:
        return  # nobody hears it any more


def _result(found: Synthesis, start: Mapping[str, Any]) -> dict[str, Any]:
    """The designs in words and as files, the best first, and what to know of them."""
    before = to_dict(from_dict(start))
    designs = []
    for each in found:
        after = to_dict(each.mechanism) | {"name": before["name"]}
        designs.append({"words": _words(found, each), "document": carry_over(start, before, after)})
    return {"designs": designs, "remarks": list(found.remarks)}


def _words(found: Synthesis, design: SynthesisedDesign) -> str:
    """What a design misses, and how it moves."""
    units = found.task.units
    error, greatest = (miss_text(found.task, miss, found.size) for miss in (design.error, design.greatest_miss))
    words = [f"misses by {error} (root mean square)", f"by {greatest} at most"]
    if design.motion is not None:
        turns = "turns fully" if design.motion.is_whole_turn else "does not turn fully"
        words.append(f"{design.motion.pair} {turns}")
        least = design.motion.least_transmission
        if least is not None:
            words.append(f"transmission angle {amount(least.value, 'angle', units)} at least")
    return ", ".join(words)

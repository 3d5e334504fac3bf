"""`python -m benchmarks.drawing`: a pin of a ten-link dragged on its page, and a change of structure answered.

In a real browser without a window: the time from the pointer's place to a drawing that is laid out, in the median of
many places round a circle; and that of the server's answers to drafts that differ in structure, each new to it, also in
time of the processor, which other work on the machine does not lengthen.
"""

from __future__ import annotations

import http.client
import json
from statistics import median
from time import perf_counter, process_time
from typing import Any

from planar.pages.editor.answer import edit_answer
from planar.pages.editor.server import EditServer
from tests.drawn_linkages import LINKAGES
from tests.page_scripts import browser
from tests.pencil import served

PLACES = 120
COUPLED = ("epicyclic", "belt", "rack", "cam", "slot")
DYADS = 3
REPEATS = 5
DRAG = """(places) => {
  const { pin } = { pin: "C" }, start = page.point(pin).position, times = [];
  editing.use("pin");
  const held = editing.leading.take(pin);
  editing.hand.dragged = held;
  for (let k = 0; k < places; k++) {
    const turn = (2 * Math.PI * k) / places, began = performance.now();
    held.to = [start[0] + 0.004 * Math.cos(turn), start[1] + 0.004 * Math.sin(turn)];
    editing.leading.pull(held);
    drawing.measure(); // as the next frame would
    document.getElementById("drawing").getBoundingClientRect();
    times.push(performance.now() - began);
    if (!editing.solved) throw new Error("not solved by the page");
  }
  return times;
}"""


def ten_link(lengthened: float = 0.0) -> dict[str, Any]:
    """A four-bar with three dyads on its coupler and rocker, as a file."""
    links: dict[str, Any] = {
        "frame": {"points": {"A": [0, 0], "D": [100, 0]}},
        "AB": {"ends": ["A", "B"], "length": 30},
        "BC": {"ends": ["B", "C"], "length": 90 + lengthened, "points": {"E0": [45, 30], "E1": [60, -20]}},
        "DC": {"ends": ["D", "C"], "length": 60, "points": {"E2": [80, 10]}},
    }
    sketch: dict[str, Any] = {"C": [95, 60]}
    for k, (ground, knee) in enumerate((([150, 20], [120, 90]), ([60, -80], [90, -20]), ([220, 0], [180, 70]))[:DYADS]):
        links["frame"]["points"][f"G{k}"] = ground
        links[f"rod {k}"] = {"ends": [f"E{k}", f"F{k}"], "length": 95}
        links[f"rocker {k}"] = {"ends": [f"F{k}", f"G{k}"], "length": 95}
        sketch[f"F{k}"] = knee
    points = ["A", "B", "C", "D", *(f"{letter}{k}" for k in range(DYADS) for letter in "EFG")]
    return {
        "planar": 1,
        "name": "Ten-link",
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": links,
        "pairs": [{"turning": point} for point in points],
        "inputs": [{"pair": "A", "position": 60, "velocity": "10 rad/s"}],
        "sketch": sketch,
    }


def drag_times() -> list[float]:
    """Of each place the time (ms) until the page has solved and drawn it."""
    with browser() as running, served(ten_link()) as server:
        window = running.new_context(viewport={"width": 1280, "height": 900}).new_page()
        window.goto(server.address)
        window.wait_for_function("() => page.course")
        return list(window.evaluate(DRAG, PLACES))


def answer_times() -> dict[str, tuple[float, float]]:
    """Of changes of the structure the time (s) until the server has answered, and that of the processor: medians."""
    drafts = {f"{2 * count + 4} links": [_with_dyads(count, k) for k in range(REPEATS)] for count in range(DYADS + 1)}
    for name in COUPLED:
        drafts[name] = [{**LINKAGES[name][1], "name": f"{name} {k}"} for k in range(REPEATS)]
    with served() as server:
        timed = {
            name: [(_answer_time(server, value), _answer_work(value | {"name": f"{name} again"})) for value in values]
            for name, values in drafts.items()
        }
    return {name: (median(wall for wall, _ in each), median(cpu for _, cpu in each)) for name, each in timed.items()}


def _with_dyads(dyads: int, k: int) -> dict[str, Any]:
    """The ten-link with so many of its dyads; `k` makes its numbers new."""
    value = ten_link(0.01 * (k + 1))
    for gone in range(dyads, DYADS):
        for link in (f"rod {gone}", f"rocker {gone}"):
            del value["links"][link]
        del value["links"]["frame"]["points"][f"G{gone}"], value["sketch"][f"F{gone}"]
        value["pairs"] = [each for each in value["pairs"] if each["turning"][1:] != str(gone)]
    return value


def _answer_work(value: dict[str, Any]) -> float:
    """The processor time (s) of an answer that this process computes; that of the server's worker is not seen."""
    began = process_time()
    edit_answer(value)
    return process_time() - began


def _answer_time(server: EditServer, value: dict[str, Any]) -> float:
    line = http.client.HTTPConnection("127.0.0.1", server.server_port)
    headers = {"Origin": server.origin, "Content-Type": "application/json"}
    began = perf_counter()
    line.request("POST", f"/{server.token}/answer", json.dumps({"document": value}), headers)
    found = json.loads(line.getresponse().read())
    taken = perf_counter() - began
    if found["problem"]:
        raise RuntimeError(found["problem"])
    return taken


def main() -> None:
    """Measure and print."""
    times = drag_times()
    print(
        f"a pin of a ten-link dragged: {median(times):.1f} ms in the median of {len(times)}, {max(times):.1f} at most"
    )
    for name, (taken, worked) in answer_times().items():
        print(f"a change of structure, {name}: {taken:.3f} s, of the processor {worked:.3f} s")


if __name__ == "__main__":
    main()

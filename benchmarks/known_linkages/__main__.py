"""`python -m benchmarks.known_linkages` makes random tasks from known linkages and checks their complete lists.

Every task is solved in a process of its own, which is ended after `--seconds` of processor time. Results are kept, one
a line, so that a run goes on where it was interrupted; `--save` writes the tasks with a fault into a folder.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import signal
from collections import Counter
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.known_linkages.checks import check_task
from benchmarks.known_linkages.known_tasks import MOST_CONDITIONS, draw_task
from benchmarks.known_linkages.makers import MAKERS

try:
    import resource
except ImportError:  # Windows has no limits of processor time
    resource = None  # type: ignore[assignment]

Record = dict[str, Any]
TOO_LONG = "takes too long"
MAX_WAIT = 15
"""Times the processor time: how long a task may last on a busy machine."""


def main() -> None:
    """Check tasks that are not among the results, then print the table of faults."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.known_linkages", description=__doc__)
    parser.add_argument("--count", type=int, default=200, help="tasks of each kind of linkage")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", nargs="+", choices=[*MAKERS], default=[*MAKERS], help="kinds of linkages")
    parser.add_argument("--free", type=int, default=MOST_CONDITIONS + 1, help="the most free numbers of a task")
    parser.add_argument("--seconds", type=int, default=20, help="processor time for one task")
    parser.add_argument("--results", type=Path, default=None, help="a file of results, one a line")
    parser.add_argument("--save", type=Path, default=None, help="a folder for tasks with a fault")
    arguments = parser.parse_args()
    import_module("planar.synthesis.exact.exact_synthesis")  # once, not in every process
    console = Console(width=160)
    records: list[Record] = []
    if arguments.results is not None and arguments.results.exists():
        records = [json.loads(line) for line in arguments.results.read_text().splitlines()]
    done = {(record["kind"], record["seed"]) for record in records}
    for seed in range(arguments.first, arguments.first + arguments.count):
        for kind in arguments.only:
            if (kind, seed) in done or len(draw_task(kind, seed).free) > arguments.free:
                continue
            records.append(record := check_apart(kind, seed, arguments.seconds))
            if arguments.results is not None:
                with arguments.results.open("a") as file:
                    file.write(json.dumps(record) + "\n")
            if arguments.save is not None and record["faults"]:
                save_task(arguments.save, kind, seed)
            faults = "; ".join(f"{name}: {detail}" for name, detail in record["faults"])
            console.print(f"{kind} {seed}: {record['task']}: {faults or 'ok'}", highlight=False, soft_wrap=True)
    for table in tables(records):
        console.print(table)


def check_apart(kind: str, seed: int, seconds: int) -> Record:
    """What came of a task, in a process of its own."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.Process(target=_check, args=(kind, seed, seconds, sender))
    process.start()
    sender.close()
    task = draw_task(kind, seed)
    record: Record = {"kind": kind, "seed": seed, "task": task.name, "verdict": task.verdict.value}
    record |= {"answer": "", "seconds": seconds, "is_lost": False}
    too_long = [[TOO_LONG, f"more than {seconds} s"]]
    try:
        return record | (receiver.recv() if receiver.poll(seconds * MAX_WAIT) else {"faults": too_long})
    except EOFError:
        process.join()
        is_late = resource is not None and process.exitcode == -signal.SIGXCPU
        return record | {"faults": too_long if is_late else [["the process ended", f"status {process.exitcode}"]]}
    finally:
        process.kill()
        process.join()


def _check(kind: str, seed: int, seconds: int, sender: Connection) -> None:
    if resource is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    outcome = check_task(draw_task(kind, seed))
    sender.send(
        {
            "answer": outcome.answer,
            "seconds": round(outcome.seconds, 2),
            "is_lost": outcome.is_lost,
            "faults": [[*fault] for fault in outcome.faults],
        }
    )


def save_task(folder: Path, kind: str, seed: int) -> None:
    """Write a task's file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{kind.replace(' ', '-')}-{seed}.json"
    path.write_text(json.dumps(draw_task(kind, seed).value, indent=1) + "\n")


def tables(records: list[Record]) -> list[Table]:
    """Faults by kind, and kinds of linkages with their tasks."""
    faults = Table("fault", "tasks", "seeds", title="Faults by kind")
    by_fault: dict[str, list[Record]] = {}
    for record in records:
        for name in {name for name, _ in record["faults"]}:
            by_fault.setdefault(name, []).append(record)
    for name, own in sorted(by_fault.items(), key=lambda each: -len(each[1])):
        seeds = ", ".join(f"{record['kind']} {record['seed']}" for record in own[:8])
        faults.add_row(name, str(len(own)), seeds)
    kinds = Table("linkage", "tasks", "right", "too long", "lost paths", "median s", title="Tasks")
    for kind in dict.fromkeys(record["kind"] for record in records):
        own = [record for record in records if record["kind"] == kind]
        seconds = sorted(record["seconds"] for record in own)
        counts = Counter(
            "right" if not record["faults"] else "long" if record["faults"][0][0] == TOO_LONG else "" for record in own
        )
        lost = sum(record["is_lost"] for record in own)
        right, long = str(counts["right"]), str(counts["long"])
        kinds.add_row(kind, str(len(own)), right, long, str(lost), f"{seconds[len(own) // 2]:.2f}")
    return [faults, kinds]


if __name__ == "__main__":
    main()

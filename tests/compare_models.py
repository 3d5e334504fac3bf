"""Two versions of planar compared over all models: solutions, runs, lists, drawings and the data of pages.

    python -m tests.compare_models record FOLDER      # what the planar of this folder says of every model
    python -m tests.compare_models FOLDER FOLDER      # where two such records differ

An older version is recorded from a checkout of its own, with PYTHONPATH: `python .../compare_models.py record FOLDER`;
models may be named after the folder, and WORKERS says how many are asked at once.
Texts must be the same but for their numbers, which may differ by rounding, or in the last digit that is printed.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

COMMANDS = {
    "solve.json": ("solve", "--json"),
    "centres.json": ("centres", "--json"),
    "forces.json": ("forces", "--json"),
    "inspect.json": ("inspect", "--json"),
    "modes.json": ("modes", "--json"),
    "cycle.json": ("cycle", "--json", "--steps", "24"),
    "explain.txt": ("explain",),
    "page.html": ("view", "-o", "page.html"),
    **{
        f"{name}.svg": ("plot", "-o", f"{name}.svg", name)
        for name in ("scheme", "velocity", "acceleration", "forces", "diagrams")
    },
}
"""What is asked of each model, by the file that it is kept in."""
PRINTED, EXACT = 2e-4, 1e-9
"""Relative differences that are nothing: of numbers printed for people, and of those with all their digits."""
ROUND_OFF = 1e-9
"""Numbers below this are what rounding leaves (SI)."""
ON_PAPER = 0.02
"""What coordinates of a drawing may differ by, in its units."""
ASKING = """
from contextlib import redirect_stderr, redirect_stdout
from planar.cli import main

for file, words in {commands!r}:
    with open(file + ".out", "w", encoding="utf-8") as out, redirect_stdout(out), redirect_stderr(out):
        try:
            main([words[0], {name!r}, *words[1:]], prog_name="planar")
        except SystemExit as ending:
            print("status", ending.code, file=out)
"""
"""What asks one model everything, in a process of its own."""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


def record(folder: Path, models: list[str] | None = None) -> None:
    """Write what this version says of every model to files in a folder."""
    import planar

    names = models or sorted(path.stem for path in (Path(planar.__file__).parents[1] / "models").rglob("*.json"))

    def one(name: str) -> None:
        own = folder / name
        own.mkdir(parents=True, exist_ok=True)
        script = ASKING.format(commands=list(COMMANDS.items()), name=name)
        subprocess.run([sys.executable, "-c", script], cwd=own, check=True, env=os.environ | {"COLUMNS": "200"})

    with ThreadPoolExecutor(int(os.environ.get("WORKERS", os.cpu_count() or 1))) as pool:
        list(pool.map(one, names))


def text_of(path: Path) -> str:
    """What is compared of a file: of pages the data that they carry, not their scripts."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".html":
        text = "".join(re.findall(r'<script id="data"[^>]*>(.*?)</script>', text, re.DOTALL))
    return text


def differences(before: str, after: str, relative: float, absolute: float) -> Iterator[str]:
    """Where two texts differ by more than their numbers may."""
    if NUMBER.sub("#", before) != NUMBER.sub("#", after):
        pairs = zip(before.splitlines(), after.splitlines(), strict=False)
        changed = (f"{a[:150]!r} is now {b[:150]!r}" for a, b in pairs if NUMBER.sub("#", a) != NUMBER.sub("#", b))
        yield next(changed, "lengths differ")
        return
    for a, b in zip(NUMBER.findall(before), NUMBER.findall(after), strict=True):
        x, y = float(a), float(b)
        if abs(x - y) > max(absolute, relative * max(abs(x), abs(y))):
            yield f"{a} is now {b}"


def compare(before: Path, after: Path) -> int:
    """Print where two records differ; gives how many files do."""
    files = sorted(
        {path.relative_to(folder) for folder in (before, after) for path in folder.rglob("*.*") if path.is_file()}
    )
    count = 0
    for file in files:
        if not ((before / file).exists() and (after / file).exists()):
            print(f"{file}: only {'after' if (after / file).exists() else 'before'}")
            count += 1
            continue
        drawn = file.suffix == ".svg"
        relative = EXACT if file.name.endswith((".json.out", ".html")) else PRINTED
        texts = text_of(before / file), text_of(after / file)
        found = list(differences(*texts, relative, ON_PAPER if drawn else ROUND_OFF))
        if found:
            print(f"{file}: {len(found)} differences; {found[0]}")
            count += 1
    print(f"{len(files)} files, {count} differ")
    return count


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["record"] and len(words) >= 2:
        record(Path(words[1]), words[2:] or None)
    elif len(words) == 2:
        sys.exit(bool(compare(*map(Path, words))))
    else:
        sys.exit(__doc__)

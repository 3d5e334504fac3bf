"""Texts made fit to draw: what the font can show, how large that is on paper, and lines of a given width."""

from __future__ import annotations

from bisect import bisect_left
from functools import lru_cache
from typing import NamedTuple

from planar.drawing.labels.fonts import shown
from planar.drawing.labels.text_line import text_line
from planar.drawing.paper.pens import POINT, ready
from planar.drawing.paper.picture import Letter

LONGEST = 60
"""Characters of a plain letter that are shown; of longer ones the middle is left out."""


class Size(NamedTuple):
    """What a line of text takes on paper (mm): width, height, and how much of the height is below its base line."""

    width: float
    height: float
    below: float


def fit(letter: Letter) -> Letter:
    """The letter with a text that can be drawn as it stands; `math` stays only where that is mathtext without fault."""
    ready()
    text = shown(letter.text, letter.slanted)
    math = letter.math and "$" in text
    if math:
        try:
            measured(text, letter.size, letter.slanted, True)
        except ValueError:
            math = False
    if not math and len(text) > LONGEST:
        text = f"{text[: LONGEST * 2 // 3]} … {text[3 - LONGEST // 3 :]}"
    return letter._replace(text=text, math=math)


def joined(letters: list[Letter]) -> Letter:
    """One letter for several of one size and slant at one spot: their texts in the order given, as "a, d, g"."""
    first, texts = letters[0], list(dict.fromkeys(each.text for each in letters))
    if len(texts) > 1 and any(each.math for each in letters):
        plain = {each.text: each.text.replace("$", r"\$") for each in letters if not each.math}
        texts = [plain.get(text, text) for text in texts]
    abouts = dict.fromkeys(each.about for each in letters if each.about)
    return first._replace(
        text=", ".join(texts),
        about=", ".join(abouts),
        away=max(each.away for each in letters),
        math=any(each.math for each in letters),
    )


@lru_cache(maxsize=4096)
def measured(text: str, points: float, slanted: bool = False, math: bool = False, heavy: bool = False) -> Size:
    """The size on paper of one line of text (mm). Raises ValueError where mathtext is faulty."""
    line, size = text_line(text, math, slanted, heavy), POINT * points
    return Size(size * line.width, size * (line.up + line.down), size * line.down)


def wrapped(text: str, points: float, width: float, heavy: bool = False) -> list[str]:
    """A plain text as lines of at most so many mm, broken at spaces and within a word that is too long by itself."""

    def fits(part: str) -> bool:
        return measured(part, points, heavy=heavy).width <= width

    # no letter is narrower than a fifth of the font's size
    most = max(1, int(width / (0.2 * POINT * points)))
    lines, line = [], ""
    for word in shown(text, heavy=heavy).split():
        if len(word) <= most and fits(f"{line} {word}".strip()):
            line = f"{line} {word}".strip()
            continue
        if line:
            lines.append(line)
        rest = word
        while len(rest) > 1 and (len(rest) > most or not fits(rest)):
            # the greatest number of its characters that fit, one at least
            tried = range(1, min(len(rest) - 1, most) + 1)
            cut = max(1, bisect_left(tried, True, key=lambda n, rest=rest: not fits(rest[:n])))
            lines.append(rest[:cut])
            rest = rest[cut:]
        line = rest
    return [*lines, line] if line else lines


def clipped(text: str, points: float, room: float, heavy: bool = False) -> str:
    """A plain text on one line of at most so many mm, the rest left out."""
    text = shown(text, heavy=heavy)
    while len(text) > 1 and (wide := measured(text, points, heavy=heavy).width) > room:
        text = f"{text[: min(len(text) - 2, int(len(text) * room / wide))]}…"
    return text


def signed(value: float) -> str:
    """A number of an axis with a proper minus sign."""
    return f"{value:.6g}".replace("-", "−") if value else "0"

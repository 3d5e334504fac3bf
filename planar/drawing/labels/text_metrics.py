"""Texts made fit to draw: what the font can show, how large that is on paper, and lines of a given width."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

from planar.drawing.labels.fonts import printable_text
from planar.drawing.labels.text_line import text_line
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib
from planar.drawing.paper.picture import Label

BREAKING_SPACES = re.compile(r"[^\S\N{NO-BREAK SPACE}]+")
MAX_LABEL_LENGTH = 60
"""Characters of a plain letter that are shown; of longer ones the middle is left out."""


class TextSize(NamedTuple):
    """What a line of text takes on paper (mm): width, height, and how much of the height is below its base line."""

    width: float
    height: float
    descent: float


def fit_label(letter: Label) -> Label:
    """The letter with a text that can be drawn as it stands; `math` stays only where that is mathtext without fault."""
    require_matplotlib()
    text = printable_text(letter.text, letter.slanted)
    math = letter.math and "$" in text
    if math:
        try:
            text_size(text, letter.size, letter.slanted, True)
        except ValueError:
            math = False
    if not math and len(text) > MAX_LABEL_LENGTH:
        text = f"{text[: MAX_LABEL_LENGTH * 2 // 3]} … {text[3 - MAX_LABEL_LENGTH // 3 :]}"
    return letter._replace(text=text, math=math)


def join_labels(letters: list[Label]) -> Label:
    """One letter for several of one size and slant at one spot: their texts in the order given, as "a, d, g"."""
    first, texts = letters[0], list(dict.fromkeys(each.text for each in letters))
    if len(texts) > 1 and any(each.math for each in letters):
        plain = {each.text: each.text.replace("$", r"\$") for each in letters if not each.math}
        texts = [plain.get(text, text) for text in texts]
    abouts = dict.fromkeys(each.about for each in letters if each.about)
    return first._replace(
        text=", ".join(texts),
        about=", ".join(abouts),
        clearance=max(each.clearance for each in letters),
        math=any(each.math for each in letters),
    )


@lru_cache(maxsize=4096)
def text_size(text: str, points: float, slanted: bool = False, math: bool = False, heavy: bool = False) -> TextSize:
    """The size on paper of one line of text (mm). Raises ValueError where mathtext is faulty."""
    line, size = text_line(text, math, slanted, heavy), MM_PER_POINT * points
    return TextSize(size * line.width, size * (line.ascent + line.descent), size * line.descent)


def _fitting_length(word: str, most: int, fits: Callable[[str], bool]) -> int:
    """The greatest number of a word's characters that fit, one at least, not all and at most so many."""
    tried = range(1, min(len(word) - 1, most) + 1)
    return max(1, bisect_left(tried, True, key=lambda count: not fits(word[:count])))


def wrap_text(text: str, points: float, width: float, heavy: bool = False) -> list[str]:
    """A plain text as lines of at most so many mm, broken at spaces and within a word that is too long by itself.

    No line ends at a no-break space.
    """

    def fits(part: str) -> bool:
        return text_size(part, points, heavy=heavy).width <= width

    # no letter is narrower than a fifth of the font's size
    most = max(1, int(width / (0.2 * MM_PER_POINT * points)))
    lines, line = [], ""
    for word in (printable_text(each, heavy=heavy) for each in BREAKING_SPACES.split(text)):
        if len(word) <= most and fits(f"{line} {word}".strip()):
            line = f"{line} {word}".strip()
            continue
        if line:
            lines.append(line)
        rest = word
        while len(rest) > 1 and (len(rest) > most or not fits(rest)):
            cut = _fitting_length(rest, most, fits)
            lines.append(rest[:cut])
            rest = rest[cut:]
        line = rest
    return [*lines, line] if line else lines


def clip_text(text: str, points: float, width: float, heavy: bool = False) -> str:
    """A plain text on one line of at most so many mm, the rest left out."""
    text = printable_text(text, heavy=heavy)
    while len(text) > 1 and (wide := text_size(text, points, heavy=heavy).width) > width:
        text = f"{text[: min(len(text) - 2, int(len(text) * width / wide))]}…"
    return text


def format_tick(value: float) -> str:
    """A number of an axis with a proper minus sign."""
    return f"{value:.6g}".replace("-", "−") if value else "0"

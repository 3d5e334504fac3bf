"""Texts made fit to draw: what the font can show, how large that is on paper, and lines of a given width."""

from __future__ import annotations

from bisect import bisect_left
from functools import cache, lru_cache
from typing import TYPE_CHECKING, NamedTuple

from planar.drawing.ink import POINT, ready
from planar.drawing.picture import Letter

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties

FAMILY = "DejaVu Sans"
"""The font that comes along with matplotlib, so that a drawing is the same everywhere."""
LONGEST = 60
"""Characters of a plain letter that are shown; of longer ones the middle is left out."""
UNKNOWN = "\N{REPLACEMENT CHARACTER}"


class Size(NamedTuple):
    """What a line of text takes on paper (mm): width, height, and how much of the height is below its base line."""

    width: float
    height: float
    below: float


def font(points: float, slanted: bool = False, heavy: bool = False) -> FontProperties:
    """The font at a size (points)."""
    ready()
    from matplotlib.font_manager import FontProperties

    style, weight = "oblique" if slanted else "normal", "bold" if heavy else "normal"
    return FontProperties(family=FAMILY, style=style, weight=weight, size=points)


@cache
def _known(character: str, slanted: bool, heavy: bool) -> bool:
    """Whether the font has a glyph for it."""
    from matplotlib.font_manager import findfont, get_font

    return bool(get_font(findfont(font(9.0, slanted, heavy))).get_char_index(ord(character)))


def shown(text: str, slanted: bool = False, heavy: bool = False) -> str:
    """The text on one line, with U+FFFD for what the font lacks; spaces of any kind become plain ones."""
    spaced = " ".join(text.split())
    return "".join(each if each.isprintable() and _known(each, slanted, heavy) else UNKNOWN for each in spaced)


def fit(letter: Letter) -> Letter:
    """The letter with a text that can be drawn as it stands; `math` stays only where that is mathtext without fault."""
    ready()
    from matplotlib.cbook import is_math_text

    text = shown(letter.text, letter.slanted)
    math = letter.math and bool(is_math_text(text))
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
    ready()
    from matplotlib.textpath import text_to_path

    sizes = text_to_path.get_text_width_height_descent(text, font(points, slanted, heavy), math)
    return Size(*(float(each) * POINT for each in sizes))


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


def clipped(text: str, points: float, room: float) -> str:
    """A plain text on one line of at most so many mm, the rest left out."""
    text = shown(text)
    while len(text) > 1 and measured(text, points).width > room:
        text = f"{text[: min(len(text) - 2, int(len(text) * room / measured(text, points).width))]}…"
    return text


def signed(value: float) -> str:
    """A number of an axis with a proper minus sign."""
    return f"{value:.6g}".replace("-", "−") if value else "0"

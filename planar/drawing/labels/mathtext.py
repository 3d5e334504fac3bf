"""Pieces of phrases as formulas in mathtext; names that are no simple ones never get into a formula."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

from planar.analysis.rich_text import (
    Chord,
    Fraction,
    MeasuredValue,
    Name,
    Phrase,
    PhrasePiece,
    PolygonLetter,
    Power,
    Symbol,
    length_without_primes,
    with_double_primes,
)
from planar.drawing.labels.text_line import LETTER_PATTERN

GREEK = {"ω": r"\omega", "α": r"\alpha"}
SIMPLE_WORD = re.compile(f"{LETTER_PATTERN}(?:{LETTER_PATTERN}|[′″]){{0,23}}")
"""A name, or a word of it, that may stand in a formula; any other is set as the text that it is."""
ITALIC_NAME = re.compile(r"([^\W\d_][0-9]{0,2}[′″]*){1,2}|([A-Z][0-9]{0,2}[′″]*){1,6}")
"""Names of points, of links and of lines between points, which are slanted; words are upright."""
NUMERIC_TEXT = re.compile(r"[0-9.()×+/ −]*")
"""Numbers and what stands between them."""


def formula(piece: PhrasePiece) -> str | None:
    """A piece as mathtext, without dollars; None where it is to be set as plain text."""
    if isinstance(piece, str):
        counted = piece.replace("×", r"\times").replace("−", "-").replace(" ", r"\ ")
        return rf"\mathrm{{{counted}}}" if NUMERIC_TEXT.fullmatch(piece) and piece else None
    return _WRITERS[type(piece)](piece)


def _phrase(phrase: Phrase) -> str | None:
    return _join_parts([formula(piece) for piece in phrase])


def _join_parts(parts: list[str | None]) -> str | None:
    """The parts one after the other, if all of them are formulas."""
    return None if None in parts else "".join(filter(None, parts))


def _name(name: Name) -> str | None:
    return _word(with_double_primes(name.text)) if ITALIC_NAME.fullmatch(name.text) else None


def _symbol(symbol: Symbol) -> str | None:
    return _indexed(GREEK.get(symbol.letter) or _word(symbol.letter), symbol.subscript, symbol.superscript)


def _spot(spot: PolygonLetter) -> str | None:
    return _indexed(_word(spot.letter), spot.mark, "")


def _chord(chord: Chord) -> str | None:
    long = max(length_without_primes(chord.tail.letter), length_without_primes(chord.head.letter)) > 1
    between = r"\mathrm{–}" if long else r"\," if chord.tail.mark else ""
    return _join_parts([_spot(chord.tail), between, _spot(chord.head)])


def _raised(raised: Power) -> str | None:
    inside = _phrase(raised.base)
    return None if inside is None else f"{inside}^{{\\mathrm{{{raised.exponent}}}}}"


def _fraction(fraction: Fraction) -> str | None:
    over, under = _phrase(fraction.numerator), _phrase(fraction.denominator)
    return None if over is None or under is None else rf"\dfrac{{{over}}}{{{under}}}"


def _indexed(letter: str | None, below: str, above: str) -> str | None:
    """A letter with a subscript, of which two names may be parted by a stroke, and a superscript."""
    parts: list[str | None] = [letter]
    if below:
        names = [_words(name) for name in below.split("/")]
        parts.append(None if None in names else f"_{{{'/'.join(filter(None, names))}}}")
    if above:
        parts.append(f"^{{{above}}}")
    return _join_parts(parts)


def _words(name: str) -> str | None:
    """A name of one or several words."""
    found = [_word(word) for word in name.split(" ")]
    return None if None in found else r"\ ".join(filter(None, found))


def _word(word: str) -> str | None:
    if not SIMPLE_WORD.fullmatch(word):
        return None
    if word.isdigit():
        return rf"\mathrm{{{word}}}"
    # a prime stands where it is, in its own size: a slanted name may be of two points
    face = "mathit" if ITALIC_NAME.fullmatch(word) else "mathrm"
    return "".join(part if part[0] in "′″" else rf"\{face}{{{part}}}" for part in re.split("([′″]+)", word) if part)


_WRITERS: Mapping[type, Callable[..., str | None]] = {
    Symbol: _symbol,
    PolygonLetter: _spot,
    Chord: _chord,
    Name: _name,
    Power: _raised,
    Fraction: _fraction,
    MeasuredValue: lambda quantity: None,  # noqa: ARG005
}

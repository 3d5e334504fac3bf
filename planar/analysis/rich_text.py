"""Sentences and formulas as data: words, symbols, letters of a polygon, numbers and fractions, for any page to set."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import floor, isfinite, log10
from typing import NamedTuple, Protocol

from planar.foundation.units import printed

DIGITS = 3
"""Significant digits of what is read from a drawing; what is exact with one more has that."""
LARGE, SMALL = 1e6, 1e-4
"""From where, and below which, a number is written with a power of ten."""
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Symbol(NamedTuple):
    """A quantity's symbol: f_cb^c is Symbol("f", "cb", "c")."""

    letter: str
    subscript: str = ""
    superscript: str = ""


class Spot(NamedTuple):
    """A letter of a polygon: b, b₁ is Spot("b", "1"), b_a is Spot("b", "a")."""

    letter: str
    mark: str = ""


class Chord(NamedTuple):
    """What lies between two letters of a polygon: b₁c₁."""

    tail: Spot
    head: Spot


class Name(NamedTuple):
    """The name of a point or of a line in the space diagram: B, BC."""

    text: str


class Quantity(NamedTuple):
    """A number (SI) with its unit, `by` of which are one in SI.

    One of a `kind` that is drawn to scale has its length on paper beside it.
    """

    value: float
    unit: str = ""
    kind: str = ""
    by: float = 1.0


class Fraction(NamedTuple):
    """One phrase over another."""

    over: Phrase
    under: Phrase


class Raised(NamedTuple):
    """A phrase in brackets, or as it stands, to a power."""

    of: Phrase
    power: int


Piece = str | Symbol | Spot | Chord | Name | Quantity | Fraction | Raised
Phrase = tuple[Piece, ...]


class Paper(Protocol):
    """A scale: how many millimetres a value takes on paper."""

    def on_paper(self, value: float) -> float:
        """Millimetres for a value (SI)."""


def number(value: float, least: int = DIGITS) -> str:
    """A number as a chapter prints it: 5.51, 0.340, 26, 0.05, 3419, 1.23·10⁻⁷."""
    if value == 0.0 or not isfinite(value):
        return "0" if value == 0.0 else "—"
    sign, size = "−" if value < 0.0 else "", abs(value)
    rounded = float(f"{size:.{least + 1}g}")
    exact = abs(rounded - size) <= 1e-9 * size
    power = floor(log10(float(f"{size:.{least}g}")))
    if not SMALL <= size < LARGE:
        first = f"{size / 10.0**power:.{least - 1}f}"
        return f"{sign}{first}·10{str(power).translate(_SUPERSCRIPTS)}"
    if exact:
        return sign + f"{rounded:.10f}".rstrip("0").rstrip(".")
    return f"{sign}{size:.{max(least - 1 - power, 0)}f}"


def ratio(value: float) -> str:
    """A number with at most four digits and no zeros at its end."""
    return f"{value:.4g}" if SMALL <= abs(value) < LARGE else number(value)


def joined(phrases: Iterable[Phrase], between: str) -> Phrase:
    """Phrases with words between them."""
    found: list[Piece] = []
    for phrase in phrases:
        found += [*([between] if found else []), *phrase]
    return tuple(found)


def listed(phrases: Iterable[Phrase]) -> Phrase:
    """Phrases in a sentence: a, b and c."""
    each = list(phrases)
    if len(each) < 2:
        return each[0] if each else ()
    return (*joined(each[:-1], ", "), " and ", *each[-1])


def measured(value: Quantity, paper: Mapping[str, Paper] | None = None) -> str:
    """A number with its unit, and in brackets its length on paper where its kind has a scale."""
    told = f"{number(value.value * value.by)} {printed(value.unit)}".rstrip()
    scale = (paper or {}).get(value.kind)
    return told if scale is None else f"{told} ({scale.on_paper(abs(value.value)):.1f} mm)"


def plain(phrase: Phrase, paper: Mapping[str, Paper] | None = None) -> str:
    """A phrase as a line of text: f_cb^c, b₁c_b, (ab)²/AB."""
    return "".join(_plain(piece, paper) for piece in phrase)


def _plain(piece: Piece, paper: Mapping[str, Paper] | None) -> str:
    if isinstance(piece, str):
        return piece
    if isinstance(piece, Name):
        return primed(piece.text)
    if isinstance(piece, Quantity):
        return measured(piece, paper)
    if isinstance(piece, Fraction | Raised):
        return _fraction(piece, paper) if isinstance(piece, Fraction) else _raised(piece, paper)
    return _lettered(piece)


def _lettered(piece: Symbol | Spot | Chord) -> str:
    if isinstance(piece, Symbol):
        return _symbol(piece)
    return _spot(piece) if isinstance(piece, Spot) else _spot(piece.tail) + between(piece) + _spot(piece.head)


def _raised(raised: Raised, paper: Mapping[str, Paper] | None) -> str:
    return plain(raised.of, paper) + str(raised.power).translate(_SUPERSCRIPTS)


def _fraction(fraction: Fraction, paper: Mapping[str, Paper] | None) -> str:
    over, under = plain(fraction.over, paper), plain(fraction.under, paper)
    return f"{over}/({under})" if " " in under else f"{over}/{under}"


def between(chord: Chord) -> str:
    """What stands between the letters of a chord: a dash where they are long, a space where the first has a letter."""
    if max(bare(chord.tail.letter), bare(chord.head.letter)) > 1:
        return "–"
    return "\N{NO-BREAK SPACE}" if chord.tail.mark and not chord.tail.mark.isdigit() else ""


def primed(name: str) -> str:
    """A name as it is written: two primes as one double prime."""
    return name.replace("′′", "″")


def bare(name: str) -> int:
    """The length of a name without its primes."""
    return len(name.rstrip("′″"))


def _spot(spot: Spot) -> str:
    if not spot.mark:
        return spot.letter
    return spot.letter + (spot.mark.translate(_SUBSCRIPTS) if spot.mark.isdigit() else f"_{spot.mark}")


def _symbol(symbol: Symbol) -> str:
    above = f"^{symbol.superscript}" if symbol.superscript else ""
    if not symbol.subscript:
        return symbol.letter + above
    below = f"_{symbol.subscript}" if " " not in symbol.subscript else f"({symbol.subscript})"
    return symbol.letter + below + above

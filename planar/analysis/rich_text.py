"""Sentences and formulas as data (words, symbols, numbers, fractions), to be typeset by any page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import floor, isfinite, log10
from typing import NamedTuple, Protocol

from planar.foundation.units import format_unit

SIGNIFICANT_DIGITS = 3
"""Significant digits of what is read from a drawing; what is exact with one more has that."""
SCIENTIFIC_FROM, SCIENTIFIC_BELOW = 1e6, 1e-4
"""From where, and below which, a number is written with a power of ten."""
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Symbol(NamedTuple):
    """A quantity's symbol: f_cb^c is Symbol("f", "cb", "c")."""

    letter: str
    subscript: str = ""
    superscript: str = ""


class PolygonLetter(NamedTuple):
    """A letter of a polygon: b, b₁ is Spot("b", "1"), b_a is Spot("b", "a")."""

    letter: str
    mark: str = ""


class Chord(NamedTuple):
    """What lies between two letters of a polygon: b₁c₁."""

    tail: PolygonLetter
    head: PolygonLetter


class Name(NamedTuple):
    """The name of a point or of a line in the space diagram: B, BC."""

    text: str


class MeasuredValue(NamedTuple):
    """A number (SI) with its unit, `by` of which are one in SI.

    One of a `kind` that is drawn to scale has its length on paper beside it.
    """

    value: float
    unit: str = ""
    kind: str = ""
    units_per_si: float = 1.0


class Fraction(NamedTuple):
    """One phrase over another."""

    numerator: Phrase
    denominator: Phrase


class Power(NamedTuple):
    """A phrase in brackets, or as it stands, to a power."""

    base: Phrase
    exponent: int


PhrasePiece = str | Symbol | PolygonLetter | Chord | Name | MeasuredValue | Fraction | Power
Phrase = tuple[PhrasePiece, ...]


class PaperScale(Protocol):
    """A scale: what length a value takes on paper."""

    def paper_text(self, value: float) -> str:
        """The length of a value (SI) with its unit."""


def format_number(value: float, digits: int = SIGNIFICANT_DIGITS) -> str:
    """A number as a chapter prints it: 5.51, 0.340, 26, 0.05, 3419, 1.23·10⁻⁷."""
    if value == 0.0 or not isfinite(value):
        return "0" if value == 0.0 else "—"
    sign, size = "−" if value < 0.0 else "", abs(value)
    rounded = float(f"{size:.{digits + 1}g}")
    exact = abs(rounded - size) <= 1e-9 * size
    power = floor(log10(float(f"{size:.{digits}g}")))
    if not SCIENTIFIC_BELOW <= size < SCIENTIFIC_FROM:
        first = f"{size / 10.0**power:.{digits - 1}f}"
        return f"{sign}{first}·10{str(power).translate(_SUPERSCRIPTS)}"
    if exact:
        return sign + f"{rounded:.10f}".rstrip("0").rstrip(".")
    return f"{sign}{size:.{max(digits - 1 - power, 0)}f}"


def format_ratio(value: float) -> str:
    """A number with at most four digits and no zeros at its end."""
    return f"{value:.4g}" if SCIENTIFIC_BELOW <= abs(value) < SCIENTIFIC_FROM else format_number(value)


def join_phrases(phrases: Iterable[Phrase], between: str) -> Phrase:
    """Phrases with words between them."""
    found: list[PhrasePiece] = []
    for phrase in phrases:
        found += [*([between] if found else []), *phrase]
    return tuple(found)


def list_phrases(phrases: Iterable[Phrase]) -> Phrase:
    """Phrases in a sentence: a, b and c."""
    each = list(phrases)
    if len(each) < 2:
        return each[0] if each else ()
    return (*join_phrases(each[:-1], ", "), " and ", *each[-1])


def format_measured(value: MeasuredValue, paper: Mapping[str, PaperScale] | None = None) -> str:
    """A number with its unit, and in brackets its length on paper where its kind has a scale."""
    told = f"{format_number(value.value * value.units_per_si)} {format_unit(value.unit)}".rstrip()
    scale = (paper or {}).get(value.kind)
    return told if scale is None else f"{told} ({scale.paper_text(abs(value.value))})"


def plain_text(phrase: Phrase, paper: Mapping[str, PaperScale] | None = None) -> str:
    """A phrase as a line of text: f_cb^c, b₁c_b, (ab)²/AB."""
    return "".join(_plain_piece(piece, paper) for piece in phrase)


def _plain_piece(piece: PhrasePiece, paper: Mapping[str, PaperScale] | None) -> str:
    if isinstance(piece, str):
        return piece
    if isinstance(piece, Name):
        return with_double_primes(piece.text)
    if isinstance(piece, MeasuredValue):
        return format_measured(piece, paper)
    if isinstance(piece, Fraction | Power):
        return _fraction_text(piece, paper) if isinstance(piece, Fraction) else _power_text(piece, paper)
    return _letters_text(piece)


def _letters_text(piece: Symbol | PolygonLetter | Chord) -> str:
    if isinstance(piece, Symbol):
        return _symbol_text(piece)
    return (
        _letter_text(piece)
        if isinstance(piece, PolygonLetter)
        else _letter_text(piece.tail) + chord_separator(piece) + _letter_text(piece.head)
    )


def _power_text(raised: Power, paper: Mapping[str, PaperScale] | None) -> str:
    return plain_text(raised.base, paper) + str(raised.exponent).translate(_SUPERSCRIPTS)


def _fraction_text(fraction: Fraction, paper: Mapping[str, PaperScale] | None) -> str:
    over, under = plain_text(fraction.numerator, paper), plain_text(fraction.denominator, paper)
    return f"{over}/({under})" if " " in under else f"{over}/{under}"


def chord_separator(chord: Chord) -> str:
    """What stands between the letters of a chord: a dash where they are long, a space where the first has a letter."""
    if max(length_without_primes(chord.tail.letter), length_without_primes(chord.head.letter)) > 1:
        return "–"
    return "\N{NO-BREAK SPACE}" if chord.tail.mark and not chord.tail.mark.isdigit() else ""


def with_double_primes(name: str) -> str:
    """A name as it is written: two primes as one double prime."""
    return name.replace("′′", "″")


def length_without_primes(name: str) -> int:
    """The length of a name without its primes."""
    return len(name.rstrip("′″"))


def _letter_text(spot: PolygonLetter) -> str:
    if not spot.mark:
        return spot.letter
    return spot.letter + (spot.mark.translate(_SUBSCRIPTS) if spot.mark.isdigit() else f"_{spot.mark}")


def _symbol_text(symbol: Symbol) -> str:
    above = f"^{symbol.superscript}" if symbol.superscript else ""
    if not symbol.subscript:
        return symbol.letter + above
    below = f"_{symbol.subscript}" if " " not in symbol.subscript else f"({symbol.subscript})"
    return symbol.letter + below + above

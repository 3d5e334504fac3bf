"""Under which kind a gallery shows a mechanism, and the words by which it is found there."""

from __future__ import annotations

import re
import unicodedata

from planar.analysis.identity.mechanism_names import mechanism_names
from planar.drawing.scheme.link_bodies import all_marks
from planar.equations.mechanism_numbers import shapes_of_links
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import BeltMark, PitchLineMark, WheelMark

FOUR_BARS = "Four-bar linkages"
SLIDER_CRANKS = "Slider-cranks and their inversions"
DOUBLE_SLIDERS = "Double slider-cranks"
SIX_BARS = "Six-bar linkages"
LARGER = "Linkages of eight links and more"
OTHERS = "Other linkages"
WHEELS = "Gears, belts and racks"
OPEN = "Open chains"
KINDS = (FOUR_BARS, SLIDER_CRANKS, DOUBLE_SLIDERS, SIX_BARS, LARGER, OTHERS, WHEELS, OPEN)
"""In the order in which they are shown."""
LARGER_LINK_COUNT = 8
"""Links of the least of the larger linkages."""

SYNONYMS = (
    "four bar, four link, quadric chain",
    "five bar, five link",
    "six bar, six link",
    "eight bar, eight link",
    "slider crank, crank slider, crank and piston",
    "crank rocker, crank and rocker, lever crank",
    "double crank, drag link",
    "double rocker, rocker rocker",
    "quick return, shaper",
    "slotted lever, crank and slotted lever",
    "scotch yoke, sine mechanism, cosine mechanism",
    "elliptical trammel, ellipsograph",
    "epicyclic, planetary, sun and planet, planet gear",
    "gear, geared, toothed wheel",
    "belt, pulley",
    "toggle, knee",
    "hoecken, hoeken, hoekens, hoeckens",
    "leg, walking, strandbeest",
    "engine, piston, motor",
    "rack, rack and pinion",
    "excavator, digger",
    "lift, jack, scissors",
    "inversor, inverter",
    "parallelogram, parallel cranks",
)
"""Words of books and of readers for one thing: a mechanism that is found by one is found by all."""
NUMBERS = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


def choose_kind(mechanism: Mechanism, names: tuple[str, ...]) -> str:
    """One of KINDS, by the pairs, the names (as `planar inspect` lists them) and the number of the links."""
    if any(name.startswith("open chain") for name in names):
        return OPEN
    if any(
        isinstance(mark, WheelMark | BeltMark | PitchLineMark)
        for mark in all_marks(mechanism, shapes_of_links(mechanism))
    ):
        return WHEELS
    for words, found in (
        ("double slider-crank chain", DOUBLE_SLIDERS),
        ("slider-crank chain", SLIDER_CRANKS),
        ("four-bar chain", FOUR_BARS),
        ("six-bar", SIX_BARS),
    ):
        if any(words in name for name in names):
            return found
    return LARGER if len(mechanism.links) >= LARGER_LINK_COUNT else OTHERS


def search_text(text: str) -> str:
    """A text as it is searched: small letters without accents, hyphens and apostrophes, numbers before bars as words.

    "4-bar", "Four bar" and "fourbar" are "four bar"; the gallery's script does the same to what is looked for.
    """
    letters = "".join(each for each in unicodedata.normalize("NFKD", text.lower()) if not unicodedata.combining(each))
    words = " ".join(re.sub(r"[^\w]+|_", " ", re.sub(r"['’]", "", letters)).split())
    counted = "|".join(NUMBERS)
    words = re.sub(rf"\b({counted})(bar|link)", r"\1 \2", words)
    words = re.sub(r"\b(\d{1,2})(?= ?(?:bar|link))", lambda found: _number_word(int(found[1])), words)
    return re.sub(rf"\b({counted})(bar|link)", r"\1 \2", words)


def _number_word(number: int) -> str:
    return NUMBERS[number] if number < len(NUMBERS) else str(number)


def kind_and_search_text(mechanism: Mechanism, name: str) -> tuple[str, str]:
    """The kind of a mechanism, and the text in which a reader's words are looked for."""
    named = mechanism_names(mechanism)
    under = choose_kind(mechanism, named)
    text = search_text(" ; ".join((mechanism.name, mechanism.about or "", name, *mechanism.ids, *named, under)))
    alike = [each.split(", ") for each in SYNONYMS]
    more = [word for words in alike if any(f" {word}" in f" {text}" for word in words) for word in words]
    return under, " ".join([text, *more])

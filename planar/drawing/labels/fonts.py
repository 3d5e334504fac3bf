"""Fonts for texts: the family that a drawing is set in, and installed ones that have what it lacks."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache, partial
from logging import ERROR, getLogger
from typing import TYPE_CHECKING, Literal
from unicodedata import category

from planar.drawing.paper.pens import require_matplotlib
from planar.foundation.errors import MissingGlyphs

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties
    from matplotlib.ft2font import FT2Font

DRAWING_FAMILY = "DejaVu Sans"
"""The font that comes along with matplotlib, so that a drawing is the same everywhere."""
BOOK_FAMILY = "STIXGeneral"
"""The book face that comes along with matplotlib, for printed pages."""
UNKNOWN_CHARACTER = "\N{REPLACEMENT CHARACTER}"
"""Shown for a character that no font has."""
LAYOUT = ("GSUB", "GPOS", "GDEF", "BASE", "MATH", "kern")
"""Tables of a font that tell how its letters stand together."""
LAST_RESORT = "Last Resort"
"""A font that has boxes for everything."""
JAPANESE_FONTS = (
    "Noto Sans CJK JP",
    "Noto Sans JP",
    "Source Han Sans JP",
    "Hiragino Sans",
    "Yu Gothic",
    "Meiryo",
    "MS Gothic",
    "IPAGothic",
)
KOREAN_FONTS = (
    "Noto Sans CJK KR",
    "Noto Sans KR",
    "Source Han Sans KR",
    "Apple SD Gothic Neo",
    "Malgun Gothic",
    "NanumGothic",
)
CHINESE_FONTS = (
    "Noto Sans CJK SC",
    "Noto Sans SC",
    "Source Han Sans SC",
    "PingFang SC",
    "Microsoft YaHei",
    "SimHei",
    "WenQuanYi Micro Hei",
    "WenQuanYi Zen Hei",
    "Droid Sans Fallback",
    "Noto Sans CJK TC",
    "PingFang TC",
    "Microsoft JhengHei",
)
WIDE_COVERAGE_FONTS = ("Noto Sans", "Arial Unicode MS", "Segoe UI", "FreeSans")
"""Fonts without serifs that have letters of many scripts."""
FONTS_BY_SCRIPT = (
    (re.compile("[\u3040-\u30ff]"), JAPANESE_FONTS),
    (re.compile("[\u1100-\u11ff\uac00-\ud7af]"), KOREAN_FONTS),
)
"""Letters that tell a language, and fonts that draw the characters it shares with others as it does."""


def font_properties(
    points: float, slanted: bool = False, heavy: bool = False, families: tuple[str, ...] = (DRAWING_FAMILY,)
) -> FontProperties:
    """The font of a size (points), the first of the families that has a character."""
    require_matplotlib()
    return _cached_font_properties(points, slanted, heavy, families)


@lru_cache(maxsize=1024)
def _cached_font_properties(points: float, slanted: bool, heavy: bool, families: tuple[str, ...]) -> FontProperties:
    from matplotlib.font_manager import FontProperties

    slope: Literal["italic", "oblique"] = "italic" if families[0] == BOOK_FAMILY else "oblique"
    return FontProperties(
        family=list(families), style=slope if slanted else "normal", weight="bold" if heavy else "normal", size=points
    )


def font_families(
    text: str, slanted: bool = False, heavy: bool = False, first: str = DRAWING_FAMILY
) -> tuple[str, ...]:
    """The families that a text is set in: the first, with those after it that have what it lacks.

    A text that the drawings' family has all of, and the first has not, is set in that alone.
    """
    lacking = _missing_characters(text, first, slanted, heavy)
    if not lacking:
        return (first,)
    if first != DRAWING_FAMILY and not _missing_characters(text, DRAWING_FAMILY, slanted, heavy):
        return (DRAWING_FAMILY,)
    return (first, *_fallback_families(lacking, slanted, heavy, _installed_count()))


def printable_text(text: str, slanted: bool = False, heavy: bool = False) -> str:
    """The text on one line, with U+FFFD for what cannot be shown; spaces of any kind become plain ones.

    Warns of characters that no installed font has (MissingGlyphs).
    """
    spaced = " ".join("".join(each for each in text if category(each) != "Cf").split())
    plain = "".join(each if each.isprintable() else UNKNOWN_CHARACTER for each in spaced)
    lacking = _missing_characters(plain, DRAWING_FAMILY, slanted, heavy)
    if not lacking:
        return plain
    absent = _characters_in_none(
        lacking, _fallback_families(lacking, slanted, heavy, _installed_count()), slanted, heavy
    )
    if absent:
        warnings.warn(MissingGlyphs(absent), stacklevel=2)
    return "".join(UNKNOWN_CHARACTER if each in absent else each for each in plain)


def select_fonts(lacking: frozenset[str], fonts: Iterable[tuple[str, Callable[[str], bool]]]) -> list[str]:
    """The fewest of the fonts (name, whether it has a character), best first, that have what any has of the characters.

    A font that has all of them is taken at once; else the one with the most of them, the first of those alike, and then
    of the rest.
    """
    tried = []
    for name, has in fonts:
        having = frozenset(filter(has, lacking))
        if having == lacking:
            return [name]
        if having:
            tried.append((name, having))
    found, left = [], lacking
    while tried and left:
        name, having = max(tried, key=lambda each: len(each[1] & left))
        if not having & left:
            break
        found.append(name)
        left -= having
    return found


@contextmanager
def quiet_font_logs() -> Iterator[None]:
    """The libraries of fonts do not tell how old or how heavy a font is."""
    logs = [(log, log.level) for log in map(getLogger, ("fontTools", "matplotlib.font_manager"))]
    for log, _ in logs:
        log.setLevel(ERROR)
    try:
        yield
    finally:
        for log, level in logs:
            log.setLevel(level)


@contextmanager
def outlines_only() -> Iterator[None]:
    """Fonts embedded in PDF files leave out ligatures, kerning and marks: a PDF places each letter by itself.

    To cut those tables down takes longer than all the rest of embedding. matplotlib hands on no choice of tables, so
    fontTools' own list of those that no file needs is longer meanwhile.
    """
    from fontTools.subset import Options

    kept = getattr(Options, "_drop_tables_default", None)
    if kept is None:  # a fontTools that keeps no such list: files are larger, and no more
        yield
        return
    Options._drop_tables_default = [*kept, *LAYOUT]
    try:
        yield
    finally:
        Options._drop_tables_default = kept


def have_truetype_outlines(used: Iterable[str]) -> bool:
    """Whether all families have outlines of the kind that PDF files embed as they are (TrueType's, not CFF's)."""
    for family in sorted({*used} - {DRAWING_FAMILY, BOOK_FAMILY}):
        from fontTools.ttLib import TTFont
        from matplotlib.font_manager import findfont

        path = findfont(font_properties(9.0, families=(family,)))
        with TTFont(path, fontNumber=getattr(path, "face_index", 0), lazy=True) as file:
            if "glyf" not in file:
                return False
    return True


def _installed_count() -> int:
    """How many fonts are installed: what was found holds as long as there come no more."""
    from matplotlib.font_manager import fontManager

    return len(fontManager.ttflist)


@lru_cache(maxsize=4096)
def _missing_characters(text: str, family: str, slanted: bool, heavy: bool) -> frozenset[str]:
    """The characters of a text that a family lacks."""
    return frozenset(_characters_in_none({each for each in text if not each.isspace()}, (family,), slanted, heavy))


def _characters_in_none(characters: Iterable[str], among: Iterable[str], slanted: bool, heavy: bool) -> set[str]:
    """The characters that none of the families has."""
    return {each for each in characters if not any(_has_character(family, slanted, heavy, each) for family in among)}


@lru_cache(maxsize=65536)
def _has_character(family: str, slanted: bool, heavy: bool, character: str) -> bool:
    return _can_draw(_open_font(family, slanted, heavy), character)


@lru_cache(maxsize=256)
def _open_font(family: str, slanted: bool, heavy: bool) -> FT2Font:
    require_matplotlib()
    from matplotlib.font_manager import findfont, get_font

    with quiet_font_logs():
        return get_font(findfont(font_properties(10.0, slanted, heavy, (family,))))


def _can_draw(made: FT2Font, character: str) -> bool:
    """Whether a font has a character, and outlines of it: some have pictures in colour alone."""
    code = ord(character)
    if not made.get_char_index(code):
        return False
    try:
        made.set_size(10.0, 72.0)
        made.load_char(code)
    except RuntimeError:
        return False
    return True


@lru_cache(maxsize=256)
def _fallback_families(lacking: frozenset[str], slanted: bool, heavy: bool, _font_count: int) -> tuple[str, ...]:
    """Families that have characters which the usual one lacks; of likely ones, else of all that are installed."""
    with quiet_font_logs():
        found = select_fonts(lacking, _candidate_fonts(lacking, slanted, heavy))
        if _characters_in_none(lacking, found, slanted, heavy) and _add_new_fonts():
            found = select_fonts(lacking, _candidate_fonts(lacking, slanted, heavy))
    return tuple(found)


def _candidate_fonts(
    lacking: frozenset[str], slanted: bool, heavy: bool
) -> Iterator[tuple[str, Callable[[str], bool]]]:
    """Families with what tells whether they have a character: likely ones first, then all others by their names."""
    from matplotlib.font_manager import fontManager, get_font

    text = "".join(sorted(lacking))
    told = [names for script, names in FONTS_BY_SCRIPT if script.search(text)]
    named = {each.name for each in fontManager.ttflist}
    likely = dict.fromkeys(
        name
        for names in (*told, CHINESE_FONTS, JAPANESE_FONTS, KOREAN_FONTS, WIDE_COVERAGE_FONTS)
        for name in names
        if name in named
    )
    for name in likely:
        yield name, partial(_has_character, name, slanted, heavy)
    files = {each.fname: each.name for each in fontManager.ttflist if not getattr(each, "index", 0)}
    for file, name in sorted(files.items(), key=lambda each: (each[1], each[0])):
        if name in likely or name.startswith(LAST_RESORT):
            continue
        try:
            made = get_font(file)
        except (OSError, RuntimeError):
            continue
        yield name, partial(_can_draw, made)


def _add_new_fonts() -> bool:
    """Add fonts that were installed since matplotlib listed them, which it does once; whether there were any."""
    from matplotlib.font_manager import findSystemFonts, fontManager

    before = len(fontManager.ttflist)
    for file in sorted({*findSystemFonts()} - {each.fname for each in fontManager.ttflist}):
        try:
            fontManager.addfont(file)
        except (OSError, RuntimeError, KeyError, ValueError):  # whatever ails a font that is not used
            continue
    return len(fontManager.ttflist) > before

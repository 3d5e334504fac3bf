"""Fonts for tests: those that come along with matplotlib alone, and ones that are made for a few characters."""

from pathlib import Path

import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.t2CharStringPen import T2CharStringPen
from fontTools.pens.ttGlyphPen import TTGlyphPen

EM, ADVANCE, HEIGHT = 1000, 900, 800
"""Units of the fonts that are made: of their size, of a character's width, and of its height; it is a filled square."""


@pytest.fixture
def own_fonts(monkeypatch):
    """Only the fonts that matplotlib brings along are installed."""
    import matplotlib
    from matplotlib import font_manager

    own = [each for each in font_manager.fontManager.ttflist if each.fname.startswith(matplotlib.get_data_path())]
    monkeypatch.setattr(font_manager.fontManager, "ttflist", own)
    monkeypatch.setattr(font_manager, "findSystemFonts", lambda: [])
    return monkeypatch


def made(folder: Path, family: str, characters: str, outlines: str = "glyf") -> Path:
    """A font file whose characters are filled squares, with outlines as TrueType has them or as CFF has them."""
    names = [".notdef", *(f"c{ord(each):04X}" for each in characters)]
    build = FontBuilder(EM, isTTF=outlines == "glyf")
    build.setupGlyphOrder(names)
    build.setupCharacterMap({ord(each): f"c{ord(each):04X}" for each in characters})
    drawn = {}
    for name in names:
        pen = TTGlyphPen(None) if outlines == "glyf" else T2CharStringPen(ADVANCE, None)
        pen.moveTo((50, 0))
        for corner in ((50, HEIGHT), (850, HEIGHT), (850, 0)):
            pen.lineTo(corner)
        pen.closePath()
        drawn[name] = pen.glyph() if outlines == "glyf" else pen.getCharString()
    if outlines == "glyf":
        build.setupGlyf(drawn)
    else:
        build.setupCFF(family.replace(" ", ""), {}, drawn, {})
    build.setupHorizontalMetrics(dict.fromkeys(names, (ADVANCE, 50)))
    build.setupHorizontalHeader(ascent=HEIGHT, descent=-200)
    build.setupNameTable({"familyName": family, "styleName": "Regular", "psName": family.replace(" ", "")})
    build.setupOS2(usWeightClass=400)
    build.setupPost()
    file = folder / f"{family}.{'ttf' if outlines == 'glyf' else 'otf'}"
    build.save(file)
    return file

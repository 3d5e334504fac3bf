"""The construction of a polygon in sentences that a pencil can follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planar.analysis.polygons.notation import Notation
from planar.analysis.polygons.polygon import Meeting, MeetingSide, PointImage, PolygonVector, VectorPart
from planar.analysis.rate_equations import rate_equations
from planar.analysis.rich_text import Fraction, Name, Phrase, PolygonLetter, format_ratio, join_phrases, list_phrases
from planar.foundation.units import parse_unit
from planar.model.mechanism import named_points


@dataclass(frozen=True)
class ConstructionSteps:
    """Sentences about one polygon."""

    notation: Notation

    def pole(self) -> Phrase:
        """Where it starts."""
        spots = [(self.notation.polygon_letter(letter),) for letter in self.notation.poles]
        what = "velocity" if self.notation.order == 1 else "acceleration"
        if not spots:
            return (f"Take a pole: what is fixed has no {what}.",)
        return ("Take the pole ", *join_phrases(spots, ", "), f": what is fixed has no {what}.")

    def side(self, side: MeetingSide) -> list[Phrase]:
        """The known vectors of a side, one after the other, and how its unknown ones are ruled."""
        found: list[Phrase] = []
        for index, vector in enumerate(side.vectors):
            found.append(
                self._known_vector(vector, index == 0) if vector.known else self._unknown_vector(vector, index == 0)
            )
        return found

    def meeting(self, meeting: Meeting, early: Sequence[Phrase], later: Sequence[Phrase]) -> list[Phrase]:
        """Both sides, and the point in which they meet; `early` and `later` lead to where either starts."""
        first, second = sorted(meeting.sides, key=lambda side: len(_unknown_vectors(side)), reverse=True)
        if len(_unknown_vectors(first)) == 2 and not _unknown_vectors(second):
            return [*early, *later, *self._two_lines(meeting, first, second)]
        if not _unknown_vectors(second):
            return [*early, *later, *self._one_line(meeting, first, second)]
        first, second = meeting.sides
        found = [*early, *self.side(first), *later]
        last = self.side(second)
        spot = self.notation.polygon_letter(meeting.letter)
        return [*found, *last[:-1], _with_other_end(last[-1], ("; the two lines meet in ", spot, "."))]

    def _one_line(self, meeting: Meeting, first: MeetingSide, second: MeetingSide) -> list[Phrase]:
        """One unknown length: the line ends in a point that is drawn already."""
        spot = self.notation.polygon_letter(meeting.letter)
        reached = self.side(second)
        found = self.side(first)
        if not _unknown_vectors(first):
            return [*reached, *found]
        return [*reached, *found[:-1], _with_other_end(found[-1], ("; it ends in ", spot, ", which is drawn already."))]

    def _two_lines(self, meeting: Meeting, first: MeetingSide, second: MeetingSide) -> list[Phrase]:
        """Two unknown lengths one after the other, between points that are drawn."""
        found = self.side(second)
        one, two = _unknown_vectors(first)
        for index, vector in enumerate(first.vectors):
            if vector.known:
                found.append(self._known_vector(vector, index == 0))
        tail, head, end = (self.notation.polygon_letter(letter) for letter in (one.tail, one.head, meeting.letter))
        found.append(("Through ", tail, " draw ", *self.notation.line_to_draw(one), "; ", head, " lies on it."))
        text = ("Through ", end, " draw ", *self.notation.line_to_draw(two), "; the two lines meet in ", head, ".")
        return [*found, text]

    def _known_vector(self, vector: PolygonVector, first: bool) -> Phrase:
        notation = self.notation
        chord = notation.chord(vector.tail, vector.head)
        if not notation.vector_length(vector.value):
            return (chord, " = 0: ", chord.head, " falls in ", chord.tail, ".")
        name = ", the Coriolis component, " if vector.part is VectorPart.CORIOLIS else " "
        drawn = (chord, " = ", notation.drawn_magnitude(vector), name, *notation.direction_and_sense(vector), ".")
        return ("From ", chord.tail, " draw ", *drawn) if first else ("To it add ", *drawn)

    def _unknown_vector(self, vector: PolygonVector, first: bool) -> Phrase:
        tail, head = self.notation.polygon_letter(vector.tail), self.notation.polygon_letter(vector.head)
        return (
            "Through " if first else "Through the head ",
            tail,
            " draw ",
            *self.notation.line_to_draw(vector),
            "; ",
            head,
            " lies on it.",
        )

    def totals(self, terms: Sequence[Any]) -> list[Phrase]:
        """The totals of what was drawn in parts."""
        parted = [
            term for term in terms if len(term.vectors) > 1 and self.notation.letter_distance(term.tail, term.head)
        ]
        if not parted:
            return []
        chords = [(self.notation.chord(term.tail, term.head),) for term in parted]
        what = [(Name(term.of), " relative to ", Name(term.against)) for term in parted]
        total = "total acceleration" + "s" * (len(parted) > 1)
        return [("Join ", *list_phrases(chords), f": the {total} of ", *list_phrases(what), ".")]


def _unknown_vectors(side: MeetingSide) -> list[PolygonVector]:
    return [vector for vector in side.vectors if not vector.known]


def _with_other_end(sentence: Phrase, words: Phrase) -> Phrase:
    """A ruling sentence with another end: "...; c lies on it." becomes "...; the two lines meet in c."."""
    cut = max((index for index, piece in enumerate(sentence) if piece == "; "), default=None)
    return (*sentence[:cut], *words) if cut is not None else (*sentence, *words)


def image_step(notation: Notation, stage: PointImage) -> Phrase:
    """How a point of a link is found from two that are drawn."""
    if stage.sense == "same":
        return _point_moving_alike(notation, stage)
    p, q = stage.base
    spots = [_point_letter(notation, point) for point in (p, q, stage.point)]
    if stage.sense:
        names = Name("".join((p, q, stage.point))) if _has_short_names(stage) else Name("–".join((p, q, stage.point)))
        how = ", read in the same order (", stage.sense, ")."
        return (
            "Draw triangle ",
            *join_phrases(((spot,) for spot in spots), "" if _has_short_names(stage) else "–"),
            " similar to ",
            names,
            *how,
        )
    return _point_on_line(notation, stage)


def _has_short_names(stage: PointImage) -> bool:
    return max(map(len, (*stage.base, stage.point))) <= 2


def _point_letter(notation: Notation, point: str) -> PolygonLetter:
    (spot,) = notation.point_letter(point)
    return spot if isinstance(spot, PolygonLetter) else PolygonLetter(point)


def _point_on_line(notation: Notation, stage: PointImage) -> Phrase:
    """Locate e₁ on b₁c₁ such that b₁e₁/b₁c₁ = BE/BC = 40/66."""
    p, q = stage.base
    letters = [notation.letters[point] for point in (p, q, stage.point)]
    base, part = notation.chord(letters[0], letters[1]), notation.chord(letters[0], letters[2])
    beyond = p if stage.ratio < 0.0 else q if stage.ratio > 1.0 + 1e-9 else ""
    where: Phrase = (base,) if stage.ratio >= 0.0 else (notation.chord(letters[1], letters[0]),)
    if beyond:
        where = (*where, " produced beyond ", _point_letter(notation, beyond))
    whole = _distance(notation, p, q)
    length = parse_unit(notation.polygon.state.mechanism.units.length)
    sizes = tuple((format_ratio(length.from_si(each)),) for each in (whole * abs(stage.ratio), whole))
    lines = tuple((Name(_line_name(p, other)),) for other in (stage.point, q))
    equal = (Fraction((part,), (base,)), " = ", Fraction(*lines), " = ", Fraction(*sizes))
    return ("Locate ", part.head, " on ", *where, " such that ", *equal, ".")


def _line_name(p: str, q: str) -> str:
    return p + q if max(len(p), len(q)) <= 2 else f"{p}-{q}"


def _distance(notation: Notation, p: str, q: str) -> float:
    """The distance of two points of the space diagram (m), those that only lie under others included."""
    state = notation.polygon.state
    places = {each.name: each.members[0] for each in named_points(state.mechanism)}
    rated = rate_equations(state)
    spots = [
        np.array(rated.point_position(*places[point.rstrip("′*")])) for point in (p, q) if point.rstrip("′*") in places
    ]
    return float(np.hypot(*(spots[0] - spots[-1]))) if len(spots) == 2 else 0.0


def _point_moving_alike(notation: Notation, stage: PointImage) -> Phrase:
    what = "velocity" if notation.order == 1 else "acceleration"
    base, point = stage.base[0], stage.point
    why = "does not turn" if notation.order == 1 else "neither turns nor begins to turn"
    both = (*notation.point_letter(base), " and ", *notation.point_letter(point), " coincide.")
    return (f"Link {stage.link} {why}, so ", Name(point), f" has the same {what} as ", Name(base), ": ", *both)

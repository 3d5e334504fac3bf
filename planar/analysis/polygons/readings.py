"""What is read off a polygon: how fast links turn, how fast points move and things slide, with senses in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from planar.analysis.polygons.notation import NEGLIGIBLE_RATIO, Notation
from planar.analysis.polygons.polygon import Meeting, PolygonVector, SimultaneousSolution, TurningRate, VectorPart
from planar.analysis.rich_text import Fraction, MeasuredValue, Name, Phrase, Symbol
from planar.foundation.arrays import Array
from planar.model.mechanism import relative_motions
from planar.model.wording import AT_REST, NOT_TURNING, direction_sense

LINE_OF_MOTION = "line of motion"


@dataclass(frozen=True)
class Readings:
    """Sentences about what one polygon shows."""

    notation: Notation

    def turning_reading(self, turn: TurningRate) -> Phrase:
        """ω_BC = bc/BC = 0.340/0.066 = 5.15 rad/s, clockwise."""
        order = self.notation.order
        symbol = Symbol("ω" if order == 1 else "α", turn.link)
        still = turn.sense == NOT_TURNING
        value = MeasuredValue(0.0 if still else abs(turn.value), ("rad/s", "rad/s^2")[order - 1])
        sense = "" if still else f", {turn.sense}"
        if not turn.vector[0]:
            source = self._source(turn.by)
            if still:
                how = "does not turn" if order == 1 or not self._is_turning(turn.link) else "turns at a uniform rate"
                return (f"{source} {turn.by}: ", symbol, f" = 0: {turn.link} {how}")
            return (f"{source} {turn.by}: ", symbol, " = ", value, sense)
        chord: Phrase = (self.notation.chord(*turn.vector),)
        if still:
            how = (
                "neither gains nor loses speed here" if order == 2 and self._is_turning(turn.link) else "does not turn"
            )
            return (symbol, " = ", Fraction(chord, (Name(turn.line),)), f" = 0: {turn.link} {how}")
        told = self.notation.format_number
        numbers = Fraction((told(turn.magnitude, self.notation.polygon.kind),), (told(turn.length, "length"),))
        return (symbol, " = ", Fraction(chord, (Name(turn.line),)), " = ", numbers, " = ", value, sense)

    def _source(self, pair: str) -> str:
        """By what a link's turning is known: an input on the frame gives it, one between moving links helps to it."""
        state = self.notation.polygon.state
        if pair not in state.inputs:
            return "By the pair"
        return (
            "Given at the input"
            if state.mechanism.frame in relative_motions(state.mechanism)[pair].links
            else "With the input"
        )

    def _is_turning(self, link: str) -> bool:
        return self.notation.polygon.state.link(link).sense != NOT_TURNING

    def meeting_readings(self, meeting: Meeting) -> Iterator[Phrase]:
        """v_C = dc = 0.400 m/s, with the sense, of every point on the way; of sliders also whether they speed up."""
        vectors = [vector for side in meeting.sides for vector in side.vectors]
        points = self.notation.polygon.points
        passed = dict.fromkeys(points[vector.head] for vector in vectors if vector.head in points)
        for point in (*(each for each in passed if each != meeting.point), meeting.point):
            slid = any(
                v.part is VectorPart.SLIDING and v.of == point and v.line.startswith(LINE_OF_MOTION) for v in vectors
            )
            yield from self.point_readings(point, slid)

    def point_readings(self, point: str, slider: bool = False) -> Iterator[Phrase]:
        """The velocity or the acceleration of a point of the mechanism, from the pole."""
        notation = self.notation
        state = notation.polygon.state
        if point not in state.point_names or point not in notation.letters:
            return
        letter = notation.letters[point]
        if letter in notation.poles:
            return
        root = notation.pole_letter(letter)
        value = notation.polygon.letters[letter]
        size = notation.vector_length(value)
        symbol = Symbol("v" if notation.order == 1 else "a", point)
        chord = notation.chord(root, letter)
        told = (symbol, " = ", chord, " = ", notation.quantity(size))
        if not size:
            yield (*told, ": it is at rest" if notation.order == 1 else ": its velocity does not change")
            return
        yield (*told, f", {direction_sense(value)}", *(self._change_of_speed(point, value) if slider else ()))

    def _change_of_speed(self, point: str, value: Array) -> Phrase:
        """Whether a slider's acceleration is in the direction of its velocity."""
        if self.notation.order == 1:
            return ()
        velocity = self.notation.polygon.state.point(point).velocity
        sense = self.notation.polygon.state.point(point).sense
        if sense == AT_REST:
            moving = any(given.velocity for given in self.notation.polygon.state.inputs.values())
            return ("; at rest for an instant only: it turns back here" if moving else "; it starts from rest",)
        if float(velocity @ value) > 0.0:
            return ("; in the direction of ", Symbol("v", point), ": the slider speeds up")
        return ("; against ", Symbol("v", point), ": the slider slows down")

    def slide_readings(self, meeting: Meeting) -> Iterator[Phrase]:
        """How fast something slides along a line that moves."""
        for side in meeting.sides:
            for vector in side.vectors:
                if vector.part is VectorPart.SLIDING and vector.line.startswith("line on"):
                    yield self._slide_reading(vector)

    def _slide_reading(self, vector: PolygonVector) -> Phrase:
        chord = self.notation.chord(vector.tail, vector.head)
        size = self.notation.vector_length(vector.value)
        what = "sliding along the " if self.notation.order == 1 else "acceleration along the "
        words = (what, *self.notation.line(vector))
        symbol = self.notation.symbol(vector.of, vector.against, vector.part)
        sense = f", {direction_sense(vector.value)}" if size else ""
        return (symbol, " = ", chord, " = ", self.notation.quantity(size), f"{sense}: ", *words)

    def simultaneous_readings(self, stage: SimultaneousSolution) -> Iterator[Phrase]:
        """The rates and the points that simultaneous equations give."""
        order = self.notation.order
        scale = max((abs(each.value) for each in stage.unknowns if each.is_angular), default=0.0)
        for each in stage.unknowns:
            link = each.name.partition("_")[2]
            if each.is_angular and link in self.notation.polygon.state.links:
                value = each.value if abs(each.value) > NEGLIGIBLE_RATIO * scale else 0.0
                sense = "" if not value else ", anticlockwise" if value > 0.0 else ", clockwise"
                unit = ("rad/s", "rad/s^2")[order - 1]
                yield (Symbol("ω" if order == 1 else "α", link), " = ", MeasuredValue(abs(value), unit), sense)
        for letter in stage.letters:
            yield from self.point_readings(self.notation.polygon.points.get(letter, ""))

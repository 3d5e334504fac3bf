"""The mechanical advantage: what an ideal mechanism exerts for what an input supplies, by power and by centres."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centres import Centres, centres, extent
from planar.analysis.centres.velocities import LinkByCentres, links_by_centres
from planar.analysis.motion.load_direction import find_unit_load, loads_by_name
from planar.analysis.rate_equations import Rate, RateEquations, rate_equations
from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import KinematicArrays, action_powers, action_velocities, actions_of_load
from planar.dynamics.virtual_velocities import has_length_motion, unit_rate_state
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Unknown, suggest_name_of_kinds
from planar.model.loads import Load
from planar.model.mechanism import Input, relative_motions
from planar.model.wording import REST_TOLERANCE, join_all_names
from planar.results.motion import State

MAX_LINKS_BY_CENTRES = 60
"""Links whose centres are constructed for a second value; the time for that grows with their cube."""
LEAST_SEPARATION = 1e-3
"""Centres that lie closer together than this, homogeneous and of length one, tell the line through them badly."""
PoleOfLink = Callable[[str], Array]
"""Of a link by name: w times its pole (x, y, 1) against the frame, (3,), rad/s and m."""


class Advantage(NamedTuple):
    """Output force (or torque) for each unit of an input's torque (or force), without friction, inertia and weight.

    It is the input's rate by the output's. Of a point the force is the one along its path, in the sense in which it
    moves as the input moves in its positive sense; of a load it is the force in the load's direction, negative where
    what it acts on moves against it; of a link and a pair it has the sign of the output's motion in its positive
    sense. `along` says which: "path" of a point, "line" of two points, else the name of the load, empty of a link and a
    pair; `target` is what the output acts on, which of a load is not its name. `by_power` is from the rates that the
    constraints give, `by_centres` from the instantaneous centres. Both are None where the output does not move, the
    second also where centres do not determine it; `why` then says so.
    """

    output: str
    input: str
    by_power: float | None
    by_centres: float | None
    measure: str
    "its unit: `1/m` of a force for a torque, `m` of a torque for a force, `1` of like for like"
    through: tuple[str, ...]
    "the names of the centres that the second was read from"
    why: str
    target: str = ""
    along: str = ""


@takes_result("State")
def advantage(state: State, output: str, input: str | None = None) -> Advantage:  # noqa: A002
    """The mechanical advantage of a point, a link, a pair or a load (in this order, by name) over an input.

    A load is named as in `planar.dimensions`, `loads.0`; `P,Q` is a force between two points, along the line that
    joins them. With the input alone moving at unit rate; `input` may be left out where there is one. Raises Unknown
    where there is no such output or input, BadInput where an input has to be named, NoAnswer where none can move alone.

    >>> import planar
    >>> state = planar.solve(planar.load("slider-crank"))
    >>> planar.advantage(state, "stroke").measure
    '1/m'
    """
    return _AdvantagesOverInput(state, _choose_input(state, input)).advantage_of(output)


def advantages(state: State, outputs: Sequence[str] | None = None) -> dict[str, dict[str, Advantage]]:
    """The advantages of outputs over every input, by output and input; left out, of all that is loaded.

    Of a force at a point there are both: the point's, along its path, and the load's, in its direction. Raises as
    `advantage` does.
    """
    outputs = [*loaded_outputs(state)] if outputs is None else outputs
    ways = [_AdvantagesOverInput(state, given.pair) for given in state.mechanism.inputs] if outputs else []
    return {output: {each.input: each.advantage_of(output) for each in ways} for output in dict.fromkeys(outputs)}


def loaded_outputs(state: State) -> dict[str, int]:
    """What is loaded, by the names that `advantage` takes, with the index of the (first) load of each.

    Of a force at a point that is the point and the load. A load on a link or pair that has the name of a point, or of a
    link, goes by its own name alone.
    """
    outputs: dict[str, int] = {}
    for index, (own_name, load) in enumerate(loads_by_name(state.mechanism).items()):
        is_point = load.target in state._point_names
        is_ambiguous = load.point is None and (is_point or (load.pair is not None and load.target in state.frames))
        is_loaded = any(load.force) if load.force is not None else bool(load.torque or load.effort)
        names = [] if is_ambiguous else [load.target]
        if is_loaded and (is_ambiguous or load.force is not None):
            names.append(own_name)
        for name in names:
            outputs.setdefault(name, index)
    return outputs


class _OutputRate(NamedTuple):
    """An output's rate at unit rate of the input (m or rad), the links it is read from, and how from their motions.

    `rest` is the clause that says that it is zero; `target` and `along` as in `Advantage`.
    """

    value: float
    is_length: bool
    links: tuple[str, ...]
    from_motions: Callable[[PoleOfLink], float]
    rest: str
    target: str = ""
    along: str = ""


class _AdvantagesOverInput:
    """Those over one input."""

    def __init__(self, state: State, name: str):
        self.input = name
        self.state = unit_rate_state(state, name)
        self.is_sliding = has_length_motion(state.mechanism, name)
        self.middle, self.size = extent(state)
        points, links = self.state.points.values(), self.state.links.values()
        fastest = max((float(np.hypot(*each.velocity)) for each in points), default=0.0)
        turning = max((abs(each.angular_velocity) for each in links), default=0.0)
        self.greatest = max(fastest / self.size, turning)

    @cached_property
    def centres_and_poles(self) -> tuple[Centres, Mapping[str, LinkByCentres]]:
        """The centres, and the motion of every link by them. Raises NoAnswer."""
        everything = centres(self.state)
        return everything, links_by_centres(everything)

    def advantage_of(self, output: str) -> Advantage:
        """The advantage of an output."""
        rate = self._output_rate(output)
        measure = {(True, False): "1/m", (False, True): "m"}.get((rate.is_length, self.is_sliding), "1")
        result = Advantage(output, self.input, None, None, measure, (), "", rate.target or output, rate.along)
        if abs(rate.value) <= REST_TOLERANCE * self.greatest * (self.size if rate.is_length else 1.0):
            effort = "force" if rate.is_length else "torque"
            why = f"{rate.rest} here however {self.input} moves, so that no {effort} at it is too great"
            return result._replace(why=why)
        result = result._replace(by_power=1.0 / rate.value)
        count = len(self.state.frames)
        if count > MAX_LINKS_BY_CENTRES:
            centre_count = count * (count - 1) // 2
            return result._replace(
                why=f"not by centres: {count} links have {centre_count}; `planar centres` lists them"
            )
        try:
            by_centres, through = self._rate_by_centres(rate.links, rate.from_motions)
        except NoAnswer as problem:
            return result._replace(why=f"not by centres: {problem.reason}")
        if by_centres == 0.0:
            return result._replace(through=through, why=f"not by centres: by them {rate.rest} here")
        return result._replace(by_centres=1.0 / by_centres, through=through)

    def _load_rate(self, unit_load: Load, along: str) -> _OutputRate:
        """The power of a load of one (N, N m), at unit rate of the input."""
        field = KinematicArrays(self.state)
        actions = field.external_actions(actions_of_load(field, unit_load, 1.0))
        value = float(action_powers(field, actions, action_velocities(field, actions)).sum())

        def from_motions(motion: PoleOfLink) -> float:
            return float(
                sum(
                    action.force[0] @ _point_velocity(motion(action.link), action.at[0])
                    + float(np.ravel(action.couple)[0]) * motion(action.link)[2]
                    for action in actions
                )
            )

        is_length = any(action.force.any() for action in actions)
        links = tuple(dict.fromkeys(action.link for action in actions))
        rest = f"{unit_load.target} does not move along {along}"
        return _OutputRate(value, is_length, links, from_motions, rest, unit_load.target, along)

    def _output_rate(self, name: str) -> _OutputRate:
        """An output's rate by its name. Raises Unknown."""
        state, frame = self.state, self.state.mechanism.frame
        if name in state._point_names:
            place, velocity, *_ = state.point(name)
            speed = float(np.hypot(*velocity))
            carrying = [link for link, _ in state._find_point(name).members]
            link = frame if frame in carrying else carrying[0]

            def path_speed(motion: PoleOfLink) -> float:
                return float(np.hypot(*_point_velocity(motion(link), place)))

            return _OutputRate(speed, True, (link,), path_speed, f"{name} is at rest", along="path")
        if name in state.frames:
            turns = state.link(name).angular_velocity
            return _OutputRate(turns, False, (name,), lambda motion: float(motion(name)[2]), f"{name} does not turn")
        named = relative_motions(state.mechanism)
        if name in named:
            pair = named[name]
            watched = replace(state, mechanism=replace(state.mechanism, inputs=(Input(name, 0.0),)))
            found = rate_equations(watched)
            slopes = next(tie for tie in found.equations if tie.is_input).coefficients
            rate = sum(slope * found.value(each) for each, slope in slopes.items())
            links = tuple(dict.fromkeys((*pair.links, *(each.owner for each in slopes if each.is_angular))))
            is_length = has_length_motion(state.mechanism, name)
            rest = f"pair {name!r} does not move"
            return _OutputRate(rate, is_length, links, lambda motion: _pair_rate(found, slopes, motion), rest)
        return self._named_load_rate(name)

    def _named_load_rate(self, name: str) -> _OutputRate:
        """The rate of a load by its name, or of the distance between two points, `P,Q`. Raises Unknown."""
        state = self.state
        unit = find_unit_load(state.mechanism, name)
        if unit is not None:
            return self._load_rate(*unit)
        known = {
            "points": state.point_names,
            "links": state.frames,
            "pairs": relative_motions(state.mechanism),
            "loads": loads_by_name(state.mechanism),
        }
        raise Unknown(f"there is no point, link, pair or load {name!r}{suggest_name_of_kinds(name, known)}")

    def _rate_by_centres(
        self, links: tuple[str, ...], read: Callable[[PoleOfLink], float]
    ) -> tuple[float, tuple[str, ...]]:
        """An output's rate by centres, and the names of those that it was read from."""
        frame = self.state.mechanism.frame
        found = {link: self._pole_from_driven_link(link) for link in links if link != frame}
        through = dict.fromkeys(name for each in found.values() for name in each.by)
        at_rest = np.zeros(3)
        return read(lambda link: found[link].motion if link in found else at_rest), tuple(through)

    def _pole_from_driven_link(self, link: str) -> LinkByCentres:
        """A link's motion from that of the link which the input drives against the frame, at once where that tells.

        Of links i and o against the frame f, w_o / w_i = |I_if I_io| / |I_of I_io| with its sign; in homogeneous
        coordinates m_o x I_io = m_i x I_io with m_o along I_of, so that centres at infinity are no special case.
        Else from link to link, each time through the best conditioned three centres.
        """
        everything, by_centres = self.centres_and_poles
        frame = self.state.mechanism.frame
        ends = relative_motions(self.state.mechanism)[self.input].links
        driven = next((end for end in ends if frame in ends and end != frame), None)
        if driven is None or link == driven:
            return by_centres[link]
        own, between = (self._scale_point(everything[link, end].homogeneous) for end in (frame, driven))
        if own is None or between is None:
            return by_centres[link]
        line = np.cross(own, between)
        if float(np.linalg.norm(line)) <= LEAST_SEPARATION:
            return by_centres[link]
        x, y, w = by_centres[driven].motion
        known = np.cross([(x - w * self.middle[0]) / self.size, (y - w * self.middle[1]) / self.size, w], between)
        x, y, w = own * float(line @ known / (line @ line))
        motion = np.array([self.size * x + w * self.middle[0], self.size * y + w * self.middle[1], w])
        by = tuple(everything[two].name for two in ((driven, frame), (driven, link), (link, frame)))
        return LinkByCentres(motion, by)

    def _scale_point(self, at: Array | None) -> Array | None:
        """A homogeneous point (3,) in lengths of the mechanism's size about its middle, of length one."""
        if at is None:
            return None
        x, y, w = at
        at = np.array([(x - w * self.middle[0]) / self.size, (y - w * self.middle[1]) / self.size, w])
        found: Array = at / np.linalg.norm(at)
        return found


def _choose_input(state: State, name: str | None) -> str:
    """The input that is meant."""
    names = [given.pair for given in state.mechanism.inputs]
    if name is None and len(names) == 1:
        return names[0]
    if name is None:
        raise BadInput("input", f"an advantage is over one input; name it: the inputs are at {join_all_names(names)}")
    if name not in names:
        raise Unknown(f"there is no input at {name!r}; the inputs are at {join_all_names(names)}")
    return name


def _point_velocity(motion: Array, place: Array) -> Array:
    """The velocity (2,) (m/s) of a place (2,) (m) of a link."""
    x, y, turns = motion
    return np.array([y - turns * place[1], turns * place[0] - x])


def _pair_rate(found: RateEquations, slopes: Mapping[Rate, float], motion: PoleOfLink) -> float:
    """A pair's rate from the motions of its links: from how they turn, and from how the one slides on the other."""
    rate = sum(slope * float(motion(each.owner)[2]) for each, slope in slopes.items() if each.is_angular)
    own = {each: slope for each, slope in slopes.items() if not each.is_angular}
    for slide in found.slides:
        if own.keys().isdisjoint(slide.rates):
            continue
        place = found.point_position(slide.rider, slide.point)
        apart = _point_velocity(motion(slide.rider), place) - _point_velocity(motion(slide.guide), place)
        along = np.linalg.lstsq(np.stack(slide.directions, axis=1), apart, rcond=None)[0]
        rate += sum(own.get(each, 0.0) * float(part) for each, part in zip(slide.rates, along, strict=True))
    return rate

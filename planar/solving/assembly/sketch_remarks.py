"""Remarks on an assembly: how far it lies from the sketch, and how it was chosen."""

from __future__ import annotations

from math import hypot, pi, remainder, tau

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.foundation.units import parse_unit
from planar.model.link_shapes import fitted_frame
from planar.model.mechanism import named_points, sketched_places
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.prepared_mechanism import PreparedMechanism

FAR_FROM_SKETCH = 0.1
"""The part of the mechanism's size by which a point may be off its sketch without a remark."""
TURNED_FROM_SKETCH = pi / 4
"""The angle (rad) by which a link may be turned against its sketched points without a remark."""
MAX_NAMED_BLOCKS = 4
"""Blocks of links that are named one by one."""


def sketch_remarks(setup: PreparedMechanism, assembly: Assembly) -> tuple[str, ...]:
    """Sentences on an assembly that lies far from the sketch, and on blocks whose assembly the sketch leaves open: how
    they stand, and how to choose."""
    remarks = _sketch_distance_remarks(setup, assembly.z) if setup.mechanism.sketch else []
    open_blocks = [setup.equations.blocks[index] for index in assembly.ties]
    if open_blocks:
        lead = "the sketch leaves open" if setup.mechanism.sketch else "there is no sketch to say"
        positions = [_describe_block_position(setup, block, assembly.z) for block in open_blocks[:MAX_NAMED_BLOCKS]]
        more = (
            f", and so on for {count_phrase(len(open_blocks) - MAX_NAMED_BLOCKS, 'more group')}"
            if len(open_blocks) > MAX_NAMED_BLOCKS
            else ""
        )
        remarks.append(
            f"{lead} how some links go together; taken is {join_all_names(positions)}{more}: the sliding points ahead "
            f"of 'through', else the upper assembly; sketch these points elsewhere to choose another"
        )
    if assembly.is_cut_off:
        remarks.append(
            "the search for the assembly nearest to the sketch stopped before it had tried all combinations and took "
            "the nearest so far; sketch more points to choose the one that is meant"
        )
    if setup.is_deflated:
        links = links_held_to_second_order(setup)
        remarks.append(
            f"all along the motion the pairs hold link{'s' * (len(links) != 1)} {quote_names(links)} "
            f"to second order only; to first order more could move, so that a little play lets it move far"
        )
    return tuple(remarks)


def links_held_to_second_order(setup: PreparedMechanism) -> list[str]:
    """The links that constraints hold to second order only, and leave free to first order, all along the motion."""
    rows = setup.equations.rows
    touching = [
        stage for stage in setup.equations.blocks if any(row.kind is MeasureKind.PURE for row in rows[stage.rows])
    ]
    return list(dict.fromkeys(link for stage in touching for link in stage.links))


def _describe_block_position(setup: PreparedMechanism, block: Block, z: Array) -> str:
    """Where a point of a block is: C at [80, 50] mm; of a block without points, its links."""
    locations = setup.structure.point_locations
    placed = [place for place in locations.first_link.items() if place[1][0] == block.block_index]
    if not placed:
        return f"one assembly of {quote_names(block.links)}"
    names = [name for points in locations.points_of.values() for _, name in points]
    # of the points that could be named one that several links share says most
    name, (_, link, point) = max(placed, key=lambda place: names.count(place[0]))
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p) * setup.scale
    frames, _ = frames_from_coordinates(w, setup.column, [link], {})
    length = parse_unit(setup.mechanism.units.length)
    position = frames[link].to_world(setup.shapes[link].position(point))
    values = [f"{length.from_si(float(value)):.4g}" for value in position]
    return f"{name} at [{', '.join(values)}] {setup.mechanism.units.length}"


def _sketch_distance_remarks(setup: PreparedMechanism, z: Array) -> list[str]:
    """A sentence on an assembly that lies far from the sketch: the farthest point, and the link that is turned most."""
    mechanism, places = setup.mechanism, sketched_places(setup.mechanism)
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p) * setup.scale
    frames, _ = frames_from_coordinates(w, setup.column, setup.shapes, {})
    distances = {
        (link, point): hypot(*(frames[link].to_world(setup.shapes[link].position(point)) - place))
        for link, points in places.items()
        for point, place in points.items()
    }
    turns = {
        link: remainder(float(frames[link].angle) - sketched.angle, tau)
        for link, points in places.items()
        if link != mechanism.frame and (sketched := fitted_frame(setup.shapes[link], points)) is not None
    }
    corners = [frames[link].to_world(point) for link, shape in setup.shapes.items() for point in shape.points.values()]
    x, y = [float(point.x) for point in corners], [float(point.y) for point in corners]
    diagonal = hypot(max(x) - min(x), max(y) - min(y))
    clauses = []
    farthest = max(distances, key=lambda member: distances[member])
    if distances[farthest] > FAR_FROM_SKETCH * diagonal:
        name = next(point.name for point in named_points(mechanism) if farthest in point.members)
        distance = parse_unit(mechanism.units.length).from_si(float(distances[farthest]))
        clauses.append(f"{name} is {distance:.4g} {mechanism.units.length} from where it is sketched")
    link = max(turns, key=lambda name: abs(turns[name]), default="")
    if link and abs(turns[link]) > TURNED_FROM_SKETCH:
        clauses.append(f"link {link!r} is turned by {turns[link] * 180 / pi:.4g} deg against its sketched points")
    if not clauses:
        return []
    return [f"at the file's inputs {' and '.join(clauses)}, far from the sketch; check lengths, angles and sketch"]

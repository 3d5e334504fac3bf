"""Plates as solids in a STEP file (ISO 10303-21, AP214): each extruded by its thickness, stacked where it was drawn."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from planar.manufacture.plates import Hole, Place, Plate, Vertex

HEADER = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('plates of a linkage'),'2;1');
FILE_NAME({name},'',(''),(''),'planar','planar','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));
ENDSEC;
DATA;
"""
TOLERANCE = 1e-5
"""mm, within which edges meet."""


def encode_step(plates: Sequence[Plate], thickness: float, title: str) -> bytes:
    """The plates as one product of solids: a plane for each straight edge, a cylinder for each arc, in mm."""
    return _Writer(title).write(plates, thickness).encode("ascii", "replace")


class _Writer:
    """Entities by their numbers."""

    def __init__(self, title: str) -> None:
        self.title = _text(title)
        self.lines: list[str] = []

    def add(self, entity: str) -> int:
        self.lines.append(f"#{len(self.lines) + 1}={entity};")
        return len(self.lines)

    def write(self, plates: Sequence[Plate], thickness: float) -> str:
        solids = [self.solid(plate, plate.layer * thickness, thickness) for plate in plates]
        context = self.context()
        axes = self.placement((0.0, 0.0, 0.0))
        items = ",".join(f"#{each}" for each in (axes, *solids))
        shape = self.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION({self.title},({items}),#{context})")
        self.product(shape)
        return HEADER.format(name=self.title) + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"

    def context(self) -> int:
        """Millimetres, radians, and within what places are one."""
        length = self.add("(LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.))")
        angle = self.add("(NAMED_UNIT(*) PLANE_ANGLE_UNIT() SI_UNIT($,.RADIAN.))")
        solid = self.add("(NAMED_UNIT(*) SI_UNIT($,.STERADIAN.) SOLID_ANGLE_UNIT())")
        close = self.add(
            f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({TOLERANCE:.1E}),#{length},'distance_accuracy_value','')"
        )
        return self.add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3) "
            f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{close})) "
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid})) REPRESENTATION_CONTEXT('',''))"
        )

    def product(self, shape: int) -> None:
        application = self.add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")
        self.add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})")
        context = self.add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
        product = self.add(f"PRODUCT({self.title},{self.title},'',(#{context}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
        stage = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('design','',#{formation},#{stage})")
        whole = self.add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION(#{whole},#{shape})")

    def point(self, at: tuple[float, float, float]) -> int:
        return self.add(f"CARTESIAN_POINT('',({','.join(map(_real, at))}))")

    def direction(self, way: tuple[float, float, float]) -> int:
        return self.add(f"DIRECTION('',({','.join(map(_real, way))}))")

    def placement(
        self,
        at: tuple[float, float, float],
        axis: tuple[float, float, float] = (0.0, 0.0, 1.0),
        along: tuple[float, float, float] = (1.0, 0.0, 0.0),
    ) -> int:
        parts = self.point(at), self.direction(axis), self.direction(along)
        return self.add(f"AXIS2_PLACEMENT_3D('',{','.join(f'#{each}' for each in parts)})")

    def solid(self, plate: Plate, low: float, thickness: float) -> int:
        """The faces below and above with all their loops, and a face on each edge of these."""
        high = low + thickness
        loops = [(plate.outline, True)]
        loops += [(loop, False) for loop in plate.loops[1:]]
        loops += [(_circle(hole), False) for hole in plate.drilled]
        loops = [(_without_points(loop), outer) for loop, outer in loops]
        faces: list[int] = []
        below, above = [], []
        for loop, outer in loops:
            around = loop if outer else _reversed(loop)  # the material to the left
            bottom, top, sides = self.walls(around, low, high)
            faces += sides
            below.append((self.add(f"EDGE_LOOP('',({','.join(bottom)}))"), outer))
            above.append((self.add(f"EDGE_LOOP('',({','.join(top)}))"), outer))
        for bounds, z, up in ((below, low, -1.0), (above, high, 1.0)):
            told = [
                self.add(f"{'FACE_OUTER_BOUND' if outer else 'FACE_BOUND'}('',#{loop},.T.)") for loop, outer in bounds
            ]
            plane = self.add(f"PLANE('',#{self.placement((0.0, 0.0, z), (0.0, 0.0, up))})")
            faces.append(self.add(f"ADVANCED_FACE('',({','.join(f'#{each}' for each in told)}),#{plane},.T.)"))
        shell = self.add(f"CLOSED_SHELL('',({','.join(f'#{each}' for each in faces)}))")
        return self.add(f"MANIFOLD_SOLID_BREP({_text(plate.name)},#{shell})")

    def walls(self, loop: Sequence[Vertex], low: float, high: float) -> tuple[list[str], list[str], list[int]]:
        """The oriented edges of a loop seen from below and above, and the faces between."""
        feet = [self.add(f"VERTEX_POINT('',#{self.point((x, y, low))})") for x, y, _ in loop]
        heads = [self.add(f"VERTEX_POINT('',#{self.point((x, y, high))})") for x, y, _ in loop]
        uprights = [
            self.line((x, y, low), (0.0, 0.0, 1.0), foot, head)
            for (x, y, _), foot, head in zip(loop, feet, heads, strict=True)
        ]
        bottom: list[str] = []
        top: list[str] = []
        faces: list[int] = []
        for number, (x, y, bulge) in enumerate(loop):
            after = (number + 1) % len(loop)
            u, v, _ = loop[after]
            if bulge:
                centre, radius = _arc(x, y, u, v, bulge)
                edges = [
                    self.arc(centre, radius, z, bulge > 0.0, ends[number], ends[after])
                    for z, ends in ((low, feet), (high, heads))
                ]
                axis = self.placement((*centre, low))
                surface, same = self.add(f"CYLINDRICAL_SURFACE('',#{axis},{_real(radius)})"), bulge > 0.0
            else:
                size = hypot(u - x, v - y)
                way = ((u - x) / size, (v - y) / size, 0.0)
                edges = [
                    self.line((x, y, z), way, ends[number], ends[after]) for z, ends in ((low, feet), (high, heads))
                ]
                plane = self.placement((x, y, low), (way[1], -way[0], 0.0), way)
                surface, same = self.add(f"PLANE('',#{plane})"), True
            round_it = [
                self.oriented(edges[0], True),
                self.oriented(uprights[after], True),
                self.oriented(edges[1], False),
                self.oriented(uprights[number], False),
            ]
            around = self.add(f"EDGE_LOOP('',({','.join(round_it)}))")
            bound = self.add(f"FACE_OUTER_BOUND('',#{around},.T.)")
            faces.append(self.add(f"ADVANCED_FACE('',(#{bound}),#{surface},{'.T.' if same else '.F.'})"))
            top.append(self.oriented(edges[1], True))
            bottom.insert(0, self.oriented(edges[0], False))
        return bottom, top, faces

    def oriented(self, edge: int, forwards: bool) -> str:
        number = self.add(f"ORIENTED_EDGE('',*,*,#{edge},{'.T.' if forwards else '.F.'})")
        return f"#{number}"

    def line(self, at: tuple[float, float, float], way: tuple[float, float, float], start: int, end: int) -> int:
        vector = self.add(f"VECTOR('',#{self.direction(way)},1.)")
        line = self.add(f"LINE('',#{self.point(at)},#{vector})")
        return self.add(f"EDGE_CURVE('',#{start},#{end},#{line},.T.)")

    def arc(self, centre: Place, radius: float, z: float, anticlockwise: bool, start: int, end: int) -> int:
        circle = self.add(f"CIRCLE('',#{self.placement((*centre, z))},{_real(radius)})")
        return self.add(f"EDGE_CURVE('',#{start},#{end},#{circle},{'.T.' if anticlockwise else '.F.'})")


def _circle(hole: Hole) -> tuple[Vertex, ...]:
    (x, y), radius = hole.at, hole.diameter / 2.0
    return (x - radius, y, 1.0), (x + radius, y, 1.0)


def _without_points(loop: Sequence[Vertex]) -> tuple[Vertex, ...]:
    """The loop without ways that have no length."""
    ways = zip(loop, [*loop[1:], loop[0]], strict=True)
    return tuple(one for one, other in ways if hypot(one[0] - other[0], one[1] - other[1]) > TOLERANCE)


def _reversed(loop: Sequence[Vertex]) -> list[Vertex]:
    """The loop the other way round: a bulge belongs to the way that begins at its vertex."""
    places = [(x, y) for x, y, _ in reversed(loop)]
    bulges = [-bulge for _, _, bulge in reversed(loop)]
    return [(*at, bulge) for at, bulge in zip(places, [*bulges[1:], bulges[0]], strict=True)]


def _arc(x: float, y: float, u: float, v: float, bulge: float) -> tuple[Place, float]:
    """The centre and radius of an arc by its ends and bulge."""
    half = 0.5 * (1.0 / bulge - bulge) / 2.0  # chord lengths from its middle to the centre, to the left
    centre = ((x + u) / 2.0 - half * (v - y), (y + v) / 2.0 + half * (u - x))
    return centre, hypot(x - centre[0], y - centre[1])


def _real(value: float) -> str:
    """A number as STEP has it: with a point, without -0."""
    text = f"{value + 0.0:.12G}"
    mantissa, exponent, power = text.partition("E")
    return (mantissa if "." in mantissa else f"{mantissa}.") + exponent + power


def _text(text: str) -> str:
    """A text in quotes, without what a reader would take for more."""
    plain = "".join(each if each.isascii() and each.isprintable() and each != "\\" else "_" for each in text)
    return "'" + plain.replace("'", "''") + "'"

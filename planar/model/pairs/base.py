"""What a pair type says of itself: its data, its residual, its drive, how it is written, a sample of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar, NamedTuple, Self

from planar.foundation.argument_types import check_field_types
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw
from planar.model.pairs.symbols import DrawingMark

LengthFormatter = Callable[[float], str]
"""Says an SI number in the units of a file."""


class MeasureKind(Enum):
    """What a number or an equation measures, and so how it scales and closes."""

    LENGTH = "length"
    ANGLE = "angle"
    """An angle that closes modulo a whole turn."""
    TURNS = "turns"
    """An angle in which whole turns count."""
    PURE = "pure"


@dataclass(frozen=True)
class Pair(ABC):
    """Two links joined so that some relative motions are prevented.

    A pair type is one file of this folder. Its `residual` is written with + - * alone, so the same lines
    serve floats, arrays, symbols and jets; Jacobian, velocity, acceleration and reactions are derived from it.
    Its formulas take a frame, or a shape, for each of its `bodies`.
    """

    name: str
    links: tuple[str, str]
    """The two links that it joins."""
    friction: Friction | None = field(default=None, kw_only=True)
    """Coulomb's friction, of types that can have it."""

    keyword: ClassVar[str]
    """The key that marks the type in a mechanism file."""
    entry_description: ClassVar[str]
    """What the value of its keyword is, for who writes a file."""
    entry_schemas: ClassVar[Mapping[str, Schema]]
    """The other keys of its entry, each with what JSON Schema says of its value."""
    required_keys: ClassVar[tuple[str, ...]] = ()
    """Those of the keys that cannot be left out."""
    entry_rule: ClassVar[Schema] = {}
    """What JSON Schema says of the keys together."""
    is_lower_pair: ClassVar[bool]
    """Whether the links touch along a surface; higher pairs touch at a point or along a line."""
    acts_at_distance: ClassVar[bool] = False
    """Whether something runs between the two links, which do not touch themselves."""
    open_contact_hint: ClassVar[str] = ""
    """What to know of a contact that is open, see `contact_gap`."""
    counts_turns: ClassVar[bool] = False
    """Whether the angles of its bodies count whole turns."""
    residual_kinds: ClassVar[tuple[MeasureKind, ...]]
    """What each entry of the residual measures."""
    coordinate_kinds: ClassVar[tuple[tuple[str, MeasureKind], ...]] = ()
    """Coordinates of its own that the residual needs beside the two frames."""
    number_kinds: ClassVar[tuple[MeasureKind, ...]]
    """What each number that `measure` takes from the two shapes is."""
    result_kinds: ClassVar[Mapping[str, str]]
    """The names of its results, in order, and the kind of quantity that each is."""
    input_kind: ClassVar[MeasureKind]
    """Whether its input is an angle or a length."""
    has_profile: ClassVar[bool] = False
    """Whether a profile follows from it, which is drawn under its keyword."""
    ties_angles: ClassVar[bool] = False
    """Whether it ties angles alone: what holds it are couples, whatever forces they come from (see `tooth_contact`)."""

    def __post_init__(self) -> None:
        check_field_types(self)

    @property
    def bodies(self) -> tuple[str, ...]:
        """The links whose frames its formulas need: the two that it joins, and those that they are seen from."""
        return self.links

    @property
    def has_friction(self) -> bool:
        """Whether it loses power as it moves."""
        return self.friction is not None

    @abstractmethod
    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        """The numbers of the bodies that the residual needs (m, rad)."""

    @abstractmethod
    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        """Zero where the pair is closed, an entry per constraint."""

    @abstractmethod
    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The relative motion that an input here prescribes (rad or m)."""

    def input_position_at(
        self, shapes: Mapping[str, LinkShape], frames: Mapping[str, Frame], own: Mapping[str, Sequence[Scalar]]
    ) -> Scalar:
        """The same where links of these shapes have these frames, own coordinates given by the names of pairs."""
        numbers = self.measure([shapes[link] for link in self.bodies])
        return self.input_position([frames[link] for link in self.bodies], numbers, own.get(self.name, ()))

    @abstractmethod
    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        """Its results by name, from its drive and the drive's derivatives (SI), numbers or arrays."""

    def coincident_points(self) -> tuple[tuple[str, str], ...]:
        """The (link, point) that lie on one another in this pair, so that they bear its name."""
        return ()

    def point_on_line(self) -> tuple[tuple[str, str], str] | None:
        """((link, point), link): a point of one link that moves along a line of another, if it does."""
        return None

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        """How an effort of its drive acts."""
        return EffortAction(self.links[1], self.links[0])

    def tooth_contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]
    ) -> ToothContact | None:
        """Where its teeth touch, beside all pairs of its mechanism; None without teeth, or where that is not known."""
        return None

    def wheel_centres(self, all_pairs: Sequence[Pair]) -> Mapping[str, str | None]:
        """Its wheels by their links, each with the point of the link at its centre; None where that is not known."""
        return {}

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """How friction acts in it, in motion or with the coefficients at rest; nothing where it has none."""
        return ()

    def pin_diameter(self) -> Scalar | None:
        """The diameter (m) of its pin, where it has one and that is known."""
        return None

    def has_pin(self) -> bool:
        """Whether it is a pin in a hole, which may have clearance."""
        return False

    def offset_pin(self, numbers: Sequence[Scalar], offset: Vector) -> Sequence[Scalar]:
        """Its numbers with its pin aside on the first link by an offset (m, in that link's axes)."""
        raise NotImplementedError

    def friction_circle_radius(self) -> Scalar | None:
        """The radius (m) of the circle to which its force is tangent in motion; None where there is no such circle."""
        return None

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        """How it is drawn, beside all pairs of its mechanism; nothing where its sizes cannot be known."""
        return ()

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        """What else defines it, in words for a reader; empty where its links and points say all."""
        return ""

    def is_intended_assembly(self, drive: float) -> bool:
        """Whether this is the assembly that an author means who says nothing (a slide ahead of `through`)."""
        return True

    @classmethod
    def prevented_motion_count(cls) -> int:
        """How many of the three relative motions of two links it prevents."""
        return len(cls.residual_kinds) - len(cls.coordinate_kinds)

    @classmethod
    def input_quantity_kinds(cls) -> tuple[str, str, str]:
        """The kinds of quantity of an input's position, velocity and acceleration."""
        if cls.input_kind is MeasureKind.LENGTH:
            return "length", "velocity", "acceleration"
        return "angle", "angular velocity", "angular acceleration"

    def find_misfit(
        self, all_pairs: Sequence[Pair], shapes: Mapping[str, LinkShape], format_length: LengthFormatter
    ) -> str | None:
        """What is wrong with it beside all pairs of its mechanism, as a sentence."""
        return None

    def remarks(self, shapes: Mapping[str, LinkShape]) -> Iterable[str]:
        """What is to be said of it to who reads its mechanism's results."""
        return ()

    def completed_by_sketch(
        self,
        entry: EntryReader,
        shapes: Mapping[str, LinkShape],
        sketched_frames: Mapping[str, Frame],
        places: Mapping[str, Vector],
    ) -> tuple[Self, str] | None:
        """The pair with what its entry leaves out as the sketch decides it, and a sentence; None where nothing is.

        `sketched_frames`: where the links stand whose place the sketch gives; `places` (m): where it has the points of
        the second link.
        """
        return None

    def piece_ends(self, shapes: Mapping[str, LinkShape]) -> PieceEnds | None:
        """The angles at which its law goes over from one piece to the next, where it has pieces."""
        return None

    @property
    def measures_symbols(self) -> bool:
        """Whether `measure` takes symbols too, and not numbers and arrays alone."""
        return True

    def contact_gap(self, numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The gap (m) at a contact that other pairs have to keep closed."""
        return 0.0

    @classmethod
    def expand_short_form(cls, entry: EntryReader) -> ExpandedEntry | None:
        """A short form of the entry in full; None where it is no short form."""
        return None

    @classmethod
    def joining_entry(cls, point: str) -> dict[str, Any] | None:
        """The entry by which this type joins all links that carry a point of this name; None for one that does not."""
        return None

    @classmethod
    @abstractmethod
    def read(cls, entry: EntryReader) -> tuple[Self, ...]:
        """The pairs that one entry of a file describes."""

    @classmethod
    @abstractmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        """The entry that describes the pairs which one entry was read into."""

    def entry_name(self) -> str:
        """The name of the file's entry that this pair comes from."""
        return self.name

    @classmethod
    def relative_motions(cls, group: Sequence[Self]) -> tuple[Self, ...]:
        """Every relative motion of an entry's links that has a name, as pairs."""
        return tuple(group)

    @classmethod
    @abstractmethod
    def samples(cls) -> tuple[PairSample, ...]:
        """Small closed configurations, in general position, on which every law is tried."""


class PieceEnds(NamedTuple):
    """Angles of a link against another (rad, over one turn) at which the law of a pair may bend or jump."""

    link: str
    carrier: str
    angles: tuple[float, ...]


class EffortAction(NamedTuple):
    """How what drives a pair acts: on one link, and the opposite on another, in the positive sense of the drive.

    A couple, or a force at a place along a way (of length one), in the world's axes.
    """

    link: str
    reaction_link: str
    point: Vector | None = None
    direction: Vector | None = None


class ToothContact(NamedTuple):
    """Where teeth of two links press on one another, in the world's axes.

    They touch at the pitch point `at`; of the force on the second link the part along `way` drives, and `slope` times
    that part, whatever its sense, pushes it off along `apart` (both of length one): the slope is the tangent of the
    pressure angle.
    """

    pitch_point: Vector
    drive_direction: Vector
    separation_direction: Vector
    pressure_tangent: float


class RubbingContact(NamedTuple):
    """How friction acts at a pair, in the world's axes.

    It is against `action` (a force of one along a way, or a couple of one) where `rate_sense` times the rate of the
    pair's input position is positive, for it where that is negative, and as great as `law` says of the `loads`.
    """

    action: EffortAction
    loads: tuple[ContactLoad, ...]
    law: LoadLaw
    rate_sense: Scalar = 1.0


class ExpandedEntry(NamedTuple):
    """A short entry in full, the links that it brings, and the entry of the pair that is to join these.

    Where the file has an entry of that type and name already, the links are added to it instead.
    """

    entry: dict[str, Any]
    links: dict[str, Any]
    joining_entry: dict[str, Any]


class PairSample(NamedTuple):
    """A pair closed between its bodies, which are called a, b, c, with everything that its formulas need."""

    pair: Pair
    shapes: tuple[LinkShape, ...]
    frames: tuple[Frame, ...]
    own: tuple[float, ...]
    entry: dict[str, Any]
    """The pair as a file has it."""
    other_entries: tuple[dict[str, Any], ...] = ()
    """Entries of other pairs without which it would be refused."""


def sample_shape(**points: Vector) -> LinkShape:
    """A link of a sample, with these points in its own axes."""
    return LinkShape(points, Vector(0.0, 0.0), Vector(1.0, 0.0))


Schema = dict[str, Any]
"""What JSON Schema says of a value."""


def schema_reference(name: str) -> Schema:
    """The schema of a kind of value that several entries have, such as "length" or "point"."""
    return {"$ref": f"#/$defs/{name}"}


def described(schema: Schema, text: str) -> Schema:
    """A key's schema with what the key means, which editors show while one types."""
    return {**schema, "description": text}


def list_schema(item: str, least: int, most: int | None = None) -> Schema:
    """The schema of a list of so many values of one kind."""
    return {"type": "array", "items": schema_reference(item), "minItems": least} | ({"maxItems": most} if most else {})

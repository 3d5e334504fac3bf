"""A mechanism built in Python: links and pairs as objects, pins by their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from planar.document.reader import read_mechanism
from planar.document.writer import write_mechanism
from planar.foundation.errors import BadInput
from planar.model.file_units import FileUnits
from planar.model.link_shapes import Link
from planar.model.loads import Load, Mass, Spring
from planar.model.mechanism import Input, Mechanism, check_mechanism
from planar.model.pairs import Pair, joining_entry
from planar.model.stops import Stops


def build(  # many: one for each list of a file
    links: Sequence[Link],
    pairs: Sequence[Pair | str],
    inputs: Sequence[Input] = (),
    sketch: Mapping[str, tuple[float, float]] | None = None,
    *,
    frame: str | None = None,
    name: str = "mechanism",
    loads: Sequence[Load] = (),
    springs: Sequence[Spring] = (),
    masses: Sequence[Mass] = (),
    gravity: tuple[float, float] = (0.0, 0.0),
    stops: Sequence[Stops] = (),
    units: FileUnits | None = None,
) -> Mechanism:
    """A mechanism of these links and pairs (SI), checked as a file is.

    A text in place of a pair is the turning pair of all links that carry a point of that name. The `frame` is the
    first link, if left out; `units` are those in which positions are printed. Raises BadInput.

    >>> import planar
    >>> from planar import Input, Link
    >>> frame = Link.from_points("AD", {"A": (0, 0), "D": (0.1, 0)})
    >>> bars = [Link.from_ends("A", "B", 0.05), Link.from_ends("B", "C", 0.066), Link.from_ends("D", "C", 0.056)]
    >>> planar.build([frame, *bars], ["A", "B", "C", "D"], [Input("A", 1.047)], {"C": (0.08, 0.05)}, name="Four-bar")
    <Mechanism 'Four-bar': 4 links, 4 pairs, driven at A>
    """
    for each in pairs:
        if not isinstance(each, Pair | str):
            raise BadInput("pairs", f"a pair, or the name of a pin, is wanted, not {each!r:.60}")
    for link in links:
        if not isinstance(link, Link):
            raise BadInput("links", f"links are wanted, not {link!r:.60}")
    if not links:
        raise BadInput("links", "a mechanism has links, the frame among them")
    bare = Mechanism(
        name=name,
        frame=links[0].name if frame is None else frame,
        links=tuple(links),
        pairs=tuple(each for each in pairs if isinstance(each, Pair)),
        units=units or FileUnits(),
    )
    value = write_mechanism(bare)
    written = dict(zip(dict.fromkeys(each.entry_name() for each in bare.pairs), value["pairs"], strict=True))
    entries = dict.fromkeys(each if isinstance(each, str) else each.entry_name() for each in pairs)
    value["pairs"] = [written.get(each) or joining_entry(each) for each in entries]
    joined = read_mechanism(value)
    whole = Mechanism(
        **{key: getattr(joined, key) for key in ("name", "frame", "links", "pairs", "units")},
        inputs=tuple(inputs),
        loads=tuple(loads),
        springs=tuple(springs),
        masses=tuple(masses),
        gravity=gravity,
        stops=tuple(stops),
        sketch=tuple((point, x, y) for point, (x, y) in (sketch or {}).items()),
    )
    check_mechanism(whole)
    return read_mechanism(write_mechanism(whole))

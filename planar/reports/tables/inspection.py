"""What `inspect` and `models` say, as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.identity.inspection import Inspection
from planar.model.wording import count_phrase, join_all_names
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import paragraphs
from planar.reports.tables.design.structures import joint_text
from planar.structures.multiple_pins import extra_links, joint_kinds_phrase


def inspection_tables(found: Inspection) -> RenderableType:
    """Names, links, pairs, chain and mobility, in the order in which a textbook takes them up."""
    links = plain_table("Links", "no.", "link", "order", "motion", left=(1, 2, 3), keys=2)
    for name, link in found.links.items():
        links.add_row(link.number, name, link.order, link.motion)
    said = [
        ("name", "; ".join(found.names) or "none that the field has for it"),
        ("kinematic chain", "closed" if found.closed else "open: some links have one pair only"),
        *_structure_facts(found),
        ("mechanism", f"{'yes' if found.is_mechanism else 'no'}: {found.mechanism_reason}"),
        ("linkage", f"{'yes' if found.is_linkage else 'no'}: {found.linkage_reason}"),
        ("links", link_orders_text(found)),
        ("pairs", f"{count_phrase(found.lower, 'lower pair')}, {count_phrase(found.higher, 'higher pair')}"),
        *((" ", f"{len(pairs)} {kind}: {', '.join(pairs)}") for kind, pairs in found.pairs),
        *_mobility_facts(found),
        *([("units", ", ".join(f"{kind} {unit}" for kind, unit in found.units.items()))] if found.units else []),
    ]
    return Group(
        Text(found.name, style="bold"),
        Text(),
        paragraphs(said),
        Text(),
        links,
        *_actions_tables(found),
        _numbers_table(found),
    )


def _numbers_table(found: Inspection) -> RenderableType:
    """All numbers of the file by the names that `--set` takes."""
    table = plain_table("Numbers (NAME=VALUE after --set changes one)", "name", "value", left=(0,), keys=1)
    for name, number in found.dimensions.items():
        table.add_row(name, number.shown)
    return table


def _actions_tables(found: Inspection) -> Iterator[RenderableType]:
    """Loads, springs and masses, where there are any."""
    if found.actions:
        acting = plain_table("Loads, springs and masses", "what", "at", "on", "how much", left=(0, 1, 2, 3))
        for each in found.actions:
            acting.add_row(each.kind, each.at, join_all_names(each.links) if each.links else "", each.amount)
        yield acting
    if found.remarks:
        yield paragraphs(("-", remark) for remark in found.remarks)


def _structure_facts(found: Inspection) -> list[tuple[str, str]]:
    """Which chain it is of all there are, which link of it is fixed and which joint driven."""
    known = found.structure
    if known is None:
        return [("structure", found.structure_reason)]
    chain = known.chain
    number = "" if chain.number is None else f" {chain.number}"
    named = f" ({chain.name})" if chain.name else ""
    sliding = f", {count_phrase(len(chain.slides), 'slide')}" if chain.slides else ""
    of = f"{count_phrase(chain.links, 'link')}{sliding} and freedom {chain.freedom}"
    driven = join_all_names([joint_text(chain, joint) for joint in known.drives]) if known.drives else "none"
    which = "" if known.number is None else f": mechanism {known.number} of the chain"
    facts = [
        f"kinematic chain{number} of those of {of}{named}, {count_phrase(chain.loops, 'loop')}",
        f"its link {known.frame} is fixed, its joint {driven} driven{which}",
    ]
    if known.slides:
        slides = join_all_names([joint_text(chain, joint) for joint in known.slides])
        facts.append(f"its joint {slides} slides" if len(known.slides) == 1 else f"its joints {slides} slide")
    if known.groups:
        groups = [f"{', '.join(links)}{f' ({kind})' if kind else ''}" for links, kind in known.groups]
        facts.append(f"Assur groups: {'; '.join(groups)}")
    if known.inversions:
        inversions = [f"{link} ({name})" if name else link for link, name in known.inversions.items()]
        facts.append(f"others of the same chain: by fixing {', '.join(inversions)}")
    if known.multiple_pins:
        others = [str(each.number) for each in known.others if each.number is not None]
        kind = "chains " if len(others) > 1 else "chain "
        more = f"; other choices give {kind}{join_all_names(others)}" if others else ""
        pins = join_all_names(known.multiple_pins)
        facts.append(f"at {pins} one link is taken as pinned to each other one{more}")
    pinned = known.pinned_chain
    if pinned is not None and pinned.number is not None:
        kinds = joint_kinds_phrase(len(pinned.slides), extra_links(pinned.pins))
        facts.append(f"taken as it is: chain {pinned.number} of those of {count_phrase(pinned.links, 'link')}{kinds}")
    return [("structure" if not k else " ", fact) for k, fact in enumerate(facts)]


def _mobility_facts(found: Inspection) -> list[tuple[str, str]]:
    count = f"{found.gruebler} by count (Gruebler, Kutzbach)"
    mobility = found.mobility
    if mobility is None:
        return [("mobility", count), (" ", found.open_reason)]
    whole = f"{mobility.finite}: {count}, {mobility.instantaneous} in this position, {mobility.finite} in motion"
    return [("mobility", whole), *((" ", sentence) for sentence in mobility.why)]


def link_orders_text(found: Inspection) -> str:
    """How many links there are of each order."""
    counts: dict[str, int] = {}
    for link in found.links.values():
        counts[link.order] = counts.get(link.order, 0) + 1
    return join_all_names([f"{count} {order}" for order, count in counts.items()])


def models_table(rows: Iterable[tuple[str, str, str]]) -> RenderableType:
    """The models that come along: name, other ids, what each is."""
    table = plain_table(None, "model", "also", "what it is", left=(0, 1, 2))
    for row in rows:
        table.add_row(*row)
    return table

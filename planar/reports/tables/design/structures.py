"""Kinematic chains as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.model.wording import count_phrase, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import paragraphs
from planar.structures.chain import Chain, ChainMechanism
from planar.structures.enumeration.pin_chains import Chains
from planar.structures.multiple_pins import joint_kinds_phrase


def table(found: Chains, shown: Sequence[Chain], with_mechanisms: bool, count: int | None) -> RenderableType:
    """The first chains, how many there are (`count`, None where time was over before), and on request the mechanisms
    that they make."""
    parted = sum(each.is_fractionated for each in shown)
    whole = len(shown) == count
    if found.freedom == 1 or not whole:
        beside = ""
    elif found.fractionated:
        beside = f", {parted} of them fractionated"
    else:
        beside = ", fractionated ones left out"
    kinds = f"{found.links} links{joint_kinds_phrase(found.slides, found.multiple_pins)}"
    many = count_phrase(len(shown) if count is None else count, "kinematic chain")
    if count is None:
        many = f"at least {many}"
    head = Text(f"{many} of {kinds}, freedom {found.freedom}{beside}", style="bold")
    if not shown and count is None:
        return Group(head)
    if not shown:
        return Group(head, Text(), paragraphs([(" -", "with such joints some joint of each would not move")]))
    more = [name for name, is_there in (("pins", found.multiple_pins), ("slides", found.slides)) if is_there]
    heads = ["no.", "assortment", *more, "symmetry", "inversions", "Assur classes", "planar", "name"]
    left = (*range(1, 2 + len(more)), *range(4 + len(more), 7 + len(more)))
    rows = plain_table(None, *heads, left=left, keys=1)
    for each in shown:
        rows.add_row(
            str(each.number),
            assortment_text(each.assortment),
            *([", ".join("-".join(map(str, pin)) for pin in each.multiple_pins)] if found.multiple_pins else []),
            *([", ".join(joint_text(each, joint) for joint in each.slides)] if found.slides else []),
            str(each.symmetry.order),
            str(len(each.inversions)),
            each.describe_classes(),
            "yes" if each.is_planar else "no",
            each.name or ("fractionated" if each.is_fractionated else ""),
        )
    told = [
        "assortment: links with two joints, with three, and so on",
        *(["pins: those of several links, each by these"] if found.multiple_pins else []),
        *(["slides: the joints that slide, each by its two links"] if found.slides else []),
        "symmetry: in how many ways links can be exchanged",
        "Assur classes: how many mechanisms have groups of which class at most; larger: of more than four links",
    ]
    if not whole:
        told.append(f"the first {len(shown)} are listed; --limit lists more, --json all")
    parts: list[RenderableType] = [head, Text(), rows, Text(), paragraphs((" -", sentence) for sentence in told)]
    if with_mechanisms:
        parts += [Text(), _mechanisms_table(shown)]
    return Group(*parts)


def _mechanisms_table(shown: Iterable[Chain]) -> FittedTable:
    """Every choice of a frame and drives, with its groups."""
    rows = plain_table("Mechanisms", "no.", "frame", "driven joints", "groups", "name", left=(2, 3, 4), keys=1)
    for chain in shown:
        for each in chain.mechanisms():
            driven = join_all_names([joint_text(chain, joint) for joint in each.drives])
            rows.add_row(str(chain.number), str(each.frame), driven, groups_text(each), each.name)
    return rows


def assortment_text(assortment: Sequence[int]) -> str:
    """Numbers of links of each order: 5 + 2 + 1."""
    return " + ".join(map(str, assortment))


def joint_text(chain: Chain, joint: int) -> str:
    """A joint by its links: 0-3."""
    return "{}-{}".format(*chain.edges[joint])


def groups_text(mechanism: ChainMechanism) -> str:
    """The groups in order, each by its links, with its class: 1 3 (II), 4 5 (II)."""
    return ", ".join(
        " ".join(map(str, links)) + (f" ({assur_class})" if assur_class else "")
        for links, assur_class in mechanism.groups
    )


def record(chain: Chain, with_mechanisms: bool) -> dict[str, Any]:
    """A chain as JSON values."""
    found: dict[str, Any] = {
        "number": chain.number,
        "links": chain.links,
        "freedom": chain.freedom,
        "joints": [list(joint) for joint in chain.edges],
        "pins": [list(pin) for pin in chain.pins],
        "slides": list(chain.slides),
        "pin_number": chain.pin_number,
        "loops": chain.loops,
        "assortment": list(chain.assortment),
        "symmetry": {
            "order": chain.symmetry.order,
            "links": [list(orbit) for orbit in chain.symmetry.link_orbits],
            "joints": [list(orbit) for orbit in chain.symmetry.joint_orbits],
        },
        "inversions": list(chain.inversions),
        "planar": chain.is_planar,
        "fractionated": chain.is_fractionated,
        "name": chain.name or None,
    }
    if with_mechanisms:
        found |= {"classes": chain.class_counts(), "mechanisms": [*_mechanism_records(chain)]}
    return found


def _mechanism_records(chain: Chain) -> Iterator[dict[str, Any]]:
    for each in chain.mechanisms():
        yield {
            "frame": each.frame,
            "drives": list(each.drives),
            "name": each.name or None,
            "class": each.assur_class,
            "groups": [{"links": list(links), "class": assur_class or None} for links, assur_class in each.groups],
        }

"""Links that cannot move against each other, as one: those that are welded, or that share two pins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from math import hypot

from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    Joint,
    PinJoint,
    Tracer,
    WheelJoint,
    joined_links,
    renamed_links,
)
from planar.foundation.errors import BadInput


def merge_links(linkage: DrawnLinkage, groups: Iterable[Sequence[str]]) -> DrawnLinkage:
    """The linkage with the links of each group as one, the frame where that is among them.

    A pin that then holds one link only is a point of it; a slide of a link in itself holds nothing and is left out.
    """
    parent: dict[str, str] = {}

    def root(link: str) -> str:
        while link in parent:
            link = parent[link]
        return link

    for group in groups:
        for other in group[1:]:
            one, two = root(group[0]), root(other)
            if one != two:
                kept, gone = (two, one) if two == root(linkage.frame) else (one, two)
                parent[gone] = kept
    if not parent:
        return linkage
    names = {link: root(link) for link in parent}

    def renamed_pair(links: tuple[str, str]) -> tuple[str, str]:
        return names.get(links[0], links[0]), names.get(links[1], links[1])

    joints: list[Joint] = []
    tracers: list[Tracer] = []
    for joint in linkage.joints:
        renamed = renamed_links(joint, names)
        if isinstance(renamed, PinJoint) and len(renamed.links) == 1:
            tracers.append(Tracer(renamed.name, renamed.links[0], renamed.at))
        elif isinstance(renamed, WheelJoint) or len(set(joined_links(renamed))) > 1:
            joints.append(renamed)
    return replace(
        linkage,
        frame=names.get(linkage.frame, linkage.frame),
        joints=tuple(joints),
        tracers=(*(t._replace(link=names.get(t.link, t.link)) for t in linkage.tracers), *tracers),
        inputs=tuple(item._replace(links=renamed_pair(item.links)) for item in linkage.inputs),
        stops=tuple(item._replace(links=renamed_pair(item.links)) for item in linkage.stops),
        masses=tuple(item._replace(link=names.get(item.link, item.link)) for item in linkage.masses),
        forces=tuple(item._replace(link=names.get(item.link, item.link)) for item in linkage.forces),
        links=tuple(dict.fromkeys(names.get(link, link) for link in linkage.links)),
        curved_slots=tuple(link for link in linkage.curved_slots if link not in (*names, *names.values())),
    )


def merge_links_of_two_pins(linkage: DrawnLinkage) -> DrawnLinkage:
    """The linkage with links that share two pins apart from each other as one, with a note of each such case."""
    while True:
        shared: dict[tuple[str, str], list[PinJoint]] = {}
        for joint in linkage.joints:
            if isinstance(joint, PinJoint):
                for two in combinations(joint.links, 2):
                    shared.setdefault((min(two), max(two)), []).append(joint)
        rigid = [two for two, pins in shared.items() if _apart(pins)]
        if not rigid:
            return linkage
        message = tuple(f"links {a!r} and {b!r} share two pins and are one link here" for a, b in rigid)
        linkage = merge_links(linkage, rigid).with_notes(*message)


def without_loose_links(linkage: DrawnLinkage) -> DrawnLinkage:
    """The linkage without what is joined to the frame by nothing, with a note of each such link."""
    reached, joints = {linkage.frame}, [set(joined_links(joint)) for joint in linkage.joints]
    while grown := [item for item in joints if item & reached and not item <= reached]:
        reached = reached.union(*grown)
    held = dict.fromkeys((*linkage.links, *(link for joint in linkage.joints for link in joined_links(joint))))
    loose = [link for link in held if link not in reached]
    if not loose:
        return linkage
    return replace(
        linkage,
        joints=tuple(joint for joint in linkage.joints if set(joined_links(joint)) <= reached),
        tracers=tuple(item for item in linkage.tracers if item.link in reached),
        inputs=tuple(item for item in linkage.inputs if set(item.links) <= reached),
        stops=tuple(item for item in linkage.stops if set(item.links) <= reached),
        masses=tuple(item for item in linkage.masses if item.link in reached),
        forces=tuple(item for item in linkage.forces if item.link in reached),
        links=tuple(link for link in linkage.links if link in reached),
        notes=(*linkage.notes, *(f"link {link!r} is joined to nothing that is held and is left out" for link in loose)),
    )


def without_rigid_motions(linkage: DrawnLinkage, place: str) -> DrawnLinkage:
    """The linkage without stops at joints that cannot move, with notes; raises BadInput for an input at one."""
    links_of = {joint.name: joined_links(joint) for joint in linkage.joints}

    def moves(motion: DrawnInput | DrawnStop) -> bool:
        first, second = motion.links
        return first != second and {first, second} <= set(links_of.get(motion.joint, ()))

    rigid = next((item for item in linkage.inputs if not moves(item)), None)
    if rigid is not None:
        message = f"the input at {rigid.joint!r} cannot move: the two links that it drives share two pins or are fixed"
        raise BadInput(place, f"{message} to each other; drive another joint, or part these links")
    notes = [
        f"the stops at {stop.joint!r} are left out: the two links that it joins cannot move against each other"
        for stop in linkage.stops
        if not moves(stop)
    ]
    return replace(linkage, stops=tuple(filter(moves, linkage.stops))).with_notes(*notes)


def _apart(pins: Sequence[PinJoint]) -> bool:
    """Whether two of them are apart."""
    return any(
        hypot(a.at[0] - b.at[0], a.at[1] - b.at[1]) > 1e-9 * (1.0 + hypot(*a.at)) for a, b in combinations(pins, 2)
    )

"""Sliding blocks that carry one pin and nothing else, as the slots that most programs have in their place."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

from planar.formats.drawn.drawn_linkage import DrawnLinkage, Joint, PinJoint, Place, SlideJoint, SlotJoint, joined_links


def slots_for_blocks(linkage: DrawnLinkage) -> DrawnLinkage:
    """The same motion of all other links, with a pin in a slot where a block slid that only carried this pin.

    A block stays whose slide or pin is driven, whose pin has stops, or that has a point, a mass or a load of its own.
    """
    joints = linkage.joints
    for slide in linkage.joints_of(SlideJoint):
        assert isinstance(slide, SlideJoint)
        pin = _pin_of_block(replace(linkage, joints=joints), slide)
        if pin is not None:
            joints = tuple(made for item in joints for made in _replaced(item, slide, pin))
            renamed = _slot_name(slide, pin)
            stops = (
                s._replace(joint=renamed, links=(slide.guide, _riders(slide, pin)[0])) if s.joint == slide.name else s
                for s in linkage.stops
            )
            linkage = replace(linkage, stops=tuple(stops))
    return replace(linkage, joints=joints)


def _pin_of_block(linkage: DrawnLinkage, slide: SlideJoint) -> PinJoint | None:
    """The one pin of what slides, where there is nothing else to it."""
    others = [item for item in linkage.joints if slide.slider in joined_links(item) and item != slide]
    own = [item.link for item in linkage.tracers]
    own += [item.link for item in linkage.masses] + [item.link for item in linkage.forces]
    driven = {item.joint for item in linkage.inputs}
    stopped = {item.joint for item in linkage.stops}
    if len(others) != 1 or slide.slider in own:
        return None
    pin = others[0]
    if (
        not isinstance(pin, PinJoint)
        or not near(pin.at, slide.at)
        or driven & {slide.name, pin.name}
        or pin.name in stopped
    ):
        return None
    return pin


def _replaced(joint: Joint, slide: SlideJoint, pin: PinJoint) -> tuple[Joint, ...]:
    if joint == slide:
        return ()
    if joint != pin:
        return (joint,)
    riders = _riders(slide, pin)
    slot = SlotJoint(_slot_name(slide, pin), slide.guide, riders[0], pin.at, slide.angle, slide.through)
    return (slot,) if len(riders) == 1 else (pin._replace(links=riders), slot)


def _riders(slide: SlideJoint, pin: PinJoint) -> tuple[str, ...]:
    """The links that are pinned to the block."""
    return tuple(link for link in pin.links if link != slide.slider)


def _slot_name(slide: SlideJoint, pin: PinJoint) -> str:
    """The name of the slot that replaces a block: that of its pin where only one link is pinned to the block."""
    return pin.name if len(_riders(slide, pin)) == 1 else slide.name


def near(one: Place, other: Place) -> bool:
    """Whether two places are one but for rounding."""
    return hypot(one[0] - other[0], one[1] - other[1]) <= 1e-9 * (1.0 + hypot(*one))

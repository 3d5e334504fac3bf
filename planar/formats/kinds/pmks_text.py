"""Texts and links of PMKS (M. I. Campbell): a line for each joint, with the links that it joins."""

from __future__ import annotations

import re
from urllib.parse import unquote

from planar.formats.drawn.drawn_linkage import (
    DrawnLinkage,
    Joint,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    WheelJoint,
    joined_links,
    joint_phrase,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument, WrittenText, cannot_say
from planar.formats.drawn.wheels import pitch_point
from planar.formats.kinds.parts.pmks_joints import PmksJoint, pmks_document
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput

TYPES = {"r", "p", "rp", "g"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
FLAGS = re.compile(r"[tf+-]{1,4}", re.IGNORECASE)
MAX_LINES = 5000
"""Joints of one file."""


def recognise(source: ForeignText) -> bool:
    """Whether it is a link with `mech=`, or every one of its first lines is a joint."""
    if source.value is not None or source.text.lstrip().startswith(("<", "M[")):
        return False
    if "mech=" in source.text[:100_000]:
        return True
    lines = [line for line in source.text.splitlines() if line.strip()][:5]
    return bool(lines) and all(_parsed(line) is not None for line in lines)


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a text or a link; of several the first. Raises BadInput at a line."""
    body, notes = source.text, []
    if "mech=" in body:
        _, *parts = body.split("mech=")
        body = parts[0]
        if len(parts) > 1:
            notes.append(f"the file holds {len(parts)} mechanisms, of which this is the first")
        if "|" in body:
            body = body.lstrip().splitlines()[0]
        body = body.partition("&")[0]
    lines = [line for line in unquote(body).replace("|", "\n").splitlines() if line.strip()]
    if len(lines) > MAX_LINES:
        raise BadInput(source.place, f"a mechanism of more than {MAX_LINES} joints is not read")
    joints = []
    for number, line in enumerate(lines, 1):
        joint = _parsed(line)
        if joint is None:
            message = f"{line.strip()!r:.80} is no joint: links, then R, P, RP or G, then x and y"
            raise BadInput(f"{source.place}, joint {number}", message)
        if joint not in joints:
            joints.append(joint)
    return pmks_document(source, joints, tuple(notes))


def _parsed(line: str) -> PmksJoint | None:
    """The joint of a line; None where it is none.

    The type is the first of its words that is one and stands before a number: links may be named by numbers, too.
    """
    words = [word for word in re.split(r"[,\s]+", line.strip()) if word]
    for index in range(1, len(words) - 1):
        if words[index].lower() in TYPES and NUMBER.fullmatch(words[index + 1]):
            break
    else:
        return None
    rest = words[index + 1 :]
    message: list[str] = []
    while len(rest) > 2 and rest[-1].lower() in ("true", "false"):
        message.insert(0, rest.pop()[0])
    flags = rest.pop() if len(rest) > 2 and FLAGS.fullmatch(rest[-1]) else "".join(message)
    if not 2 <= len(rest) <= 3 or not all(NUMBER.fullmatch(word) for word in rest):
        return None
    x, y, angle = (*map(float, rest), 0.0)[:3]
    if max(abs(x), abs(y), abs(angle)) > 1e100:
        return None
    driven = len(flags) == 4 and flags[3].lower() in "t+"
    return PmksJoint(tuple(words[:index]), words[index].upper(), x, y, angle, driven)


def write(linkage: DrawnLinkage) -> WrittenText:
    """A line for each joint, in the linkage's unit of length. Raises BadInput for what the text cannot say."""
    if len(linkage.inputs) > 1:
        raise cannot_say(FORMAT.title, f"the input at {linkage.inputs[1].joint!r}", "it has one input alone")
    names, driven = _link_names(linkage), {item.joint: item for item in linkage.inputs}
    lines = []
    for joint in linkage.joints:
        links, kind, at, angle = _written_joint(joint, linkage)
        if joint.name in driven:
            if kind not in ("R", "P"):
                raise cannot_say(FORMAT.title, f"the input at {joint_phrase(joint)}", "its inputs are pins and slides")
            first = driven[joint.name].links if kind == "R" else links
            links = (*first, *(item for item in links if item not in first))
        message = ",".join(names[link] for link in links)
        lines.append(f"{message},{kind},{at[0]!r},{at[1]!r},{angle!r},tff{'t' if joint.name in driven else 'f'}")
    lines += [f"{names[item.link]},R,{item.at[0]!r},{item.at[1]!r},0.0,tfff" for item in linkage.tracers]
    notes = [f"lengths are in {linkage.length}, which the format does not say; names of joints are not said either"]
    if any(item.velocity for item in linkage.inputs):
        notes.append("the velocity of the input is not said")
    return WrittenText("mech=\n" + "\n".join(lines) + "\n", tuple(notes))


def _written_joint(joint: Joint, linkage: DrawnLinkage) -> tuple[tuple[str, ...], str, Place, float]:
    """The links of a joint, its type, place and angle."""
    if isinstance(joint, PinJoint):
        return joint.links, "R", joint.at, 0.0
    if isinstance(joint, SlideJoint):
        return (joint.guide, joint.slider), "P", joint.at, joint.angle
    if isinstance(joint, SlotJoint):
        return (joint.guide, joint.rider), "RP", joint.at, joint.angle
    at = pitch_point(joint, linkage.joints) if isinstance(joint, WheelJoint) and joint.kind == "gear" else None
    if at is None:
        why = "its wheels touch at no place" if isinstance(joint, WheelJoint) and joint.kind == "gear" else ""
        raise cannot_say(FORMAT.title, joint_phrase(joint), why)
    return joined_links(joint)[:2], "G", at, 0.0


def _link_names(linkage: DrawnLinkage) -> dict[str, str]:
    """The names of links as words that are no type of joint; numbers stay, as PMKS has them."""
    book = NameBook({"ground", "gnd", *TYPES, *(item.upper() for item in TYPES)})
    links = dict.fromkeys((*linkage.links, *(link for joint in linkage.joints for link in joined_links(joint))))
    result = {link: book.fresh("_".join(link.split()), "link") for link in links}
    return result | {linkage.frame: "ground"}


FORMAT = FileFormat(
    name="pmks",
    title="PMKS (text)",
    suffixes=(".txt",),
    source="PMKSFileFormat.md and IOStringFunctions.cs of DesignEngrLab/PMKS",
    recognise=recognise,
    read=read,
    names_length_unit=False,
    write=write,
    precision="double precision",
    links=("http://.../?mech=...",),
)

"""Expressions and projects of Pyslvs (Yuan Chang): joints R, P and RP where they are drawn, with their links."""

from __future__ import annotations

import re

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    Joint,
    PinJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
    joined_links,
    joint_phrase,
    unit_note,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument, WrittenText, cannot_say
from planar.formats.drawn.rigid_links import merge_links, merge_links_of_two_pins, without_loose_links
from planar.formats.kinds.parts.pyslvs_expression import PyslvsJoint, parse_expression, write_expression
from planar.formats.kinds.parts.pyslvs_project import project_entries
from planar.formats.texts.names import NameBook

FRAME = "ground"
TITLE = "Pyslvs"


def recognise(source: ForeignText) -> bool:
    """Whether it begins as an expression, or has the entry `mechanism` of a project with one."""
    if source.value is not None:
        return False
    start = source.text.lstrip()
    return start.startswith("M[") or bool(re.search(r"(?:^|[{,\s])mechanism:\s*['\"]?\s*M\[", source.text))


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of an expression or a project. Raises BadInput."""
    pairs: list[tuple[int, int]] = []
    expression = source.text
    if not source.text.lstrip().startswith(("M[", "#")):
        expression, pairs = project_entries(source.text, source.place)
    return drawn_document(_linkage(source, parse_expression(expression, source.place), pairs), source.place)


def _linkage(source: ForeignText, given: list[PyslvsJoint], pairs: list[tuple[int, int]]) -> DrawnLinkage:
    book = NameBook({FRAME})
    joints: list[Joint] = []
    tracers: list[Tracer] = []
    blocks: list[tuple[str, ...]] = []
    names = [book.fresh(f"P{number}") for number in range(len(given))]
    links = [tuple(dict.fromkeys(_link(item, book) for item in joint.links)) for joint in given]
    for name, own, item in zip(names, links, given, strict=True):
        at = (item.x, item.y)
        if len(own) == 1:
            tracers.append(Tracer(name, own[0], at))
        elif item.kind == "R" and own:
            joints.append(PinJoint(name, own, at))
        elif own:
            guide, first, *others = own
            if others and item.kind == "RP":
                joints.append(PinJoint(book.fresh(f"{name}_pin"), own[1:], at))
            elif others:
                blocks.append(own[1:])
            kind = SlotJoint if item.kind == "RP" else SlideJoint
            joints.append(kind(name, guide, first, at, item.angle))
    linkage = DrawnLinkage(source.title, FRAME, tuple(joints), tuple(tracers), length=source.length_unit or "mm")
    linkage = _with_inputs(linkage, names, links, pairs).with_notes(unit_note(linkage.length))
    return without_loose_links(merge_links_of_two_pins(merge_links(linkage, blocks)))


def _link(name: str, book: NameBook) -> str:
    return FRAME if name == FRAME else book.name("link", name)


def _with_inputs(
    linkage: DrawnLinkage, names: list[str], links: list[tuple[str, ...]], pairs: list[tuple[int, int]]
) -> DrawnLinkage:
    """The linkage driven as the project says: the link that both joints share turns, or a slide moves."""
    from dataclasses import replace

    held = {item.name: item for item in linkage.joints}
    result: list[DrawnInput] = []
    notes: list[str] = []
    for base, driven in pairs:
        if max(base, driven) >= len(names):
            notes.append(f"the input ({base}, {driven}) is of joints that are not there and is left out")
            continue
        joint = held.get(names[base])
        if base == driven and isinstance(joint, SlideJoint | SlotJoint):
            result.append(DrawnInput(joint.name, (joint.guide, joined_links(joint)[1])))
            continue
        shared = [item for item in links[base] if item in links[driven] and item != FRAME]
        if isinstance(joint, PinJoint) and FRAME in joint.links and shared:
            result.append(DrawnInput(joint.name, (FRAME, shared[0])))
        else:
            notes.append(f"the input ({base}, {driven}) turns no link that is pinned to the ground and is left out")
    pins = [item for item in linkage.joints if isinstance(item, PinJoint) and FRAME in item.links]
    if not pairs and pins:
        result = [DrawnInput(pins[0].name, (FRAME, next(item for item in pins[0].links if item != FRAME)))]
        notes.append("an expression names no input; the first pin on the ground is driven")
    return replace(linkage, inputs=tuple(result)).with_notes(*notes)


def write(linkage: DrawnLinkage) -> WrittenText:
    """A project (YAML) with the expression and the inputs. Raises BadInput for what it cannot say."""
    book = NameBook({FRAME})
    order = dict.fromkeys((*linkage.links, *(link for joint in linkage.joints for link in joined_links(joint))))
    names = {link: book.fresh(_plain_word(link)) for link in order} | {linkage.frame: FRAME}
    joints: list[PyslvsJoint] = []
    indices: dict[str, int] = {}
    for joint in linkage.joints:
        if not isinstance(joint, PinJoint | SlideJoint | SlotJoint):
            raise cannot_say(TITLE, joint_phrase(joint))
        kind = {PinJoint: "R", SlideJoint: "P", SlotJoint: "RP"}[type(joint)]
        angle = 0.0 if isinstance(joint, PinJoint) else joint.angle
        indices[joint.name] = len(joints)
        joints.append(PyslvsJoint(kind, tuple(names[item] for item in joined_links(joint)), *joint.at, angle))
    joints += [PyslvsJoint("R", (names[item.link],), *item.at, 0.0) for item in linkage.tracers]
    pairs = [_input_pair(given, linkage, joints, indices, names) for given in linkage.inputs]
    lines = [f'mechanism: "{write_expression(joints)}"', *(["input:"] if pairs else [])]
    lines += [f"- - {base}\n  - {driven}" for base, driven in pairs]
    notes = [f"lengths are in {linkage.length}, which the format does not say; names of joints are not said either"]
    if any(item.velocity for item in linkage.inputs):
        notes.append("the velocity of the input is not said")
    return WrittenText("\n".join(lines) + "\n", tuple(notes))


def _plain_word(name: str) -> str:
    """A name as the expression has them: a letter first, then letters, digits and underscores."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
    return plain if plain[:1].isalpha() else f"L{plain}"


def _input_pair(
    given: DrawnInput,
    linkage: DrawnLinkage,
    joints: list[PyslvsJoint],
    indices: dict[str, int],
    names: dict[str, str],
) -> tuple[int, int]:
    """The joint about which a link turns, and another of it; a slide twice."""
    base = indices[given.joint]
    if joints[base].kind != "R":
        return base, base
    if linkage.frame not in given.links:
        message = f"the input of {given.links[1]!r} against {given.links[0]!r}"
        raise cannot_say(TITLE, message, "its inputs turn a link on the ground")
    link = next(names[item] for item in given.links if item != linkage.frame)
    others = (n for n, item in enumerate(joints) if n != base and link in item.links and item[2:4] != joints[base][2:4])
    driven = next(others, None)
    if driven is None:
        raise cannot_say(TITLE, f"the input at {given.joint!r}", f"the link {link!r} has no second joint")
    return base, driven


FORMAT = FileFormat(
    name="pyslvs",
    title=TITLE,
    suffixes=(".pyslvs",),
    source="pyslvs/expression_parser.py of KmolYuan/pyslvs, pyslvs_ui/io of KmolYuan/Pyslvs-UI",
    recognise=recognise,
    read=read,
    names_length_unit=False,
    write=write,
    precision="double precision",
)

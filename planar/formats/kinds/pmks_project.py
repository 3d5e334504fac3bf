"""Files `.pmks` of PMKS: the joints of its texts as JSON, with the speed of the input."""

from __future__ import annotations

from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.kinds.parts.pmks_joints import PmksJoint, pmks_document
from planar.formats.texts.foreign_value import ForeignValue

KINDS = ("R", "P", "RP", "G")


def recognise(source: ForeignText) -> bool:
    """Whether it is an object with joints that have a `TypeOfJoint`."""
    joints = source.value.get("Joints") if isinstance(source.value, dict) else None
    return isinstance(joints, list) and any(isinstance(item, dict) and "TypeOfJoint" in item for item in joints)


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a `.pmks` file. Raises BadInput at a JSON path."""
    top = ForeignValue(source.value)
    driving = top.number("DrivingIndex", -1.0)
    joints = []
    for index, item in enumerate(top.items("Joints")):
        kind = item.text("TypeOfJoint").strip().upper()
        if kind not in KINDS:
            raise item.at("TypeOfJoint").error(f"a joint is of type R, P, RP or G, not {kind!r:.40}")
        links = tuple(link.text() for link in item.items("Links"))
        if not links:
            raise item.at("Links").error("a joint is of one link at least")
        x, y, angle = item.number("X"), item.number("Y"), item.number("Angle", 0.0)
        joints.append(PmksJoint(links, kind, x, y, angle, index == driving))
    title = top.text("Name", "") or source.title
    notes = ("the speed of the input is taken as rad/s",) if top.number("InputSpeed", 0.0) else ()
    return pmks_document(source._replace(title=title), joints, notes, top.number("InputSpeed", 0.0))


FORMAT = FileFormat(
    name="pmks-file",
    title="PMKS (.pmks)",
    suffixes=(".pmks",),
    source="PMKSFileFormat.md of DesignEngrLab/PMKS, and the file that it saves",
    recognise=recognise,
    read=read,
    names_length_unit=False,
)

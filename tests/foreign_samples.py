"""One four-bar and one slider-crank as other programs save them, made here from their coordinates (mm)."""

from __future__ import annotations

import json
import re
from math import cos, hypot, pi, sin
from random import Random

FOUR_BAR = {"A": (0.0, 0.0), "B": (30.0, 40.0), "C": (90.0, 70.0), "D": (100.0, 0.0), "E": (60.0, 90.0)}
"""The frame AD, the crank AB, the coupler BC with its point E, the rocker DC."""
SLIDER_CRANK = {"A": (0.0, 0.0), "B": (30.0, 40.0), "C": (150.0, 0.0)}
"""The crank AB, the rod BC, and a pin C on the x-axis."""
PIXEL = 25.4 / 96.0
HOSTILE_WORDS = (
    "0",
    "-1",
    "1e9",
    "nan",
    "1e999",
    "",
    "null",
    "true",
    "[]",
    "{}",
    "R",
    "P",
    "ground",
    "x" * 50,
    "<",
    "|",
)
OLD_PLUS_SLIDER = (
    "https://app.pmksplus.com/?j=a,0,0,ab,R,t,Null,t%0Ab,3,4,ab%7Cbc,R,f,Null,f%0Ac,15,0,bc%7Ccd,R,f,Null,f%0A"
    "d,15,0,cd,P,t,0,f%0A&l=ab,R,1,1,1.5,2,a%7Cb,,line,0,0,0,0,0,0,0,0%0Abc,R,1,1,9,2,b%7Cc,F1,line,0,0,0,0,0,0,0,0%0A"
    "cd,P,Null,Null,Null,Null,c%7Cd,,Null,Null,Null,Null,Null,Null,Null,Null,Null%0A"
    "&f=F1,bc,9,2,9,5,t,true,7%0A&s=10,false,false,cm"
)
"""The slider-crank in a link of PMKS+ as it wrote them until 2023, with a force."""


def coupler_point(turn: float) -> tuple[float, float]:
    """Where E is when the crank has turned: B on its circle, C where two circles meet, on the side where it was."""
    (bx, by), (dx, _) = FOUR_BAR["B"], FOUR_BAR["D"]
    x, y = bx * cos(turn) - by * sin(turn), bx * sin(turn) + by * cos(turn)
    long, rocker = hypot(90 - 30, 70 - 40), hypot(90 - 100, 70)
    apart = hypot(dx - x, -y)
    along = (long**2 - rocker**2 + apart**2) / (2 * apart)
    up = (long**2 - along**2) ** 0.5
    ux, uy = (dx - x) / apart, -y / apart
    cx, cy = x + along * ux - up * uy, y + along * uy + up * ux
    # E in the axes of BC
    px, py = ((60 - 30) * 60 + (90 - 40) * 30) / long**2, ((90 - 40) * 60 - (60 - 30) * 30) / long**2
    return x + px * (cx - x) - py * (cy - y), y + px * (cy - y) + py * (cx - x)


def slider_place(turn: float) -> tuple[float, float]:
    """Where C is: on the x-axis, a rod's length from B."""
    x, y = 30 * cos(turn) - 40 * sin(turn), 30 * sin(turn) + 40 * cos(turn)
    return x + (120**2 + 40**2 - y * y) ** 0.5, 0.0


def linkage2(connectors: str, links: str, more: str = "") -> str:
    """A file of Linkage: connectors as `name x y attributes`, links as names of connectors, one of each a line."""
    parts, number = ["<linkage2>", '<program zoom="1" units="Millimeters"/>'], {}
    for line in connectors.strip().splitlines():
        name, x, y, *attributes = line.split()
        number[name] = len(number)
        limits = "".join(f'<slidelimit id="{number[each[1:]]}"/>' for each in attributes if each.startswith("~"))
        told = " ".join(each for each in attributes if not each.startswith("~"))
        at = f'x="{float(x) / PIXEL!r}" y="{float(y) / PIXEL!r}"'
        parts.append(f'<connector id="{number[name]}" name="{name}" layer="16" {at} {told}>{limits}</connector>')
    for index, line in enumerate(links.strip().splitlines()):
        names = [each for each in line.split() if each in number]
        told = " ".join(each for each in line.split() if each not in number)
        inside = "".join(f'<connector id="{number[each]}"/>' for each in names)
        parts.append(f'<Link id="{index}" layer="16" {told}>{inside}</Link>')
    return "\n".join([*parts, more, "</linkage2>"])


def pmksplus(code: str) -> str:
    """An address with its last sign, by the length of the rest."""
    digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
    return f"https://app.pmksplus.com/?{code}{digits[len(code) % 62]}"


def base64(value: float) -> str:
    """Thousandths in base 64, a leading 0 for a sign."""
    digits = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
    rest, found = abs(round(value * 1000)), ""
    while rest or not found:
        rest, digit = divmod(rest, 64)
        found = digits[digit] + found
    return ("0" if value < 0 else "") + found


def _plus(joints: str, links: str) -> str:
    told = "".join(
        f"{flags}{name},{name},{base64(float(x))},{base64(float(y))},{rest}."
        for flags, name, x, y, rest in (line.split() for line in joints.strip().splitlines())
    )
    made = "".join(
        f"Y{kind}{''.join(on.split('-'))},{''.join(on.split('-'))},0,0,0,0,c5cae9,{on.replace('-', ',')},,."
        for kind, on in (line.split() for line in links.strip().splitlines())
    )
    return pmksplus(f"1G.Fe.K,0.1011.{told}.{made}..N_")


def pmksplus_cylinder(scale: float, barrel: float, seal: float, rod: float) -> str:
    """A bar on a driven hydraulic cylinder along the x-axis: the barrel's length, where the rod begins, its length."""
    end = seal + rod
    joints = "".join(
        f"{flags}{name},{name},{base64(x)},{base64(y)},0{more}."
        for flags, name, x, y, more in (
            ("4", "A", 0.0, 0.0, ""),
            ("0", "B", barrel, 0.0, ""),
            ("8", "C", seal, 0.0, ""),
            ("0", "D", end, 0.0, ""),
            ("4", "E", end, 3.0, ""),
            ("Z", "P", seal, 0.0, f",AB,A,B,{base64(3.0)}"),
        )
    )
    links = "".join(f"AR{on},{on},0,0,0,0,c5cae9,{on[0]},{on[1]},,." for on in ("AB", "CD", "DE"))
    return pmksplus(f"1G.{base64(scale)},1E8.K,0.1011.{joints}.{links}YPCP,CP,0,0,0,0,,C,P,,...N_")


ASMT_POSE = "\n{0}Position3D\n{0}\t{1} {2} 0.0\n{0}RotationMatrix\n{0}\t1 0 0\n{0}\t0 1 0\n{0}\t0 0 1"


def asmt(parts: dict[str, dict[str, tuple[float, float]]], joints: str, motion: str) -> str:
    """An assembly: of each part its markers (mm, the assembly's own under ""), joints as `type name marker marker`."""

    def pose(tabs: int, x: float = 0.0, y: float = 0.0) -> str:
        return ASMT_POSE.format("\t" * tabs, repr(x / 1000), repr(y / 1000))

    def points(tabs: int, markers: dict[str, tuple[float, float]]) -> str:
        tab = "\t" * tabs
        found = f"\n{tab}RefPoints"
        for name, at in markers.items():
            turned = f"\n{tab}\t\t\tMarker\n{tab}\t\t\t\tName\n{tab}\t\t\t\t\t{name}"
            found += f"\n{tab}\tRefPoint{pose(tabs + 2)}\n{tab}\t\tMarkers{turned}"
            if name.startswith("x"):  # its z-axis along the plane's x
                found += f"\n{tab}\t\t\t\tPosition3D\n{tab}\t\t\t\t\t{at[0] / 1000!r} {at[1] / 1000!r} 0.0"
                found += (
                    f"\n{tab}\t\t\t\tRotationMatrix\n{tab}\t\t\t\t\t0 0 1\n{tab}\t\t\t\t\t1 0 0\n{tab}\t\t\t\t\t0 1 0"
                )
            else:
                found += pose(tabs + 4, *at)
        return found

    text = f"OndselSolver\nAssembly\n\tName\n\t\tAsm{pose(1)}{points(1, parts[''])}\n\tParts"
    for name, markers in parts.items():
        if name:
            text += f"\n\t\tPart\n\t\t\tName\n\t\t\t\t{name}{pose(3)}{points(3, markers)}"
    text += "\n\tConstraintSets\n\t\tJoints"
    for line in joints.strip().splitlines():
        kind, name, one, other = line.split()
        text += f"\n\t\t\t{kind}\n\t\t\t\tName\n\t\t\t\t\t{name}"
        text += f"\n\t\t\t\tMarkerI\n\t\t\t\t\t/Asm/{one}\n\t\t\t\tMarkerJ\n\t\t\t\t\t/Asm/{other}"
    where, formula = motion.split(" ", 1)
    text += (
        f"\n\t\tMotions\n\t\t\tRotationalMotion\n\t\t\t\tName\n\t\t\t\t\tM\n\t\t\t\tMotionJoint\n\t\t\t\t\t/Asm/{where}"
    )
    text += f"\n\t\t\t\tRotationZ\n\t\t\t\t\t{formula}"
    return f"{text}\n\tForceTorques\n\tConstantGravity\n\t\t0.0 -9.81 0.0\nTimeSeries\n"


def asmt_limit(kind: str, joint: str, limit: str, sign: str) -> str:
    """A limit of a joint of an assembly, to stand under `Limits`."""
    rows = {"Name": f"{joint}{sign}", "MotionJoint": f"/Asm/{joint}", "Limit": limit, "Type": sign, "Tol": "1.0e-9"}
    return f"\n\t\t\t{kind}" + "".join(f"\n\t\t\t\t{key}\n\t\t\t\t\t{value}" for key, value in rows.items())


def mutated(text: str, draw: Random) -> str:
    """A text with one to three words, lines or marks changed, doubled, exchanged or left out."""
    for _ in range(draw.choice((1, 1, 2, 3))):
        words = re.findall(r"[A-Za-z_]+|-?\d+\.?\d*(?:e-?\d+)?|\s+|.", text, re.DOTALL) or [""]
        index, other = draw.randrange(len(words)), draw.randrange(len(words))
        change = draw.randrange(6)
        if change == 0:
            words[index] = draw.choice(HOSTILE_WORDS)
        elif change == 1:
            del words[index : index + draw.choice((1, 2, 5, 20))]
        elif change == 2:
            words[index], words[other] = words[other], words[index]
        elif change == 3:
            words[index:index] = words[other : other + draw.choice((1, 3, 10, 40))]
        elif change == 4:
            words[index] *= 2
        else:
            lines = text.split("\n")
            lines.insert(draw.randrange(len(lines)), lines[draw.randrange(len(lines))])
            words = ["\n".join(lines)]
        text = "".join(words)
    return text


def _lists(points: dict[str, tuple[float, float]]) -> list[dict[str, object]]:
    return [{"id": name, "x": x / 25.4, "y": y / 25.4} for name, (x, y) in points.items()]


def _pylinkage(points: dict[str, tuple[float, float]], kinds: dict[str, dict], links: list[dict]) -> str:
    joints = [{"id": n, "type": "revolute", "position": list(at)} | kinds.get(n, {}) for n, at in points.items()]
    return json.dumps({"name": "sample", "joints": joints, "links": links, "ground": "ground"})


FOUR_BARS = {
    "linkage2": linkage2(
        'A 0 0 anchor="true" input="true" rpm="-60"\nB 30 40\nC 90 70\nD 100 0 anchor="true"\nE 60 90 draw="true"',
        "A B\nB C E\nC D",
    ),
    "pmks": "ground,AB,R,0,0,tfft\nAB BC R 30 40 0 ffff\nBC,DC,R,90,70\nDC gnd R 100 0\nBC,R,60,90,0,tfff\n",
    "pmks-file": json.dumps(
        {
            "Joints": [
                {"X": x, "Y": y, "Angle": 0.0, "TypeOfJoint": "R", "Links": on}
                for (x, y), on in zip(
                    FOUR_BAR.values(),
                    (["ground", "AB"], ["AB", "BC"], ["BC", "DC"], ["DC", "ground"], ["BC"]),
                    strict=True,
                )
            ],
            "DrivingIndex": 0,
            "InputSpeed": 2.0 * pi,
        }
    ),
    "pmksplus": _plus(
        "M A 0 0 0\nG B 3 4 0\nG C 9 7 0\nK D 10 0 0\n0 E 6 9 0",
        "R A-B\nR B-C-E\nR C-D",
    ),
    "motiongen": json.dumps(
        {
            "name": "motiongen-pro",
            "mechanism": {
                "joints": _lists(FOUR_BAR),
                "slots": [],
                "links": [
                    {"id": "1", "jointIds": ["A", "B"]},
                    {"id": "2", "jointIds": ["B", "C", "E"]},
                    {"id": "3", "jointIds": ["C", "D"]},
                    {"id": "4", "jointIds": ["A", "D"], "isGround": True},
                ],
                "cylinders": [],
                "actuators": [{"type": "rotary", "at": "A", "from": "D", "to": "B", "velocity": 360}],
            },
        }
    ),
    "pyslvs": "M[J[R, color[Green], P[0, 0], L[ground, AB]], J[R, P[30., 40], L[AB, BC]],  # the crank\n"
    "J[R, color[(1, 2, 3)], P[9e1, 70.0], L[BC, DC]], J[R, P[100, 0], L[ground, DC]], J[R, P[60, 90], L[BC,]],]",
    "pylinkage": _pylinkage(
        {k: v for k, v in FOUR_BAR.items() if k != "E"} | {"E": (0.0, 0.0)},
        {
            "A": {"type": "ground"},
            "D": {"type": "ground"},
            "E": {
                "type": "tracker",
                "ref_joint1_id": "B",
                "ref_joint2_id": "C",
                "distance": hypot(30, 50),
                "angle": 0.5667292175235064,
            },
        },
        [
            {"id": "ground", "type": "ground", "joints": ["A", "D"]},
            {"id": "AB", "type": "driver", "joints": ["A", "B"], "motor_joint": "A", "angular_velocity": 0.1},
            {"id": "BC", "type": "link", "joints": ["B", "C"]},
            {"id": "DC", "type": "link", "joints": ["C", "D"]},
        ],
    ),
    "ondsel": asmt(
        {
            "": {"m1": (0, 0), "m2": (100, 0)},
            "AB": {"a": (0, 0), "b": (30, 40)},
            "BC": {"b": (30, 40), "c": (90, 70)},
            "DC": {"c": (90, 70), "d": (100, 0)},
            "pen": {"e": (60, 90), "c": (90, 70)},
        },
        "RevoluteJoint A m1 AB/a\nRevoluteJoint B AB/b BC/b\nRevoluteJoint C BC/c DC/c\nRevoluteJoint D DC/d m2\n"
        "FixedJoint weld BC/c pen/c",
        "A 2.0d*pi*time",
    ),
}
SLIDER_CRANKS = {
    "linkage2": linkage2(
        'A 0 0 anchor="true" input="true" rpm="-60"\nB 30 40\nL 50 0 anchor="true"\nR 200 0 anchor="true"\n'
        'C 150 0 slider="true" ~L ~R',
        "A B\nB C\nL R",
    ),
    "pmks": "?set=s5&mech=ground%20crank%20R%200%200%200%20ffft|"
    "crank%20rod%20R%2030%2040|ground%20rod%20RP%20150%200%200%20ffff|",
    "pmksplus": _plus(
        "M A 0 0 0\nG B 3 4 0\nG C 15 0 0\n5 P 15 0 0",
        "R A-B\nR B-C\nP C-P",
    ),
    "motiongen": json.dumps(
        {
            "joints": _lists(SLIDER_CRANK | {"L": (50.0, 0.0), "R": (200.0, 0.0)}),
            "links": [
                {"joints": ["A", "B"]},
                {"joints": ["B", "C"]},
                {"joints": ["L", "R"], "slots": ["s"]},
                {"joints": ["A", "L", "R"], "isGround": True},
            ],
            "slots": [{"id": "s", "ends": ["L", "R"], "riders": ["C"]}],
            "actuators": [{"type": "rotary", "at": "A", "from": "L", "to": "B", "velocity": 360}],
        }
    ),
    "pyslvs": "input:\n- - 0\n  - 1\nlinks:\n  ground: White\nmechanism: M[J[R, P[0, 0], L[ground, crank]],\n"
    "  J[R, P[30, 40], L[crank, rod]], J[RP, A[0.0], P[150, 0], L[ground, rod]]]\npyslvs_ver: 22.7.0\n",
    "pylinkage": _pylinkage(
        SLIDER_CRANK,
        {"A": {"type": "ground"}, "C": {"type": "prismatic", "axis": [1.0, 0.0], "line_point": [0.0, 0.0]}},
        [
            {"id": "AB", "type": "arc_driver", "joints": ["A", "B"], "motor_joint": "A", "angular_velocity": 0.1},
            {"id": "BC", "type": "link", "joints": ["B", "C"]},
        ],
    ),
    "ondsel": asmt(
        {
            "": {"m1": (0, 0), "x0": (0, 0)},
            "crank": {"a": (0, 0), "b": (30, 40)},
            "rod": {"b": (30, 40), "c": (150, 0)},
            "piston": {"c": (150, 0), "x1": (150, 0)},
        },
        "RevoluteJoint A m1 crank/a\nRevoluteJoint B crank/b rod/b\nRevoluteJoint C rod/c piston/c\n"
        "CylindricalJoint slide x0 piston/x1",
        "A (0 + 70*sin((360*time - 0)*pi/180.0d))*pi/180.0d",
    ),
}
LINKAGE_SIM = {
    "schema_version": "1.0.0",
    "bodies": {
        "ground": {"attachment_points": {"O2": [0.0, 0.0], "rail": [0.0, 0.0]}, "mass": 0.0},
        "crank": {
            "attachment_points": {"A": [0.0, 0.0], "B": [1.0, 0.0]},
            "mass": 2.0,
            "cg_local": [0.5, 0.0],
            "Izz_cg": 0.01,
        },
        "conrod": {"attachment_points": {"B": [0.0, 0.0], "C": [3.0, 0.0]}, "coupler_points": {"P": [1.5, 0.5]}},
        "slider": {"attachment_points": {"pin": [0.0, 0.0]}},
        "cap": {"attachment_points": {"q": [0.1, 0.0]}, "mass": 0.5, "cg_local": [0.0, 0.0]},
    },
    "joints": {
        "J1": {"type": "revolute", "body_i": "ground", "body_j": "crank", "point_i": "O2", "point_j": "A"},
        "J2": {"type": "revolute", "body_i": "crank", "body_j": "conrod", "point_i": "B", "point_j": "B"},
        "J3": {"type": "revolute", "body_i": "conrod", "body_j": "slider", "point_i": "C", "point_j": "pin"},
        "P1": {
            "type": "prismatic",
            "body_i": "ground",
            "body_j": "slider",
            "point_i": "rail",
            "point_j": "pin",
            "axis_local_i": [1.0, 0.0],
            "delta_theta_0": 0.0,
        },
        "W": {
            "type": "fixed",
            "body_i": "slider",
            "body_j": "cap",
            "point_i": "pin",
            "point_j": "q",
            "delta_theta_0": pi / 2,
        },
        "D1": {
            "type": "revolute_driver",
            "body_i": "ground",
            "body_j": "crank",
            "note": "driver function not serializable",
        },
    },
}
"""A slider-crank of 1 and 3 m with a cap that is fixed to its slider, as linkage_sim saves one."""

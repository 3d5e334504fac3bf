"""A cam's profile as the content of a CSV or SVG file, with the tolerance that its points keep."""

from __future__ import annotations

from math import degrees

import numpy as np

from planar.analysis.cams.cam_profile import CamProfile
from planar.foundation.errors import BadInput, unknown_format_error
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits

DEFAULT_TOLERANCE = 1e-5
"""m: a hundredth of a millimetre."""
MIN_TOLERANCE = 1e-8
"""m: finer points are not made."""
FORMATS = (".csv", ".svg")
SVG_MARGIN, STROKE_WIDTH = 2.0, 0.1
"""mm"""


def encode_profile(found: CamProfile, units: FileUnits, suffix: str, tolerance: float = DEFAULT_TOLERANCE) -> bytes:
    """The profile's points for the ending `.csv` or `.svg`: straight lines between them keep within `tolerance` (m).

    Raises BadInput for another ending, a tolerance too fine, and for a profile that cannot be made.
    """
    if suffix.lower() not in FORMATS:
        raise unknown_format_error(suffix, "a profile", FORMATS)
    if not tolerance >= MIN_TOLERANCE:
        raise BadInput("--tolerance", f"a tolerance of {MIN_TOLERANCE * 1e3:g} mm at least is wanted here")
    if found.cam.profile_by_points is not None:  # where the follower goes over a hollow, it touches but a part
        raise BadInput(found.pair, "this profile is given by points of the file itself; there is none to write")
    if found.problem():
        raise BadInput(found.pair, found.problem())
    angle = found.points(tolerance)
    text = _csv(found, angle, units, tolerance) if suffix.lower() == ".csv" else _svg(found, angle, tolerance)
    return text.encode()


def _csv(found: CamProfile, angle: np.ndarray, units: FileUnits, tolerance: float) -> str:
    """A row a point: the angle of the law, the place in the cam's axes from its centre, and the profile's normal."""
    length = parse_unit(units.length)
    per = length.from_si(1.0)
    at = found.at(angle)
    head = [
        "law angle (deg)",
        f"x ({units.length})",
        f"y ({units.length})",
        "normal x",
        "normal y",
        f"lift ({units.length if found.cam.line is not None else 'deg'})",
    ]
    lift = at.lift[0] * per if found.cam.line is not None else np.degrees(at.lift[0])
    rows = np.column_stack([np.degrees(angle), at.profile * per, at.normal, lift]).tolist()
    told = f"# profile of {found.pair} of {found.mechanism} in the cam's axes from its centre; straight lines between "
    told += f"the points keep within {length.from_si(tolerance):.6g} {units.length}\n"
    return told + ",".join(head) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)


def _svg(found: CamProfile, angle: np.ndarray, tolerance: float) -> str:
    """The profile in millimetres, y upwards in the cam's axes, with its base circle and centre."""
    points = found.at(angle).profile * 1e3
    base = found.base_radius * 1e3
    low = np.minimum(points.min(axis=0), -base) - SVG_MARGIN
    high = np.maximum(points.max(axis=0), base) + SVG_MARGIN
    width, height = high - low
    path = " ".join(f"{x:.6f},{-y:.6f}" for x, y in points.tolist())
    told = f"straight lines between the points keep within {tolerance * 1e3:.6g} mm"
    style = f'fill="none" stroke="black" stroke-width="{STROKE_WIDTH}"'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6f}mm" height="{height:.6f}mm" '
        f'viewBox="{low[0]:.6f} {-high[1]:.6f} {width:.6f} {height:.6f}">\n'
        f"<title>Profile of a cam, in mm</title>\n<desc>{told}; start of the law at "
        f"{degrees(found.cam.start):.6g} deg</desc>\n"
        f'<polygon id="profile" points="{path}" {style}/>\n'
        f'<circle id="base-circle" r="{base:.6f}" {style} stroke-dasharray="1 1"/>\n'
        f'<path id="centre" d="M-2,0H2M0,-2V2" {style}/>\n</svg>\n'
    )

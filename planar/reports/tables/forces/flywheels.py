"""The flywheel that forces over a cycle ask for, as facts for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from planar.dynamics.flywheel import Flywheel, flywheel
from planar.dynamics.forces import Forces
from planar.model.wording import amount
from planar.reports.number_format import quantity_text


class WantedFlywheel(NamedTuple):
    """A flywheel for a coefficient of fluctuation, and the mean radius of its rim (m), if that is given."""

    flywheel: Flywheel
    radius: float | None

    @property
    def rim_mass(self) -> float | None:
        """Of a thin rim of this radius (kg)."""
        return None if self.radius is None else self.flywheel.rim_mass(self.radius)


def wanted_flywheel(forces: Forces, fluctuation: float | None, radius: float | None) -> WantedFlywheel | None:
    """The flywheel of the input that runs; None where none is wanted. Raises BadInput."""
    if fluctuation is None:
        return None
    return WantedFlywheel(flywheel(forces, fluctuation=fluctuation), radius)


def flywheel_facts(forces: Forces, wanted: WantedFlywheel) -> Iterator[tuple[str, str]]:
    """The steady torque, the fluctuation of energy, and the flywheel, with the mass of its rim."""
    found, units = wanted.flywheel, forces.mechanism.units
    fast, slow = (amount(each, "angle", units) for each in (found.fastest, found.slowest))
    mean, energy = quantity_text(found.mean, "torque", units), quantity_text(found.energy, "energy", units)
    yield (
        "flywheel",
        f"driven by the steady torque {mean}, {found.input!r} has {energy} "
        f"too much and too little by turns: fastest at {fast}, slowest at {slow}",
    )
    if found.inertia is None or found.speed is None:
        yield "", "no moment of inertia: the input has no steady speed"
        return
    rim = ""
    if wanted.rim_mass is not None and wanted.radius is not None:
        rim = f", a rim of {quantity_text(wanted.rim_mass, 'mass', units)} at {amount(wanted.radius, 'length', units)}"
    yield (
        "",
        f"for a coefficient of fluctuation {found.fluctuation:g} at "
        f"{quantity_text(found.speed, 'angular velocity', units)}: "
        f"I = ΔE / (C ω²) = {quantity_text(found.inertia, 'moment of inertia', units)}{rim}",
    )


def record(wanted: WantedFlywheel) -> dict[str, Any]:
    """The flywheel as a JSON value (SI)."""
    found = wanted.flywheel
    names = ("input", "mean", "energy", "fastest", "slowest", "fluctuation", "speed", "inertia")
    rim = {} if wanted.radius is None else {"radius": wanted.radius, "rim_mass": wanted.rim_mass}
    return {name: getattr(found, name) for name in names} | rim

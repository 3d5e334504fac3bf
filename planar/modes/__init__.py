"""Every assembly of a mechanism at given inputs. The room is called as its function is: `planar.modes(mechanism)`."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planar.mechanism import Drive, Mechanism
    from planar.modes.modes import Modes


class _Room(ModuleType):
    """The package `planar.modes` takes the name `modes` in planar as soon as any of its files is loaded, so that the
    function of this name has to be the package itself."""

    def __call__(
        self, mechanism: Mechanism, drives: Mapping[str, float] | Sequence[Drive] = (), *, certify: bool = True
    ) -> Modes:
        from planar.modes.modes import modes

        return modes(mechanism, drives, certify=certify)


sys.modules[__name__].__class__ = _Room

"""How the tests are run."""

import atexit
import os
from tempfile import TemporaryDirectory

from hypothesis import settings

if "PLANAR_CACHE" not in os.environ:
    # code is compiled once for all workers and processes of a run, and nothing is left with the user
    _code = TemporaryDirectory()
    atexit.register(_code.cleanup)
    os.environ["PLANAR_CACHE"] = _code.name

# checks that decide over a change try the same examples each time; everywhere else new ones are looked for
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable" if os.environ.get("CI") else "default")

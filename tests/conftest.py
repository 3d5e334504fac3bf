"""How the tests are run."""

import atexit
import os
from tempfile import TemporaryDirectory

from tests.draws import load_profile

for _limit in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_limit, "1")  # matrices are small, and on a busy machine threads wait for one another
if "PLANAR_CACHE" not in os.environ:
    # code is compiled once for all workers and processes of a run, and nothing is left with the user
    _code = TemporaryDirectory()
    atexit.register(_code.cleanup)
    os.environ["PLANAR_CACHE"] = _code.name

load_profile()

"""How the tests are run."""

import os

from hypothesis import settings

# checks that decide over a change try the same examples each time; everywhere else new ones are looked for
settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable" if os.environ.get("CI") else "default")

"""One thread for linear algebra, as the command line has it; the same examples in every run."""

import os

from scissorcal.cli.root import THREAD_VARIABLES
from tests.property_profiles import use_profiles

pytest_plugins = ("tests.realtime",)

for variable in THREAD_VARIABLES:
    os.environ.setdefault(variable, "1")

use_profiles()

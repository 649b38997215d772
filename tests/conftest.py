"""One thread for linear algebra, as the command line has it: test processes share the machine."""

import os

from scissorcal.cli.root import THREAD_VARIABLES

for variable in THREAD_VARIABLES:
    os.environ.setdefault(variable, "1")

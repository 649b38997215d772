"""One thread for linear algebra, as the command line has it, and no time limits of examples.

Test processes share the machine: how long an example takes says nothing of the code.
"""

import os

import hypothesis

from scissorcal.cli.root import THREAD_VARIABLES

pytest_plugins = ("tests.realtime",)

for variable in THREAD_VARIABLES:
    os.environ.setdefault(variable, "1")

hypothesis.settings.register_profile("scissorcal", deadline=None)
hypothesis.settings.load_profile("scissorcal")

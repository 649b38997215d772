"""Virtual rigs are probed once in a run."""

from tests.probed_once import probed_once as probed_once

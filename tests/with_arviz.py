"""ArviZ for tests, or a skip.

ArviZ writes the date of its last note to the person's cache by way of one temporary file: of two
workers that import it at once on a new day, one finds that file gone. Each process gets a folder of
its own while it imports.
"""

import os
import tempfile
import warnings
from typing import Any
from unittest import mock

import pytest

with (
    tempfile.TemporaryDirectory() as folder,
    mock.patch.dict(os.environ, {"XDG_CACHE_HOME": folder}),
    warnings.catch_warnings(),
):
    warnings.simplefilter("ignore", FutureWarning)  # its note on its own next version
    arviz: Any = pytest.importorskip("arviz")

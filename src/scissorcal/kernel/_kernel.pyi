"""The compiled C core. Its declarations are those of the headers under ``c/``."""

from typing import Any

ffi: Any
lib: Any

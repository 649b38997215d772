"""The compiled firmware core. Its declarations are those of the headers of ``firmware/core``."""

from typing import Any

ffi: Any
lib: Any

"""Calibrate, identify and render a haptic scissors rig, with uncertainty that can be trusted.

>>> import scissorcal
>>> package = scissorcal.open_package("package/paper-80gsm.zip")  # doctest: +SKIP
>>> package.torque(opening=0.5, opening_rate=-0.2, contact=0.03)  # doctest: +SKIP
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scissorcal.package import open_package

__all__ = ["__version__", "open_package"]

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    if name == "open_package":
        from scissorcal.package import open_package

        return open_package
    raise AttributeError(f"module 'scissorcal' has no attribute {name!r}")

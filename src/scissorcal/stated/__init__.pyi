from .build import build_package as build_package
from .numbers import Blades as Blades
from .numbers import Friction as Friction
from .numbers import Material as Material

__all__ = ["Blades", "Friction", "Material", "build_package"]

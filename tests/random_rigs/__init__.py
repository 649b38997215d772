"""Random rigs in virtual time, healthy and wrong, of other construction than what is fitted."""

from .link import RigLink
from .person import Person
from .rigs import WRONG, RigParameters, healthy, wrong

__all__ = ["WRONG", "Person", "RigLink", "RigParameters", "healthy", "wrong"]

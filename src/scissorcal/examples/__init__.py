"""Small examples that travel with scissorcal, so that what its pages show can be run anywhere.

Both are simulated: a virtual rig's, not measurements. ``friction`` is a recording of empty motion
(38 s at 200 samples/s), ``paper-package`` the package of the recipe paper-80gsm. Command that
writes them: ``python benchmarks/make_examples.py``.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

from scissorcal.errors import InputError, check_known

if TYPE_CHECKING:
    from scissorcal.aliases import Array
    from scissorcal.package import ModelPackage
    from scissorcal.recording import Recording

FILES = {"friction": "friction.npz", "paper-package": "paper-package.zip"}

SIMULATED = "A virtual rig, simulated: no measurement."

ELSEWHERE = {
    "emps": "The log of EMPS, a linear stage with friction, is not shipped, as it is not ours: its "
    "authors (Janot, Gautier, Brunot 2019) publish DATA_EMPS.mat at "
    "https://www.nonlinearbenchmark.org. Import it with scissorcal.recording.import_table, whose "
    "example has its columns."
}
"""Known data of others, and where they are."""


def names() -> tuple[str, ...]:
    """Names that `load` takes."""
    return tuple(FILES)


def path(name: str) -> Path:
    """Give the file of an example, an archive of NumPy arrays or a package.

    Raises UnknownNameError, which names the nearest name, and InputError, which says where data are
    that are well known and not shipped.

    >>> path("paper-package").name
    'paper-package.zip'
    """
    if name in ELSEWHERE:
        raise InputError(ELSEWHERE[name])
    check_known("example", name, FILES)
    return Path(__file__).parent / FILES[name]


def arrays(name: str = "friction") -> "dict[str, Array]":
    """Give an example's log as arrays (n,) by the names that `Recording.from_arrays` takes.

    >>> {name: array.shape for name, array in arrays("friction").items()}
    {'time_s': (7681,), 'opening_rad': (7681,), 'torque_Nm': (7681,)}
    """
    import numpy as np

    file = path(name)
    if file.suffix != ".npz":
        raise InputError(
            f"The example {name} is a package, not a log: use examples.load({name!r})."
        )
    with np.load(file) as stored:
        return {
            "time_s": 1e-6 * stored["time_us"],
            "opening_rad": 1e-6 * stored["opening_urad"],
            "torque_Nm": 1e-6 * stored["torque_uNm"],
        }


@overload
def load(name: Literal["friction"]) -> "Recording": ...
@overload
def load(name: Literal["paper-package"]) -> "ModelPackage": ...
@overload
def load(name: str) -> "Recording | ModelPackage": ...
def load(name: str) -> "Recording | ModelPackage":
    """Load an example: the recording "friction", or the package "paper-package".

    Raises as `path` does.

    >>> load("friction").kind
    'friction'
    >>> load("fricton")
    Traceback (most recent call last):
    scissorcal.errors.UnknownNameError: "fricton" is no example. Did you mean "friction"? \
There are: friction, paper-package.
    """
    file = path(name)
    if file.suffix == ".zip":
        from scissorcal.package import open_package

        return open_package(file, warn=False)
    from scissorcal.recording import Recording

    return Recording.from_arrays(**arrays(name), notes=(SIMULATED,))

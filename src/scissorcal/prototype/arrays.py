"""Arrays as a page reads them: float32 in base64, in one JSON text."""

import base64

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict


class Part(BaseModel):
    """Base of everything that a page is told: frozen, and without numbers that JSON lacks."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Numbers(Part):
    """An array of float32, little-endian, row by row."""

    shape: tuple[int, ...]
    base64: str

    @classmethod
    def of(cls, values: ArrayLike) -> "Numbers":
        """Pack an array; ValueError where a number is not finite in float32.

        >>> Numbers.of([1.0, 2.0])
        Numbers(shape=(2,), base64='AACAPwAAAEA=')
        """
        array = np.asarray(values, dtype="<f4")
        if not np.isfinite(array).all():
            raise ValueError("a page shows finite numbers only")
        return cls(shape=array.shape, base64=base64.b64encode(array.tobytes()).decode())

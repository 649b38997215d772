"""An encoder that shows too little of a material's unloading is named, with what would do."""

from dataclasses import replace

import pytest

from scissorcal.calibration.cut.guess import CoarseEncoderError
from scissorcal.calibration.cut.scout import FEWEST_FOR_A_PIECE, refuse_coarse
from scissorcal.calibration.cut.segments import Segments

FEW = Segments((), (), (), (), longest=0.016, steps=20.9, most_segments=5.2)


def test_too_few_steps_are_named_with_the_counts_that_would_do() -> None:
    with pytest.raises(
        CoarseEncoderError, match=r"over 16 mrad.*21 steps.*0\.77 mrad.*9,000 counts"
    ):
        refuse_coarse(FEW)


@pytest.mark.parametrize("segments", [0.0, FEWEST_FOR_A_PIECE])
def test_no_unloading_at_all_and_enough_segments_are_not_the_encoders(segments: float) -> None:
    refuse_coarse(replace(FEW, most_segments=segments))

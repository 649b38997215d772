"""What goes wrong with a build of docs/build, as a person would call it."""

from .parts import Build
from .rig import Wrong

FIRST: dict[str, Wrong] = {
    "motor unplugged": Wrong(rig=(("motor_gain", 0.0), ("report_gain", 0.0))),
    "a tenth of the limit": Wrong(limit_share=0.1),
}
"""Not wrong: the first steps with a new build."""
ALL: dict[str, Wrong] = {
    "motor wires swapped": Wrong(rig=(("motor_sign", -1.0),)),
    "encoder counts the other way": Wrong(rig=(("encoder_sign", -1.0),)),
    "ratio or counts entered wrong by 2": Wrong(rig=(("encoder_scale", 0.5),)),
    "homed to the wrong place by 0.3 rad": Wrong(rig=(("encoder_zero", 0.3),)),
    "current sensor saturates at 6 mN m": Wrong(saturates_at=6e-3),
}
CAPSTAN: dict[str, Wrong] = {
    "capstan slips above 0.3 rad/s": Wrong(slips_above=0.3),
    "cable loose by 10 mrad": Wrong(rig=(("backlash", 0.01),)),
}
MAGNET: dict[str, Wrong] = {
    "magnet loose by 50 mrad": Wrong(rig=(("backlash", 0.05),)),
    "magnet loose by 10 mrad": Wrong(rig=(("backlash", 0.01),)),
}


def faults_of(build: Build) -> dict[str, Wrong]:
    """The faults that this build can have."""
    return {**ALL, **(MAGNET if build.ratio == 1.0 else CAPSTAN)}

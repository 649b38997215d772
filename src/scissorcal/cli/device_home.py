"""``scissorcal device home``"""

import math

from scissorcal.cli.options import Baud, Device, Seed, Yes
from scissorcal.cli.output import Answer, command


@command
def home(device: Device, yes: Yes = False, seed: Seed = 0, baud: Baud = None) -> Answer:
    """Have a device find the zero of its encoders; the blades move by themselves.

    Needed after power-on where a device states NOT_HOMED: probes, captures and renderings refuse it
    until then, and never home it themselves. The blades move slowly until they meet their stop.
    Keep the space between them empty and let go of the handles. A device that finds no zero, or
    latches a fault on the way, is reported with the reason (exit code 4).

    \b
    Example:
      $ scissorcal device home --device sim
      The zero was found in 2.7 s; the opening is 8 degrees.
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.device.home import home as find_zero
    from scissorcal.recipe.schema import Line
    from scissorcal.workday.rigs import open_rig

    line = Line(baud=baud) if baud else Line()
    with open_rig(device, "office-paper", seed, line=line) as link, LiveView(ask=not yes) as view:
        homed = find_zero(link, view.operator)
        identity = link.identity
    text = (
        f"The zero was found in {homed.seconds:.1f} s; the opening is "
        f"{math.degrees(homed.opening_rad):.3g} degrees."
    )
    result = {
        "device": identity.name,
        "serial": identity.serial,
        "homed": True,
        "was_homed": homed.was_homed,
        "seconds": homed.seconds,
        "opening_rad": homed.opening_rad,
    }
    return Answer(result, text)

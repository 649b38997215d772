"""``scissorcal device doctor``"""

from typing import Annotated

import typer

from scissorcal.cli.options import Baud, Device, Seed
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress


@command
def doctor(
    device: Device,
    seconds: Annotated[
        float, typer.Option(min=0.2, max=600.0, help="How long to listen to the rig.")
    ] = 5.0,
    seed: Seed = 0,
    baud: Baud = None,
) -> Answer:
    """Measure the port, the timer and the scheduler, and name the remedy for what is wrong.

    No motor is enabled. The virtual rig is served on a pseudo-terminal, in real time.

    \b
    Example:
      $ scissorcal device doctor --device sim
      scissorcal-sim, serial office-paper, firmware 1, one frame each 1 ms
      ...
    """
    from scissorcal.device.doctor import examine
    from scissorcal.recipe.schema import Line
    from scissorcal.workday.rigs import open_port

    line = Line(baud=baud) if baud else Line()
    with open_port(device, "office-paper", seed, line=line) as link:
        identity = link.identity
        with progress() as tell:
            found = examine(link, seconds, tell)
    text = (
        f"{identity.name}, serial {identity.serial}, firmware {identity.firmware_version}, "
        f"one frame each {identity.tick_us * 1e-3:g} ms\n"
        f"On this computer, as loaded as now: rig.line.brake_after_ms = {found.brake_after_ms:g}"
    )
    result = {"identity": identity._asdict(), "measurements": found.measurements}
    result["brake_after_ms"] = found.brake_after_ms
    return Answer(result, text, found.verdicts)

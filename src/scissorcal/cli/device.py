"""``scissorcal device``"""

from scissorcal.cli.lazy import group
from scissorcal.cli.output import Answer, command

_COMMANDS = {
    "list": ("scissorcal.cli.device:list_", "The serial ports of this machine."),
    "doctor": ("scissorcal.cli.doctor:doctor", "Measure port, timer and scheduler; name remedies."),
    "probe": ("scissorcal.cli.probe:probe", "Check a rig before its motors run."),
    "simulate": ("scissorcal.cli.simulate:simulate", "Serve a virtual rig on a pseudo-terminal."),
}


@group(_COMMANDS)
def device() -> None:
    """Find, check or simulate a rig.

    \b
    Example:
      $ scissorcal device list
      /dev/ttyS0
      sim (a virtual rig; every --device takes it)
    """


@command
def list_() -> Answer:
    """List the serial ports of this machine.

    \b
    Example:
      $ scissorcal device list
      /dev/ttyS0
      sim (a virtual rig; every --device takes it)
    """
    from scissorcal.device.ports import known_ports

    ports = known_ports()
    lines = [*(ports or ["no serial port"]), "sim (a virtual rig; every --device takes it)"]
    return Answer({"ports": ports}, "\n".join(lines))

"""The servo's own process: runs the C loop on descriptors that its parent passed on.

``python -m scissorcal.device.servo_main LINE_FD BLOCK_FD``. It ends when the block asks for it,
when the device goes away, when its stdin ends (because the parent died, however that came about),
or when the parent's heartbeat stops; the exit code is 0 then, and the reason stands in the block.
"""

import gc
import os
import signal
import sys
import threading
from contextlib import suppress

from scissorcal.kernel import LoopBlock, run_loop

PRIORITY = 10
"""Under SCHED_FIFO, where that is allowed: above all that is not real-time, below drivers."""


def main(arguments: list[str]) -> int:
    """Run the loop; returns the exit code."""
    line, memory = (int(argument) for argument in arguments)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides, and asks for a stop
    block = LoopBlock.attach(memory)
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    threading.Thread(target=_stop_with_parent, args=(block,), daemon=True).start()
    gc.freeze()
    run_loop(line, block)
    return 0


def _stop_with_parent(block: LoopBlock) -> None:
    """Wait for the end of the pipe that the parent holds, then let the loop release the motors."""
    while os.read(sys.stdin.fileno(), 1):
        pass
    block.stop()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

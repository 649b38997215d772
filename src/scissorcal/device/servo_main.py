"""The servo process: runs the C loop on file descriptors that its parent passed.

``python -m scissorcal.device.servo_main LINE_FD BLOCK_FD``. It ends when the block asks for it,
when the device goes away, when its stdin ends (the parent died),
or when the parent's heartbeat stops; the exit code is 0 then, and the block has the reason.
"""

import gc
import os
import signal
import sys
import threading

from scissorcal.kernel import LoopBlock, ask_for_slice, lock_memory, run_loop

SLICE_US = 100
PRIORITY = 10
"""Under SCHED_FIFO, where that is allowed: above all that is not real-time, below drivers."""


def main(arguments: list[str]) -> int:
    """Run the loop; returns the exit code."""
    line, memory = (int(argument) for argument in arguments)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent requests the stop
    block = LoopBlock.attach(memory)
    threading.Thread(target=_stop_with_parent, args=(block,), daemon=True).start()
    gc.freeze()
    block.rights = (_ask_for_priority(), lock_memory())  # whether granted is stated in each run
    run_loop(line, block)
    return 0


def _ask_for_priority() -> bool:
    """Ask for real-time priority, for a short time slice where it is refused; which it was."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except (OSError, AttributeError):
        ask_for_slice(SLICE_US)
        return False
    return True


def _stop_with_parent(block: LoopBlock) -> None:
    """Wait for the end of the pipe that the parent holds, then make the loop release the motors."""
    while os.read(sys.stdin.fileno(), 1):
        pass
    block.stop()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

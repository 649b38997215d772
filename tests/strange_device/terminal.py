"""A strange device on a pseudo-terminal, in real time, served by a thread."""

import os
import select
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager

from .device import StrangeDevice


@contextmanager
def serve_on_pty(device: StrangeDevice) -> Iterator[str]:
    """Serve a device until the context ends; yields the path of its port."""
    host, own = os.openpty()
    tty.setraw(host)
    tty.setraw(own)
    os.set_blocking(host, False)
    over = threading.Event()

    def run() -> None:
        due = time.monotonic()
        while not over.is_set() and not device.unplugged:
            due += device.tick_s
            received = b""
            while (left := due - time.monotonic()) > 0:
                if select.select([host], [], [], left)[0]:
                    received += os.read(host, 4096)
            sent = device.tick(received)
            if sent:
                try:
                    os.write(host, sent)
                except BlockingIOError:  # nobody reads: a full buffer loses frames
                    continue

    thread = threading.Thread(target=run, name="strange-device", daemon=True)
    thread.start()
    try:
        yield os.ttyname(own)
    finally:
        over.set()
        thread.join()
        os.close(host)
        os.close(own)

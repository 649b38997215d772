"""One page that watches: what is sent to it, in a bounded queue, so that it delays nobody."""

import asyncio
import contextlib
import json
from collections import deque
from collections.abc import Mapping
from typing import Any

from aiohttp import WSCloseCode, web

from scissorcal.errors import InputError
from scissorcal.foreign import parse_json

MOST_WAITING = 20
"""Messages of samples: half a second of them."""
MOST_REFUSALS = 5
SEND_TIMEOUT_s = 20.0
"""A page that takes nothing for so long is given up; it connects again when it is back."""
LAST_WORDS_s = 0.5
ALLOWED_A_s, ALLOWED_AT_ONCE = 10.0, 20.0
"""Messages that a page may send."""


class Watcher:
    """What waits to be sent to one page.

    Only the newest state waits, and at most `MOST_WAITING` messages of samples: of a page that is
    too slow the oldest are left out, and it is told how many samples it lost.
    """

    def __init__(self, socket: web.WebSocketResponse) -> None:
        self._socket = socket
        self._state: str | None = None
        self._samples: deque[dict[str, Any]] = deque()
        self._refusals: deque[str] = deque(maxlen=MOST_REFUSALS)
        self._lost = 0
        self._more = asyncio.Event()
        self._allowed = ALLOWED_AT_ONCE
        self._counted_s = asyncio.get_running_loop().time()

    def tell(self, message: Mapping[str, Any]) -> None:
        """Have a state sent, in the place of one that still waits."""
        self._state = json.dumps(message, allow_nan=False)
        self._more.set()

    def refuse(self, sentence: str) -> None:
        """Have a page told why it does not get what it asked for."""
        self._refusals.append(json.dumps({"kind": "refused", "sentence": sentence}))
        self._more.set()

    def show(self, message: dict[str, Any]) -> None:
        """Have samples sent, or leave out the oldest that still wait."""
        self._samples.append(message)
        while len(self._samples) > MOST_WAITING:
            left_out = self._samples.popleft()
            self._lost += len(left_out["time_s"]) + left_out["lost"]
        self._more.set()

    def may_speak(self) -> bool:
        """Count a message of the page; False where it sent more than it may."""
        now_s = asyncio.get_running_loop().time()
        self._allowed += ALLOWED_A_s * (now_s - self._counted_s)
        self._allowed = min(self._allowed, ALLOWED_AT_ONCE) - 1.0
        self._counted_s = now_s
        return self._allowed >= 0.0

    async def sent(self) -> None:
        """Wait until the newest state was taken to send, not for long."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(LAST_WORDS_s):
                while self._state is not None:
                    await asyncio.sleep(0.01)

    async def send_all(self) -> None:
        """Send what waits, for ever; closes the socket of a page that takes nothing."""
        try:
            while True:
                await self._more.wait()
                self._more.clear()
                while (text := self._next()) is not None:
                    await asyncio.wait_for(self._socket.send_str(text), SEND_TIMEOUT_s)
        except (TimeoutError, ConnectionError):
            await self._socket.close(code=WSCloseCode.GOING_AWAY, drain=False)

    def _next(self) -> str | None:
        """Refusals and states before samples."""
        if self._refusals:
            return self._refusals.popleft()
        if self._state is not None:
            text, self._state = self._state, None
            return text
        if self._samples:
            message = self._samples.popleft()
            message = {**message, "lost": message["lost"] + self._lost}
            self._lost = 0
            return json.dumps(message, allow_nan=False)
        return None


def request_in(text: str) -> tuple[str, str, int]:
    """What a page asks for: "arm", "start" or "stop", the command, and the question it answers.

    >>> request_in('{"do": "arm", "command": "render"}')
    ('arm', 'render', 0)

    InputError where it is none of these.
    """
    known = 'A message is an object with "do": arm, start or stop, "command" and "question".'
    asked = parse_json(text, "The page's message", known)
    if not isinstance(asked, dict):
        raise InputError(known)
    do, command = asked.get("do"), asked.get("command", "")
    question = asked.get("question", 0)
    if do not in ("arm", "start", "stop") or not isinstance(command, str):
        raise InputError(known)
    if type(question) is not int:
        raise InputError(known)
    return do, command, question

"""A person at a random rig: does what a sentence asks, as far as it follows."""

from .link import RigLink

PLACES = {"close the blades": 0.0, "open the blades": 1.0, "half open": 0.5}
"""Share of the way from the closed to the open stop that a sentence asks for."""


class Person:
    """A confirm callback. ``follows`` False does nothing; ``swaps`` opens at first where asked to
    close, and does it right when asked again; ``clings`` holds the blades at their open stop where
    asked to leave them half open."""

    def __init__(
        self, link: RigLink, *, follows: bool = True, swaps: bool = False, clings: bool = False
    ) -> None:
        self._link, self._follows, self._swaps, self._clings = link, follows, swaps, clings
        self.heard: list[str] = []

    def __call__(self, request: str) -> None:
        self.heard.append(request)
        said = request.lower()
        asked = [share for words, share in PLACES.items() if words in said]
        if not asked or not self._follows:
            return
        share = 1.0 if self._clings and asked[-1] == 0.5 else asked[-1]
        if self._swaps and share != 0.5:
            share = 1.0 - share
            self._swaps = share == 1.0
        self._link.move_by_hand(share)

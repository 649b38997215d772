"""The private key of a command that signs, and its passphrase."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.output import is_interactive
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.package.review import KeySignature

SigningKey = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Private Ed25519 key of OpenSSH that signs too: others can check who did.",
    ),
]


def signer_of(key: Path | None) -> "Callable[[str], KeySignature] | None":
    """What signs with a private key, None without one; raises as `keys.signer`."""
    if key is None:
        return None
    from scissorcal.package.keys import signer

    return signer(key, passphrase)


def passphrase() -> str:
    """Ask for a key's passphrase; InputError where nobody is there to be asked."""
    if not is_interactive():
        raise InputError(
            "The key has a passphrase, and nobody is there to be asked for it: sign in a terminal, "
            "or use a key without one."
        )
    return str(typer.prompt("Passphrase of the key", hide_input=True, err=True))

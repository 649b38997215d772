"""Ed25519 keys, as OpenSSH keeps them: sign a review or a package, and check such a signature.

'ssh-keygen -t ed25519 -f lab-key' makes a pair. Signing and checking are those of the package
cryptography (RFC 8032), which the extra ``keys`` brings.
"""

import base64
import os
import stat
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError, needs_extra
from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import KEY
from scissorcal.package.review import KeySignature

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

MAKE_KEY = "ssh-keygen -t ed25519 -f lab-key"


def signer(path: Path, passphrase: Callable[[], str] = str) -> Callable[[str], KeySignature]:
    """What signs a text by the private key in a file, read at once: a ``signed_text``.

    ``passphrase`` is asked for where the key is encrypted. Raises InputError where
    it is no such key, is not there, where others may read it, or without cryptography.
    """
    _refuse_without_cryptography("Signing with a key")
    from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

    private = _private_key(path, passphrase)
    public = private.public_key().public_bytes(Encoding.OpenSSH, PublicFormat.OpenSSH).decode()

    def sign(text: str) -> KeySignature:
        signed = private.sign(text.encode())
        return KeySignature(public_key=public, signature=base64.b64encode(signed).decode())

    return sign


def can_check() -> bool:
    """Whether this computer can check a signature: it takes cryptography."""
    return find_spec("cryptography") is not None


def holds(key: KeySignature, text: str) -> bool:
    """Whether the key signed this text."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    blob = base64.b64decode(key.public_key.split()[1])
    # an OpenSSH blob ends with the key's 32 bytes
    public = Ed25519PublicKey.from_public_bytes(blob[-32:])
    try:
        public.verify(base64.b64decode(key.signature), text.encode())
    except InvalidSignature:
        return False
    return True


def read_public_keys(path: Path) -> tuple[str, ...]:
    """Public keys of a file, one a line as in ``lab-key.pub``; comments are left out.

    Raises InputError where it is not there, a line is no Ed25519 key, or without cryptography: who
    names keys wants signatures checked.
    """
    _refuse_without_cryptography("Checking a signature")
    found = []
    lines = read_foreign(path, KEY).decode("utf-8", "replace").splitlines()
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            key = " ".join(words[:2])
            KeySignature(public_key=key, signature="A" * 86 + "==")
        except ValueError:
            raise InputError(
                f"{path}, line {number} is not an Ed25519 public key (ssh-ed25519 AAAA...): give "
                f"the file that ends in .pub; '{MAKE_KEY}' makes a pair."
            ) from None
        found.append(key)
    if not found:
        raise InputError(f"{path} holds no public key: give the file that ends in .pub.")
    return tuple(found)


def _refuse_without_cryptography(what: str) -> None:
    if not can_check():
        raise needs_extra(what, "cryptography", "keys")


def _private_key(path: Path, passphrase: Callable[[], str]) -> "Ed25519PrivateKey":
    from cryptography.exceptions import UnsupportedAlgorithm
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
    from cryptography.hazmat.primitives.serialization import load_ssh_private_key

    data = read_foreign(path, KEY)
    if data.startswith((b"ssh-", b"ecdsa-")):
        raise InputError(
            f"{path} is a public key, which signs nothing: name the private one, the file of the "
            "same name without .pub."
        )
    if os.name == "posix" and path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(
            f"Others may read the private key {path}: run 'chmod 600 {path}', and make a new key "
            "if others were able to."
        )
    wrong = f"{path} is not an Ed25519 private key of OpenSSH: '{MAKE_KEY}' makes a pair."
    try:
        try:
            key = load_ssh_private_key(data, None)
        except (TypeError, ValueError) as error:
            if "password" not in str(error).lower():
                raise
            key = load_ssh_private_key(data, passphrase().encode())
    except UnsupportedAlgorithm as error:
        raise InputError(f"{path} cannot be used ({error}). {wrong}") from None
    except (TypeError, ValueError) as error:
        if "BEGIN OPENSSH PRIVATE KEY" in data.decode("utf-8", "replace"):
            wrong = f"{path} cannot be opened: the passphrase is wrong, or the file is damaged."
        raise InputError(wrong) from error
    if not isinstance(key, Ed25519PrivateKey):
        raise InputError(wrong)
    return key

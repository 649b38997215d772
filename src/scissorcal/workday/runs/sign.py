"""Sign a workspace's report, and give the signature that stands."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.errors import InputError, MissingError
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import PAGE
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import available

if TYPE_CHECKING:
    from scissorcal.package import Review

Decision = Literal["accept", "reject"]


def sign_report(
    engine: Engine,
    name: str,
    decision: Decision,
    note: str = "",
    *,
    key: Path | None = None,
    passphrase: Callable[[], str] = str,
) -> "Review":
    """Write report/signature.json: who decided what on the report, and all that it rests on.

    ``key`` is a private Ed25519 key that signs it, too; ``passphrase`` is asked for where that is
    encrypted. The page takes the signature first: where that fails, nothing is signed. Raises
    MissingError where there is no report or it is stale, InputError where the name is empty, the
    page was changed or cannot take the signature, the key is none, or a file cannot be written.
    """
    from pydantic import ValidationError

    from scissorcal.package import Review, stamp
    from scissorcal.workday.reviewed import reviewed_content

    state = engine.state("report")
    if state.state == "missing":
        raise MissingError("There is no report to sign yet: run 'scissorcal report' and read it.")
    if state.state != "done":
        raise MissingError(
            f"{engine.file('report')} is {state.state}, so it was not signed: {state.found}. Run "
            "'scissorcal report', read it again, then sign."
        )
    try:
        review = Review.of(
            name=" ".join(name.split()),
            decision=decision,
            note=note.strip(),
            time_utc=stamp(datetime.now(UTC)),
            content=reviewed_content(engine),
            fit_hashes={what: engine.facts(f"fit {what}")["inputs"] for what in available(engine)},
        )
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(f"The {place} cannot be signed with: {first['msg']}.") from None
    if key is not None:
        from scissorcal.package.keys import signer

        signed = signer(key, passphrase)(review.signed_text)
        review = review.model_copy(update={"key": signed})
    _write(engine.file("report sign"), engine.workspace.report_html, review)
    engine.refresh()
    return review


def standing_review(engine: Engine) -> "Review | None":
    """The signature under the workspace's report, None where there is none or it is void."""
    from scissorcal.package import Review

    found = engine.review()
    return None if found is None else Review.model_validate(found)


def _write(path: Path, html: Path, review: "Review") -> None:
    """Sign the page and write the signature, or leave both as they were."""
    from scissorcal.report import sign_page

    before = read_foreign(html, PAGE)
    try:
        with replacing(path) as part:
            part.write_text(review.model_dump_json(indent=2) + "\n", encoding="utf-8")
            sign_page(html, review)
    except OSError as error:
        with replacing(html) as part:
            part.write_bytes(before)
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error

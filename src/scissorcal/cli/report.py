"""``scissorcal report``"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import writes_in
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, is_interactive
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


_COMMANDS = {
    "compare": ("scissorcal.cli.report:compare", "Put two runs side by side."),
    "sign": ("scissorcal.cli.report:sign", "Accept or reject what the report shows."),
}


@group(_COMMANDS, runs_alone=True)
@command
def report(
    anew: Annotated[
        bool, typer.Option("--anew", help="Write it again although it is signed.")
    ] = False,
    folder: Folder = None,
) -> Answer:
    """Write the report: one HTML file that needs no network, and its JSON twin.

    A signed report is left as it is while its fits, recipe and verifications are, unless its page
    is missing. --anew writes it all the same, which voids the signature if report.json changed.

    \b
    Example:
      $ scissorcal report
      report/report.html and report/report.json show 2 fits
      ...
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.report import write_workspace_report
    from scissorcal.workday.runs.sign import standing_review

    with writes_in(folder, "scissorcal report") as workspace:
        engine = Engine.of(workspace)
        written = write_workspace_report(engine, anew=anew)
    review = standing_review(engine)
    shown = written.fits
    names = [workspace.relative(path) for path in (written.html, written.json)]
    text = f"{names[0]} and {names[1]} show {len(shown)} fit{'s' if len(shown) != 1 else ''}"
    files = [written.html, written.json]
    if review:
        text += f"; {review.words}"
    if not written.written:
        files = []
        text += ", so they were left as they are"
    result = {
        "html": written.html,
        "json": written.json,
        "fits": shown,
        "signed": review.model_dump() if review else None,
    }
    return Answer(result, text, written.verdicts, files)


@command
def compare(
    first: Annotated[Path, typer.Argument(help="A workspace, a report.json or a fit (.nc).")],
    second: Annotated[Path, typer.Argument(help="Another of the same kind.")],
    output: Annotated[
        Path,
        typer.Option(file_okay=False, help="Folder for comparison.html and comparison.json."),
    ] = Path("comparison"),
) -> Answer:
    """Put two runs side by side: parameters, verdicts, hold-out errors, rendered torque.

    Each is a workspace, a report.json or a fit (.nc). Runs of another joint, material, scene or
    law are refused.

    \b
    Example:
      $ scissorcal report compare monday friday
      No parameter differs by more than 3 standard deviations. Rendered torque differs by at ...
      ...
      comparison/comparison.html and comparison/comparison.json show it
    """
    from scissorcal.report import panels_text
    from scissorcal.workday.runs.report import compare_runs

    found, files = compare_runs(first, second, output)
    shown = [panel for panel in found.panels if panel.id.endswith("-parameters")]
    for panel in found.panels:
        if panel.id == "verdicts-all":
            changed = tuple(row for row in panel.rows if row.marked)
            shown.append(replace(panel, rows=changed))
    text = f"{found.sentence}\n\n{panels_text(shown)}\n\n{files.html} and {files.json} show it"
    result = {
        "first": found.first,
        "second": found.second,
        "sentence": found.sentence,
        "panels": [
            {"id": panel.id, "title": panel.title, "sentence": panel.sentence, "rows": panel.rows}
            for panel in found.panels
        ],
        "html": files.html,
        "json": files.json,
    }
    return Answer(result, text, files=[files.html, files.json])


@command
def sign(
    name: Annotated[str, typer.Option(help="Who reviewed the report.")],
    decision: Annotated[
        Literal["accept", "reject"], typer.Option(help="Whether the report is accepted.")
    ],
    note: Annotated[
        str, typer.Option(help="Why, or under which condition.", show_default=False)
    ] = "",
    key: SigningKey = None,
    folder: Folder = None,
) -> Answer:
    """Sign the report that lies in the workspace: report/signature.json.

    The signature covers the page, report.json and all that they rest on: recipe, fits,
    verifications, recordings, photographs. It is void once one of them changes, and 'plan' says
    which. The next package carries it, and rendering warns without it. Who wrote a name is shown by
    a key alone; 'ssh-keygen -t ed25519 -f lab-key' makes one.

    \b
    Example:
      $ scissorcal report sign --name "A. Lovelace" --decision accept --note "edge was reground"
      report/signature.json: accepted by A. Lovelace on 2025-01-31: edge was reground
      ...
      next: scissorcal package build
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.sign import sign_report

    with writes_in(folder, "scissorcal report sign") as workspace:
        engine = Engine.of(workspace)
        review = sign_report(engine, name, decision, note, key=key, passphrase=passphrase)
    path = workspace.signature_path
    text = (
        f"{workspace.relative(path)}: {review.words}\n"
        f"it covers {len(review.content)} files, digest {review.digest[:16]}; "
        f"{review.identity_words}"
    )
    unverified = [state.name for state in engine.states() if state.state == "unverified"]
    if unverified:
        text += (
            f"\nnote: it covers {' and '.join(unverified)} as unverified. A verification that is "
            "made later is not covered: run 'scissorcal verify', 'scissorcal report', then sign"
        )
    return Answer(review.model_dump(), text, files=[path])

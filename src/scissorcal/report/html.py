"""The page: panels as one HTML file that needs nothing from outside, and no script to be read."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib import resources
from typing import TYPE_CHECKING

from scissorcal.identity import bytes_digest
from scissorcal.report.numbers import short, unit_text
from scissorcal.report.panel import Chart, Panel, Picture, Row, columns, limit_text
from scissorcal.report.pictures import PAGE_BYTES, PICTURE_BYTES, Image, place_pictures
from scissorcal.report.signature_block import SIGNATURE, signature_block
from scissorcal.report.svg import svg
from scissorcal.verdicts import Verdict

if TYPE_CHECKING:
    from datetime import datetime
    from pathlib import Path

    from scissorcal.report.document import ReportDocument
    from scissorcal.report.inputs import Geometry

OUTCOMES = {"pass": "✓ pass", "fail": "✗ fail", "not_evaluated": "– not evaluated"}
LONG_TABLE = 8
PRINTED = frozenset({
    "torque", "law", "response", "edge", "parameters", "verify",
})  # fmt: skip
"""Panels that are printed in full beside the decision page, by their address in their part."""
DECISIONS = {
    "✓ trust": "pass",
    "? not verified": "not_evaluated",
    "✓ checks passed": "pass",
    "! use with care": "not_evaluated",
    "✗ do not use": "fail",
}
"""Texts that are set as badges, and how those look."""


def report_page(document: ReportDocument, geometry: Geometry) -> str:
    """Write the page with as many pictures as it can carry and stay below `PAGE_BYTES`."""
    page = _report(document)
    shown = [(panel.part, picture) for panel in document.panels for picture in panel.pictures]
    files: dict[str, list[tuple[Path, int]]] = {}
    for part, picture in shown:
        found = next(path for path in _paths(geometry, part) if path.name == picture.file)
        files.setdefault(part, []).append((found, picture.widest_px))
    # the words around pictures take room too: some hundred bytes each
    room = min(PAGE_BYTES - len(page.encode()) - 1000 * len(shown), PICTURE_BYTES)
    images = {part: iter(own) for part, own in place_pictures(files, room).items()}
    for part, picture in shown:
        page = page.replace(_place(part, picture), _photo(picture, next(images[part])), 1)
    return page


def _paths(geometry: Geometry, part: str) -> Sequence[Path]:
    """The pictures of a part; the decision page shows those of any."""
    pictures: Mapping[str, Sequence[Path]] = {str(k): own for k, own in geometry.pictures.items()}
    every = tuple(path for own in pictures.values() for path in own)
    return every if part == "decision" else pictures.get(part, ())


def panels_page(
    kicker: str,
    heading: str,
    panels: Sequence[Panel],
    *,
    made: tuple[datetime, str],
    facts: Mapping[str, str] | None = None,
    findings: Sequence[str] = (),
) -> str:
    """The offline page of panels without parts: ``facts`` and ``findings`` above, panels open.

    ``made`` is when, with its time zone, and by which version.
    """
    when, version = made
    listed = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in (facts or {}).items()
    )
    said = "".join(f'<p class="finding">{prose(finding)}</p>' for finding in findings)
    body = (
        f'<main><section id="decision" class="plain"><p class="kicker">{escape(kicker)}</p>'
        f"<h1>{prose(heading)}</h1>{f'<dl>{listed}</dl>' if listed else ''}{said}"
        f"{_made_line(when.strftime('%Y-%m-%d %H:%M %Z'), version)}</section>"
        f"{parts_nav([(panel.id, panel.title) for panel in panels])}"
    )
    for panel in panels:
        above = panel.sentence if panel.sentence in findings else ""
        body += panel_section(panel, open_=True, above=above)
    return whole_page(f"{heading}: {kicker}", body + "</main>")


def prose(sentence: str) -> str:
    """Escape a sentence; what stands between backticks becomes code."""
    parts = sentence.split("`")
    if len(parts) % 2 == 0:
        return escape(sentence)
    return "".join(
        f"<code>{escape(part)}</code>" if place % 2 else escape(part)
        for place, part in enumerate(parts)
    )


def _report(document: ReportDocument) -> str:
    body = ['<main id="report">', _decision(document)]
    body.append(parts_nav([(part.id, part.title.partition(":")[0]) for part in document.parts]))
    for part in document.parts:
        panels = document.panels_of(part.id)
        sentence = f"<p>{prose(part.sentence)}</p>" if part.sentence else ""
        inner = "".join(
            panel_section(
                panel,
                open_=len(panels) < 3,
                above=part.sentence,
                whole=len(panels) == 1 and panel.sentence in {"", part.sentence},
            )
            for panel in panels
        )
        if part.id == "provenance":
            inner += _recipe(document)
        body.append(
            f'<section id="{escape(part.id)}" aria-label="{escape(part.title)}">'
            f'<details class="part"><summary><h2>{prose(part.title)}</h2>{sentence}</summary>'
            f"{inner}</details></section>"
        )
    return whole_page(f"{document.recipe_name}: calibration report", "".join(body) + "</main>")


def whole_page(title: str, body: str) -> str:
    """A page of this body, with styles, script and a policy that loads nothing from outside."""
    script = _asset("script.js")
    digest = base64.b64encode(bytes.fromhex(bytes_digest(script.encode()))).decode()
    policy = (
        "default-src 'none'; style-src 'unsafe-inline'; img-src data:; "
        f"script-src 'sha256-{digest}'"
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f"<title>{escape(title)}</title>\n<style>\n{_asset('style.css')}</style>\n</head>\n<body>\n"
        f'<a class="skip" href="#decision">Skip to the decision</a>\n{body}\n'
        f"<script>{script}</script>\n</body>\n</html>\n"
    )


def _asset(name: str) -> str:
    return resources.files("scissorcal.report").joinpath("assets", name).read_text("utf-8")


def _made_line(when: str, version: str) -> str:
    """When and by which version a page was made."""
    return f'<p class="meta">Made {escape(when)} by scissorcal {escape(version)}</p>'


def _decision(document: ReportDocument) -> str:
    """The decision page: one screen, one printed page."""
    origin, *others = document.panels_of("decision")
    lead = ". ".join(part for part in (document.material, document.recipe_description) if part)
    made = _made_line(document.created.strftime("%Y-%m-%d %H:%M %Z"), document.scissorcal_version)
    cards = "".join(
        _overview(panel) if panel.id == "decision-picture" else _card(panel) for panel in others
    )
    return (
        f'<section id="decision" aria-labelledby="report-title"><header><div>'
        f'<p class="kicker">Calibration report</p><h1 id="report-title">'
        f'{escape(document.recipe_name)}</h1><p class="lead">{escape(lead)}</p>{made}</div>'
        f'<div id="{origin.id}" class="origin {document.origin}"><p class="large">'
        f"{escape(origin.title)}</p><p>{prose(origin.sentence)}</p></div></header>"
        f'<div class="cards">{cards}<article class="card" id="decision-signature">'
        f"{SIGNATURE[0]}{signature_block(None)}{SIGNATURE[1]}</article></div></section>"
    )


def _overview(panel: Panel) -> str:
    """The picture of the decision page; nothing where a report has none to show."""
    pictures = "".join(_place(panel.part, picture) for picture in panel.pictures)
    figures = "".join(_figure(chart) for chart in panel.charts) + pictures
    return f'<div class="overview" id="{panel.id}">{figures}</div>' if figures else ""


def _card(panel: Panel) -> str:
    """One block of the decision page: a title, a sentence, few rows."""
    rows = "".join(
        "<tr>"
        + f'<th scope="row">{_linked(row)}</th>'
        + "".join(f"<td>{_cell(row, name, unit)}</td>" for name, unit in columns(panel.rows))
        + "</tr>"
        for row in panel.rows
    )
    heads = "".join(
        f'<th scope="col">{escape(_heading(name, unit))}</th>' for name, unit in columns(panel.rows)
    )
    table = f"<table><thead><tr><th></th>{heads}</tr></thead><tbody>{rows}</tbody></table>"
    sentence = f'<p class="sentence">{prose(panel.sentence)}</p>' if panel.sentence else ""
    return (
        f'<article class="card" id="{panel.id}"><h2>{escape(panel.title)}</h2>{sentence}'
        f"{_charts(panel.charts)}{table if rows else ''}{_notes(panel.notes)}</article>"
    )


def parts_nav(parts: Sequence[tuple[str, str]]) -> str:
    """Links to the parts; search, which the script shows."""
    links = "".join(f'<li><a href="#{escape(i)}">{escape(title)}</a></li>' for i, title in parts)
    return (
        f'<nav aria-label="Parts of this report"><ul>{links}</ul><p class="tools" hidden><label>'
        'Search <input type="search" id="search"></label><button type="button" id="open-all">'
        'Open all</button><span id="found" role="status"></span></p></nav>'
    )


def panel_section(panel: Panel, *, open_: bool, above: str = "", whole: bool = False) -> str:
    """A panel that opens on demand; ``whole`` says that it is all of its part.

    Its sentence is left out where it stands ``above`` already.
    """
    sentence = f'<p class="finding">{prose(panel.sentence)}</p>'
    if panel.sentence in {"", above}:
        sentence = ""
    head = f"<h3>{escape(panel.title)}</h3>"
    body = _notes(panel.notes) + _charts(panel.charts)
    if panel.rows:
        body += _table(panel)
    if panel.verdicts:
        body += _verdicts(panel.verdicts)
    if panel.pictures:
        body += (
            f'<div class="photos">{"".join(_place(panel.part, p) for p in panel.pictures)}</div>'
        )
    if whole:
        return f'<div class="panel" id="{escape(panel.id)}">{body}</div>'
    if not body:
        return f'<div class="panel" id="{escape(panel.id)}">{head}{sentence}</div>'
    return (
        f'<details class="panel" id="{escape(panel.id)}"{_printed(panel)}'
        f"{' open' if open_ else ''}><summary>{head}"
        f"{sentence}</summary>{body}</details>"
    )


def _printed(panel: Panel) -> str:
    """Marks a panel that is opened for printing; of the others the sentence is printed."""
    return " data-print" if panel.id.removeprefix(f"{panel.part}-") in PRINTED else ""


def _notes(notes: Iterable[str]) -> str:
    return "".join(f'<p class="note">{prose(note)}</p>' for note in notes)


def _charts(charts: Sequence[Chart]) -> str:
    large = [_figure(chart) for chart in charts if not chart.small]
    small = [_figure(chart) for chart in charts if chart.small]
    return "".join(
        f'<div class="{name}">{"".join(own)}</div>'
        for name, own in (("figures", large), ("small figures", small))
        if own
    )


def _figure(chart: Chart) -> str:
    caption = f"<figcaption>{prose(chart.caption)}</figcaption>" if chart.caption else ""
    units = f'data-xlabel="{escape(_axis(chart, "x"))}" data-ylabel="{escape(_axis(chart, "y"))}"'
    return (
        f'<figure id="{escape(chart.id)}" tabindex="0" {units}>'
        f'<p class="title">{escape(chart.title)}</p>{svg(chart)}{_key(chart)}{caption}</figure>'
    )


def _axis(chart: Chart, which: str) -> str:
    axis = chart.x if which == "x" else chart.y
    return f"{axis.label}|{unit_text(axis.unit)}"


def _key(chart: Chart) -> str:
    """The key to a chart; what may be switched becomes a button once there is a script."""
    entries: dict[str, str] = {}
    for number, one in enumerate(chart.series):
        word = one.name.partition(",")[0] if not one.toggle or "stroke" in one.name else one.name
        if not word or word in entries or (chart.small and not _keyed(chart)):
            continue
        group = f' data-group="{escape(one.group or str(number))}"' if one.toggle else ""
        fixed = "" if one.toggle else "~"  # those that are switched stand first
        entries[word] = fixed + (
            f'<li class="{one.kind} {one.look} {one.style}"{group} title="{escape(one.name)}">'
            f"{escape(word)}</li>"
        )
    listed = sorted(entries.values(), key=lambda entry: entry.startswith("~"))
    items = "".join(entry.removeprefix("~") for entry in listed)
    return f'<ul class="key">{items}</ul>' if len(entries) > 1 else ""


def _keyed(chart: Chart) -> bool:
    """Whether a small chart has a key; cards of strokes do without, as all show the same."""
    return "-prior-" in chart.id or chart.id.startswith("decision-")


def _table(panel: Panel) -> str:
    heads = columns(panel.rows)
    numeric = {name: not any(_worded(row, name) for row in panel.rows) for name, _ in heads}
    head = "".join(
        f'<th scope="col"{_num(numeric[name])}>{escape(_heading(name, unit))}</th>'
        for name, unit in heads
    )
    body = "".join(_table_row(row, heads, numeric) for row in panel.rows)
    caption = f"<caption>{prose(panel.caption)}</caption>" if panel.caption else ""
    table = f"<table>{caption}<thead><tr><th></th>{head}</tr></thead><tbody>{body}</tbody></table>"
    css = "scroll long" if len(panel.rows) > LONG_TABLE else "scroll"
    label = escape(f"{panel.title}, table")
    return f'<div class="{css}" role="region" tabindex="0" aria-label="{label}">{table}</div>'


def _table_row(row: Row, heads: Sequence[tuple[str, str]], numeric: Mapping[str, bool]) -> str:
    flag = '<span class="flag" role="img" aria-label="stands out">▸</span> ' if row.marked else ""
    address = f' id="{escape(row.anchor)}" tabindex="0"' if row.anchor else ""
    cells = "".join(
        f"<td{_num(numeric[name])}>{_cell(row, name, unit)}</td>" for name, unit in heads
    )
    css = ' class="odd"' if row.marked else ""
    html = f'<tr{css}{address}><th scope="row">{flag}{_linked(row)}</th>{cells}</tr>'
    if row.note:
        html += f'<tr><td colspan="{len(heads) + 1}" class="why">{prose(row.note)}</td></tr>'
    return html


def _heading(name: str, unit: str) -> str:
    return f"{name} [{unit_text(unit)}]" if unit else name


def _num(numeric: bool) -> str:
    return ' class="num"' if numeric else ""


def _worded(row: Row, name: str) -> bool:
    value = row.value(name)
    return value is not None and value.text not in {"", "–"}


def _linked(row: Row) -> str:
    name = escape(row.name)
    return f'<a href="#{escape(row.link)}">{name}</a>' if row.link else name


def _cell(row: Row, name: str, unit: str) -> str:
    value = row.value(name)
    if value is None:
        return ""
    if value.text in DECISIONS:
        return f'<span class="badge {DECISIONS[value.text]}">{escape(value.text)}</span>'
    own = f" {escape(unit_text(value.unit))}" if value.unit and not unit and not value.text else ""
    return prose(str(value)) + own


def _verdicts(verdicts: Sequence[Verdict]) -> str:
    rows = "".join(
        f'<tr><td><span class="badge {v.status}">{OUTCOMES[v.status]}</span></td>'
        f'<th scope="row">{escape(v.check)} <span class="scope">{escape(v.scope)}</span></th>'
        f'<td class="num">{"" if v.value is None else escape(short(v.value))}</td>'
        f'<td class="limit">{escape(limit_text(v))}</td><td class="why">{prose(v.why)}'
        + (f' <span class="scope">Guards {escape(v.guards)}.</span>' if v.guards else "")
        + "</td></tr>"
        for v in verdicts
    )
    return (
        '<div class="scroll" role="region" tabindex="0" aria-label="Verdicts">'
        '<table class="verdicts"><thead><tr><th scope="col">Outcome</th><th scope="col">Check</th>'
        '<th scope="col" class="num">Value</th><th scope="col">Limit</th><th scope="col">Why</th>'
        f"</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _place(part: str, picture: Picture) -> str:
    """Where a picture goes, once it is known how many the page can carry."""
    return f"<!--picture {escape(part)} {escape(picture.file)}-->"


def _photo(picture: Picture, image: Image) -> str:
    shown = (
        f'<img src="{image.data}" width="{image.width}" height="{image.height}" '
        f'alt="{escape(picture.alt)}">'
    )
    caption = picture.caption if image.data else image.missing
    return (
        f'<figure class="photo" tabindex="0"><p class="title">{escape(picture.title)}</p>'
        f"{shown if image.data else ''}<figcaption>{prose(caption)}</figcaption></figure>"
    )


def _recipe(document: ReportDocument) -> str:
    provenance = document.provenance
    return (
        f"<h3>Recipe, {escape(provenance.recipe_text_origin)}</h3>"
        '<pre role="region" tabindex="0" aria-label="Text of the recipe">'
        f"{escape(provenance.recipe_text)}</pre>"
    )

"""Write the site of a store: all rigs at a glance, a page a rig, every report. No server."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pendulum_sysid import telling
from pendulum_sysid.fleet.comparison import (
    Comparison,
    compare_rigs,
    describe_comparison,
    list_effects,
)
from pendulum_sysid.fleet.history import (
    PRESENCE,
    History,
    describe_history,
    format_time,
    name_recording,
    read_histories,
)
from pendulum_sysid.fleet.pictures import draw_course
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.telling.output_files import check_folder, write_bytes, write_text

NEWEST_SHOWN = 200  # recordings of a rig in its table; all are counted
CSS = Path(telling.__file__).parent / "templates" / "report.css"


@dataclass(frozen=True)
class RigLine:
    """Hold one rig of the first page: its page, its counts, and whether it needs a look.

    state: "unlike itself", "no answers", "changed", "unlike the others", or "quiet": the first
        that is so.
    """

    name: str
    file: str
    recordings: int
    unanswered: int
    newest: str
    effects: list[str]
    changes: int
    state: str


def write_site(store: Store, folder: Path) -> list[Path]:
    """Write the site and return its first page and the pages of the rigs."""
    check_folder(folder)
    histories = read_histories(store)
    comparison = compare_rigs(histories)
    unlike = {u.rig for u in comparison.unlike}
    lines = [_describe_rig(history, history.rig in unlike) for history in histories]
    pages = [folder / "index.html"]
    first = _render(
        "index.html.j2",
        store=store.address,
        lines=sorted(lines, key=lambda line: (line.state == "quiet", line.name)),
        sentences=describe_comparison(comparison),
        changed=sum(line.state != "quiet" for line in lines),
        recordings=sum(line.recordings + line.unanswered for line in lines),
    )
    write_text(pages[0], first)
    for history, line in zip(histories, lines, strict=True):
        page = folder / line.file
        write_text(page, _render_rig(store, history, line, comparison, folder))
        pages.append(page)
    return pages


def _describe_rig(history: History, is_unlike: bool) -> RigLine:
    changes = len(history.changes) + len(history.drifts)
    state = "quiet"
    if history.ends_strange:
        state = "unlike itself"
    elif history.recordings.empty:
        state = "no answers"
    elif changes:
        state = "changed"
    elif is_unlike:
        state = "unlike the others"
    both = (history.recordings, history.unanswered)
    newest = max(frame["time"].max() for frame in both if len(frame))
    return RigLine(
        history.rig,
        f"rig_{quote(history.rig, safe='')}.html".replace("%", "_"),
        len(history.recordings),
        len(history.unanswered),
        format_time(newest),
        list_effects(history),
        changes,
        state,
    )


def _render_rig(
    store: Store, history: History, line: RigLine, comparison: Comparison, folder: Path
) -> str:
    sizes = [
        {
            "name": size.owner if size.parameter == PRESENCE else size.name,
            "is_presence": size.parameter == PRESENCE,
            "size": size,
            "picture": draw_course(size, f"size{k}") if len(size.rows) > 1 else "",
            "family": _find_borrowed(comparison, history.rig, size.name),
        }
        for k, size in enumerate(history.sizes)
    ]
    recordings = [
        {
            "name": name_recording(row.path),
            "time": format_time(row.time),
            "outcome": row.outcome,
            "sentence": row.sentence,
            "report": _copy_report(store, row, f"{Path(line.file).stem}_", folder),
        }
        for frame in (history.unanswered, history.recordings.iloc[::-1])
        for row in frame.head(NEWEST_SHOWN).itertuples()
    ]
    return _render(
        "rig.html.j2",
        line=line,
        sentences=describe_history(history),
        sizes=sizes,
        recordings=recordings,
        left_out=history.left_out,
        shown=NEWEST_SHOWN,
    )


def _find_borrowed(comparison: Comparison, rig: str, size: str) -> Any:
    """Return the size as the rig has it together with its siblings; None without siblings."""
    members = comparison.members.get(size, ())
    if rig not in members:
        return None
    return comparison.families[size].rigs[members.index(rig)]


def _copy_report(store: Store, row: Any, prefix: str, folder: Path) -> str:
    """Copy a report out of the store, and return its address on the site; empty for none.

    row: of the recording. The report of a diagnosis that a fit has replaced is left out.
    prefix: of the file's name, of the rig: two rigs may hold the same recording.
    """
    if row.method != "diagnose":
        return ""
    packed = store.place.read(f"{store.name_verdict_folder(row.rig, row.digest)}/report.html.gz")
    if packed is None:
        return ""
    name = f"reports/{prefix}{row.digest.removeprefix('sha256:')[:16]}.html"
    write_bytes(folder / name, gzip.decompress(packed))
    return name


def _render(template: str, **content: Any) -> str:
    page = _make_environment().get_template(template)
    return page.render(css=CSS.read_text(encoding="utf-8"), **content)


@cache
def _make_environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

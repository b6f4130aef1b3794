"""The bench as one HTML page that needs nothing beside itself: the tables, what broke, and pictures of maps.

Must not know: how pictures are drawn.
"""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from sonarlog.bench.results import Results
from sonarlog.bench.tables import Table, broken, condition_lines, legend, tables

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1500px; padding: 0 1rem; color: #1e1e1e }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; font-size: 14px }
th, td { padding: .2rem .7rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
th { border-bottom: 2px solid #888; vertical-align: bottom } .name { text-align: left }
tr.new td { border-top: 2px solid #aaa } .scroll { overflow-x: auto }
img { max-width: 100%; border: 1px solid #ddd } figure { margin: 1.5rem 0 } figcaption { color: #555 }
code { background: #f3f3f3; padding: 0 .2em }
"""


@dataclass(frozen=True)
class Picture:
    """What is shown, and the PNG, or why there is none."""

    title: str
    path: Path | Exception


def page(results: Results, pictures: Sequence[Picture], command: str) -> str:
    """The whole page."""
    parts = ["<h1>sonarlog bench</h1>", f"<p><code>{escape(command)}</code></p>"]
    parts += [_table(table) for table in tables(results)]
    if lines := condition_lines(results):
        items = "".join(f"<li><b>{escape(name)}</b>: {escape(about)}</li>" for name, about in lines)
        parts.append(f"<ul>{items}</ul>")
    parts += [f"<p>{escape(text.replace('*', ''))}</p>" for text in legend()]
    items = "".join(f"<li>{escape(sentence.replace('`', ''))}</li>" for sentence in broken(results))
    parts.append(f"<h2>Where it breaks</h2><ul>{items}</ul>" if items else "<p>No run was worse than raw odometry.</p>")
    if pictures:
        parts.append("<h2>Maps</h2>")
    parts += [_figure(picture) for picture in pictures]
    body = "\n".join(parts)
    head = f'<meta charset="utf-8"><title>sonarlog bench</title><style>{STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def _table(table: Table) -> str:
    def cells(row: Sequence[str], tag: str) -> str:
        return "".join(
            f"<{tag}{' class=name' if n < table.names else ''}>{escape(cell)}</{tag}>" for n, cell in enumerate(row)
        )

    rows, last = [], ""
    for row in table.rows:
        rows.append(f"<tr{' class=new' if row[0] != last else ''}>{cells(row, 'td')}</tr>")
        last = row[0]
    head = f"<thead><tr>{cells(table.head, 'th')}</tr></thead>"
    return f"<h2>{escape(table.title)}</h2><div class=scroll><table>{head}<tbody>{''.join(rows)}</tbody></table></div>"


def _figure(picture: Picture) -> str:
    caption = f"<figcaption>{escape(picture.title)}</figcaption>"
    if isinstance(picture.path, Exception):
        return f"<figure>{caption}<p>it could not be drawn: {escape(str(picture.path))}</p></figure>"
    data = base64.b64encode(picture.path.read_bytes()).decode()
    return f'<figure>{caption}<img alt="{escape(picture.title)}" src="data:image/png;base64,{data}"></figure>'

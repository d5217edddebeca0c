"""Small pieces of HTML. All text that is passed in is escaped; what is returned is HTML."""

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from tuning.outputs import names_as_they_are

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 120


def paragraph(text: str) -> str:
    """Plain text."""
    return f"<p>{escape(text)}</p>"


def verdict(text: str) -> str:
    """Plain text that stands out."""
    return f'<p class="verdict">{escape(text)}</p>'


def section(anchor: str, heading: str, content: str) -> str:
    """content: HTML."""
    return f'<section id="{anchor}">\n<h2>{escape(heading)}</h2>\n{content}\n</section>'


def table(caption: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """The first column of a row is its header."""
    head = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in headings)
    body = "\n".join(f'<tr><th scope="row">{escape(first)}</th>{"".join(map(_cell, cells))}</tr>'
                     for first, *cells in rows)  # fmt: skip
    return (f'<div class="wide"><table><caption>{escape(caption)}</caption>\n<thead><tr>{head}</tr></thead>\n'
            f"<tbody>\n{body}\n</tbody></table></div>")  # fmt: skip


def listing(text: str) -> str:
    """Text whose lines and spaces are kept."""
    return f"<pre>{escape(text)}</pre>"


def folded(heading: str, *parts: str) -> str:
    """Shown when it is asked for."""
    return f"<details><summary>{escape(heading)}</summary>\n" + "\n".join(parts) + "\n</details>"


def drawn(figure: "Figure", alt: str, caption: str = "") -> str:
    """A matplotlib figure as an inlined picture."""
    buffer = io.BytesIO()
    with names_as_they_are():
        figure.savefig(buffer, dpi=DPI, format="png")
    return picture(buffer.getvalue(), alt, caption)


def picture(png: bytes, alt: str, caption: str = "") -> str:
    """A PNG file's bytes as an inlined picture. alt: what it shows, for those who do not see it."""
    source = "data:image/png;base64," + base64.b64encode(png).decode("ascii")
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f'<figure><img src="{source}" alt="{escape(alt)}">{below}</figure>'


def _cell(text: str) -> str:
    """Words flush left, figures flush right."""
    kind = ' class="text"' if text[:1].isalpha() else ""
    return f"<td{kind}>{escape(text)}</td>"

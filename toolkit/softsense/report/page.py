"""The page: no request leaves it, it follows dark and light, and it fits a phone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.util import find_spec
from pathlib import Path

from softsense_codegen.atomic import write_bytes, write_text

# Okabe and Ito's palette, told apart with every kind of colour vision; lifted for dark pages.
STYLE = """
:root{color-scheme:light dark;--page:#fff;--ink:#1b1f24;--soft:#5c6570;--line:#d5dae0;
--a:#0072b2;--b:#d55e00;--c:#009e73;--d:#cc79a7;--card:#f6f7f9}
@media(prefers-color-scheme:dark){:root{--page:#14171a;--ink:#e8eaed;--soft:#a0a8b2;--line:#333a42;
--a:#56b4e9;--b:#f0914a;--c:#3fc79a;--d:#e3a5c7;--card:#1d2125}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:62rem;padding:1rem;background:var(--page);color:var(--ink);
font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.5rem;margin:.5rem 0}h2{font-size:1.1rem;margin:1.6rem 0 .4rem}
p.lead{font-size:1.1rem;color:var(--ink)}p,figcaption{color:var(--soft);margin:.3rem 0}
nav{display:flex;flex-wrap:wrap;gap:.3rem 1rem;margin:.6rem 0;font-size:.9rem}a{color:var(--a)}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr));gap:1rem}
figure{margin:0;background:var(--card);border-radius:.5rem;padding:.7rem}
figure.wide{grid-column:1/-1}svg{display:block;width:100%;height:auto}
figcaption{font-size:.88rem}
.table{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;
font-size:.92rem}th,td{padding:.25rem .7rem .25rem 0;text-align:right;border-bottom:1px solid
var(--line)}th:first-child,td:first-child{text-align:left}th{font-weight:600}
pre{overflow-x:auto;background:var(--card);padding:.7rem;border-radius:.5rem;font-size:.8rem}
svg text{font:11px system-ui,sans-serif;fill:var(--soft)}svg text.strong{fill:var(--ink)}
.axis{stroke:var(--line);fill:none}.a{stroke:var(--a)}.b{stroke:var(--b)}.c{stroke:var(--c)}
.d{stroke:var(--d)}.fa{fill:var(--a)}.fb{fill:var(--b)}.fc{fill:var(--c)}.fd{fill:var(--d)}
.thin{fill:none;stroke-width:1.2}.thick{fill:none;stroke-width:2}
"""
# What the page's styles give an SVG, for the copies that stand alone.
ALONE = """<style>text{font:11px system-ui,sans-serif;fill:#5c6570}text.strong{fill:#1b1f24}
.axis{stroke:#d5dae0;fill:none}.a{stroke:#0072b2}.b{stroke:#d55e00}.c{stroke:#009e73}
.d{stroke:#cc79a7}.fa{fill:#0072b2}.fb{fill:#d55e00}.fc{fill:#009e73}.fd{fill:#cc79a7}
.thin{fill:none;stroke-width:1.2}.thick{fill:none;stroke-width:2}</style>"""

# Of the PNG copies, per unit of the SVG.
PIXELS = 2.0


@dataclass(frozen=True)
class Figure:
    """One picture: ``svg`` (an ``<svg>`` element), what it is called, and what to see in it."""

    name: str
    title: str
    caption: str
    svg: str
    wide: bool = False


@dataclass(frozen=True)
class Table:
    """Numbers beside the pictures."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]


def write_page(
    out: Path,
    title: str,
    lead: str,
    figures: Sequence[Figure],
    tables: Sequence[Table],
    code: str = "",
) -> list[Path]:
    """Write ``out``/report.html and one SVG and PNG per figure; returns the paths.

    Every text is escaped: column names come from anybody's files.
    """
    drawn = "".join(
        f'<figure id="{escape(f.name)}"{" class=wide" if f.wide else ""}>'
        f"<h2>{escape(f.title)}</h2>{f.svg}<figcaption>{escape(f.caption)}</figcaption></figure>"
        for f in figures
    )
    told = "".join(_table(number, table) for number, table in enumerate(tables))
    links = "".join(f'<a href="#{escape(f.name)}">{escape(f.title)}</a>' for f in figures)
    links += '<a href="#numbers">numbers</a>'
    shown = f'<h2 id="code">The header</h2><pre>{escape(code)}</pre>' if code else ""
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        '<link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>"
        f'<h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p><nav>{links}</nav>'
        f'<div class="figures">{drawn}</div><div id="numbers">{told}</div>{shown}</body></html>\n'
    )
    paths = [write_text(out / "report.html", page)]
    for figure in figures:
        alone = figure.svg.replace(">", f' xmlns="http://www.w3.org/2000/svg">{ALONE}', 1)
        paths.append(write_text(out / "figures" / f"{figure.name}.svg", alone + "\n"))
        paths.append(write_bytes(out / "figures" / f"{figure.name}.png", _png(alone)))
    return paths


def _png(svg: str) -> bytes:
    """``svg`` in pixels, with the font that matplotlib brings: the same bytes on every machine."""
    import resvg_py

    spec = find_spec("matplotlib")
    assert spec is not None
    assert spec.origin is not None
    font = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / "DejaVuSans.ttf"
    return bytes(
        resvg_py.svg_to_bytes(
            svg_string=svg.replace("system-ui", "DejaVu Sans"),
            background="white",
            zoom=PIXELS,
            skip_system_fonts=True,
            font_files=[str(font)],
        )
    )


def _table(number: int, table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows
    )
    return (
        f'<h2 id="table{number}">{escape(table.title)}</h2><div class="table"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )

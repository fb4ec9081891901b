"""The report in a real browser: no error, every picture drawn, no sideways scrolling."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from softsense.cli.main import main
from softsense.recording import read, write
from softsense.report import Figure, Table, charts, write_page

EVIL = "<script>document.title='broken'</script>"


def page(folder: Path) -> Path:
    rng = np.random.default_rng(0)
    x = np.arange(5000.0)
    y = np.cumsum(rng.normal(size=5000))
    figures = [
        Figure(
            "lines",
            EVIL,
            EVIL,
            charts.lines(x, [charts.Line(y, EVIL)], EVIL, "y / mm", wide=2),
            True,
        ),
        Figure("scatter", "scatter", "caption", charts.scatter(y, y + 1, "true", "estimated")),
        Figure("bars", "bars", "caption", charts.bars(["a", EVIL], [1.0, 2.0], "bit")),
        Figure("hist", "hist", "caption", charts.histogram(rng.normal(size=500), "error")),
        Figure("heat", "heat", "caption", charts.heat([[0, 1], [2, np.nan]], "ab", "cd", "bits")),
    ]
    table = Table(EVIL, ("name", "value"), [(EVIL, "1")])
    return write_page(folder, EVIL, EVIL, figures, [table], code=EVIL)[0]


def look(browser, path: Path, figures: int) -> None:
    """On a phone and on a desk: no complaint, every figure drawn, every link leads somewhere."""
    for width in (360, 1200):
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500},
        )
        browser.get(f"file://{path}")
        assert browser.get_log("browser") == []
        sideways = "return document.documentElement.scrollWidth - window.innerWidth"
        assert browser.execute_script(sideways) <= 0
        boxes = browser.execute_script(
            "return [...document.querySelectorAll('figure svg')].map(s => {"
            "const b = s.getBBox(); return [b.width, b.height,"
            "s.querySelectorAll('path,rect').length]})"
        )
        assert len(boxes) == figures
        assert all(w > 50 and h > 20 and marks > 0 for w, h, marks in boxes)
        missing = browser.execute_script(
            "return [...document.querySelectorAll('a[href^=\"#\"]')].filter("
            "a => !document.getElementById(a.hash.slice(1))).length"
        )
        assert missing == 0
    for kind in ("svg", "png"):
        copies = list((path.parent / "figures").glob(f"*.{kind}"))
        assert len(copies) == figures
        for copy in copies:
            browser.get(f"file://{copy}")
            assert browser.get_log("browser") == []
    # Nothing blank: a picture of one colour shrinks to almost nothing.
    assert min(copy.stat().st_size for copy in copies) > 3000


def test_it_works_in_a_browser(tmp_path: Path, browser) -> None:
    path = page(tmp_path)
    look(browser, path, figures=5)
    browser.get(f"file://{path}")
    assert browser.title == EVIL  # shown as text, not run


def test_the_reports_of_build_and_diagnose_work_in_a_browser(tmp_path: Path, browser) -> None:
    def run(*command: str) -> None:
        assert main([*command, "-q"]) == 0

    recording = str(tmp_path / "rec.csv")
    run("simulate", "linear", "--samples", "1500", "-o", recording)
    quick = ["--size", "2", "--hidden", "8", "--epochs", "10", "--on", "reference"]
    run("build", recording, *quick, "-o", str(tmp_path / "out"))
    look(browser, tmp_path / "out" / "report.html", figures=9)
    rec = read(recording)
    later = rec.codes.copy()
    later[700:, :2] += 60
    write(replace(rec, codes=later), tmp_path / "real.csv")
    run("diagnose", recording, str(tmp_path / "real.csv"), "-o", str(tmp_path / "gap"))
    drawn = len(list((tmp_path / "gap" / "figures").glob("*.svg")))
    assert drawn >= 5
    look(browser, tmp_path / "gap" / "report.html", figures=drawn)


def test_dark_and_light_are_both_legible(tmp_path: Path, browser) -> None:
    path = page(tmp_path)
    seen = set()
    for scheme in ("dark", "light"):
        browser.execute_cdp_cmd(
            "Emulation.setEmulatedMedia",
            {"features": [{"name": "prefers-color-scheme", "value": scheme}]},
        )
        browser.get(f"file://{path}")
        for element in ("h1", "figcaption", "td"):
            ratio = browser.execute_script(
                "const l = c => {const v = c.match(/[0-9.]+/g).slice(0, 3).map(x => x / 255)"
                ".map(x => x <= .04045 ? x / 12.92 : ((x + .055) / 1.055) ** 2.4);"
                "return .2126 * v[0] + .7152 * v[1] + .0722 * v[2]};"
                "const a = l(getComputedStyle(document.querySelector(arguments[0])).color);"
                "const b = l(getComputedStyle(document.body).backgroundColor);"
                "return (Math.max(a, b) + .05) / (Math.min(a, b) + .05)",
                element,
            )
            assert ratio > 4.5, (scheme, element)
        seen.add(browser.execute_script("return getComputedStyle(document.body).backgroundColor"))
    assert len(seen) == 2


def test_nothing_is_fetched_and_bytes_repeat(tmp_path: Path) -> None:
    first = page(tmp_path / "a").read_text()
    assert first == page(tmp_path / "b").read_text()
    assert "http" not in first.replace("http://www.w3.org", "")
    assert "<script" not in first
    for figure in (tmp_path / "a" / "figures").iterdir():
        assert figure.read_bytes() == (tmp_path / "b" / "figures" / figure.name).read_bytes()


def test_long_lines_keep_their_spikes_and_stay_small() -> None:
    y = np.zeros(1_000_000)
    y[123_456], y[987_654] = 5.0, -3.0
    drawn = charts.lines(np.arange(1e6), [charts.Line(y, "spiky")], "x", "y")
    assert len(drawn) < 30_000
    heights = {
        float(part.split()[1]) for part in drawn.split('thin a" d="M')[1].split('"')[0].split("L")
    }
    assert len(heights) >= 3  # the level, the spike up, the spike down

"""Results show themselves, briefly, whatever arrays they hold."""

from __future__ import annotations

from pathlib import Path

import softsense as ss


def test_every_result_has_a_line_and_a_table(tmp_path: Path) -> None:
    rec = ss.simulate(ss.linear_rig(0), samples=1200, seed=0)
    later = ss.simulate(ss.linear_rig(0), samples=1200, seed=0)
    selection = ss.select(rec, 2)
    fit = ss.fit(rec, selection, hidden=5, restarts=1, max_epochs=5)
    estimator = ss.quantise(fit, rec)
    export = ss.generate(estimator, tmp_path)
    verification = ss.verify(tmp_path, on=("reference",))
    diagnosis = ss.diagnose(rec, later)
    shown = [rec, ss.rank(rec), selection, fit, estimator, export, verification, diagnosis]
    for result in shown:
        assert 20 < len(repr(result)) < 1500, type(result)
        assert "array(" not in repr(result)
        page = result._repr_html_()
        assert page.startswith("<table>")
        assert page.count("<tr>") == len(result.summary()) > 1
    assert " ".join(selection.sensors) in selection._repr_html_()
    assert "none beyond the noise" in repr(diagnosis)

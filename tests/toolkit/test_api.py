"""The way of a notebook, as the package's first page shows it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

import softsense as ss


def test_the_notebook_s_way(tmp_path: Path) -> None:
    ss.write(ss.simulate(ss.linear_rig(1), samples=1500), tmp_path / "rec.csv")
    rec = ss.read(tmp_path / "rec.csv")
    sel = ss.select(rec, 2)
    fit = ss.fit(rec, sel, hidden=8, max_epochs=10, restarts=1)
    net = ss.quantise(fit, rec)
    done = ss.generate(net, tmp_path / "out")
    result = ss.verify(tmp_path / "out", on=("reference", "onnxruntime"))
    assert result.good
    assert done.network.digest == result.digest
    codes = rec.with_sensors(sel.sensors).codes
    span = np.ptp(rec.target)
    assert np.abs(net.predict(codes) - fit.mlp.predict(codes)).max() < span / 1000
    for value in (rec, sel, net.network, fit.mlp):
        assert 10 < len(repr(value)) < 3000


def test_every_public_name_is_there_and_documented() -> None:
    assert set(ss.__all__) <= set(dir(ss))
    for name in ss.__all__:
        assert getattr(ss, name).__doc__, name


def test_importing_is_light() -> None:
    root = Path(__file__).resolve().parents[2]
    code = (
        f"import sys; sys.path[:0] = [{str(root / 'toolkit')!r}, {str(root / 'codegen')!r}]\n"
        "import softsense; print('numpy' in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "False"

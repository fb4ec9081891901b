"""softsense: from a recording of soft strain sensors to a verified estimator on a microcontroller.

    import softsense as ss

    rec = ss.read("rec.csv")
    sel = ss.select(rec, 3)
    fit = ss.fit(rec, sel)
    net = ss.quantise(fit, rec)
    ss.generate(net, "out/")
    ss.verify("out/")

Names are imported on first use, so that ``import softsense`` and ``softsense --help`` are fast.
"""

from __future__ import annotations

import importlib
from typing import Any

_HOME = {
    "Recording": "recording",
    "SoftsenseError": "errors",
    "Mlp": "mlp",
    "read": "recording",
    "split": "recording",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"softsense.{_HOME[name]}"), name)
    raise AttributeError(f"module 'softsense' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__

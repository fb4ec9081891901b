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
import sys
from types import ModuleType
from typing import Any

# Public name: where it lives.
_HOME = {
    "Build": "pipeline.Build",
    "Estimator": "pipeline.Estimator",
    "Fit": "train.Fit",
    "IntNetwork": "softsense_codegen.network.IntNetwork",
    "Mlp": "mlp.Mlp",
    "Ranking": "select.Ranking",
    "Recipe": "pipeline.Recipe",
    "Recording": "recording.Recording",
    "Selection": "select.Selection",
    "SoftsenseError": "errors.SoftsenseError",
    "Verification": "verify.Verification",
    "augment": "diagnose.augment",
    "build": "pipeline.build",
    "diagnose": "diagnose.diagnose",
    "fit": "train.fit",
    "generate": "pipeline.generate_export",
    "linear_rig": "simulate.linear_rig",
    "finger_rig": "simulate.finger_rig",
    "quantise": "pipeline.quantise_fit",
    "rank": "select.rank",
    "read": "recording.read",
    "read_together": "recording.read_together",
    "select": "select.select",
    "simulate": "simulate.simulate",
    "split": "recording.split",
    "verify": "verify.verify",
    "write": "recording.write",
}

__all__ = sorted(_HOME)


class _Package(ModuleType):
    """Looks public names up on first use, also those that a submodule is called by.

    ``import softsense.verify`` sets the attribute ``verify`` to the submodule; the function is
    what a caller of ``softsense.verify(...)`` means, so the table above wins.
    """

    def __getattribute__(self, name: str) -> Any:
        home = _HOME.get(name)
        if home is None:
            return super().__getattribute__(name)
        path, _, attribute = home.rpartition(".")
        if not path.startswith("softsense_codegen"):
            path = f"softsense.{path}"
        return getattr(importlib.import_module(path), attribute)


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return __all__

"""The ONNX files under ONNX Runtime."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError

# Products of whole layers are laid out per sample; this many keep them small.
CHUNK = 4096


class OnnxModel:
    """An ONNX file with input ``codes`` and output ``estimate``."""

    def __init__(self, path: Path) -> None:
        import onnxruntime
        from onnxruntime.capi.onnxruntime_pybind11_state import Fail, InvalidProtobuf, NoSuchFile

        options = onnxruntime.SessionOptions()
        options.log_severity_level = 3
        try:
            self._session: Any = onnxruntime.InferenceSession(
                str(path), options, providers=["CPUExecutionProvider"]
            )
        except (Fail, InvalidProtobuf, NoSuchFile) as error:
            raise SoftsenseError(
                "not a readable ONNX file", where=str(path), remedy="export again"
            ) from error
        kind = self._session.get_inputs()[0].type
        self._dtype = np.float32 if "float" in kind else np.int32

    def estimate(self, codes: NDArray[np.int16]) -> NDArray[Any]:
        """Estimates (samples, outputs), int32 or float32 as the file says."""
        parts = [
            self._session.run(None, {"codes": codes[start : start + CHUNK].astype(self._dtype)})[0]
            for start in range(0, len(codes), CHUNK)
        ]
        return np.concatenate(parts)

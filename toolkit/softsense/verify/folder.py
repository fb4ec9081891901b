"""An export folder, read back: the integer network and the codes that it is tested on."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.errors import SoftsenseError
from softsense_codegen.network import IntNetwork

MANIFEST = "manifest.json"
SCHEMA = "softsense.export/1"
Codes = NDArray[np.int16]


@dataclass(frozen=True)
class ExportFolder:
    """A whole and consistent export: ``network``, ``manifest`` and the ``recorded`` codes."""

    path: Path
    manifest: dict[str, Any]
    network: IntNetwork
    recorded: Codes

    def file(self, suffix: str) -> Path:
        """The file NAME + ``suffix``."""
        return self.path / f"{self.network.name}{suffix}"


def read_folder(path: str | Path) -> ExportFolder:
    """Read an export folder.

    Raises ``SoftsenseError`` where it is not one, or where its files do not belong together.
    """
    path = Path(path)
    manifest_path = path / MANIFEST
    try:
        manifest = json.loads(manifest_path.read_text())
    except OSError as error:
        raise SoftsenseError(
            "not an export folder: manifest.json cannot be read",
            where=str(path),
            remedy="give the folder that softsense build or export wrote",
        ) from error
    except ValueError as error:
        raise SoftsenseError(
            f"not a whole manifest: {error}", where=str(manifest_path), remedy="export again"
        ) from error
    if not isinstance(manifest, dict) or manifest.get("schema") != SCHEMA:
        raise SoftsenseError(
            f"schema is not {SCHEMA}", where=str(manifest_path), remedy="export again"
        )
    network_path = path / f"{manifest['name']}.json"
    try:
        text = network_path.read_text()
    except OSError as error:
        raise SoftsenseError(
            "is missing", where=str(network_path), remedy="export again"
        ) from error
    network = IntNetwork.from_json(text, where=str(network_path))
    if network.digest != manifest["digest"]:
        raise SoftsenseError(
            "manifest and network are of different exports", where=str(path), remedy="export again"
        )
    recorded = np.zeros((0, len(network.inputs)), dtype=np.int16)
    codes_path = path / "codes.npz"
    if codes_path.is_file():
        with np.load(codes_path) as archive:
            recorded = archive["codes"].astype(np.int16)
    return ExportFolder(path, manifest, network, recorded)

"""Files that are either whole or not there: write to a temporary name, then rename."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from softsense_codegen.errors import SoftsenseError


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write ``data`` to ``path`` so that no reader ever sees a part of it.

    Raises ``SoftsenseError`` when the folder cannot be made or the disk is full; the temporary
    file is removed then.
    """
    path = Path(path)
    temporary: str | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes private files; an ordinary file obeys the user's umask.
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except OSError as error:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)
        raise SoftsenseError(
            f"cannot write: {error.strerror or error}",
            where=str(path),
            remedy="check the path, its permissions and the free space",
        ) from error
    return path


def write_text(path: str | Path, text: str) -> Path:
    """``write_bytes`` of UTF-8 text with the line ends as they are."""
    return write_bytes(path, text.encode("utf-8"))

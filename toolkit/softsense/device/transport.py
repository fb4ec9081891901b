"""The line to a board: any port that pyserial opens, as bytes in and bytes out."""

from __future__ import annotations

import errno
import select
import time
from dataclasses import dataclass
from typing import Any

import serial
from serial.tools import list_ports

from softsense.errors import SoftsenseError

DEFAULT_BAUD = 115200
_CHUNK = 4096


class Unplugged(Exception):
    """The line has gone; it may come back."""


@dataclass
class Line:
    """An open port. ``where``: a device path or a URL of pyserial, e.g. ``socket://host:port``."""

    where: str
    baud: int = DEFAULT_BAUD
    _port: Any = None

    def open(self) -> None:
        """Open it. Raises ``Unplugged`` where it is not there, ``SoftsenseError`` where it is
        there and may not be used."""
        options: dict[str, Any] = {"baudrate": self.baud, "timeout": 0, "write_timeout": 2}
        if "://" not in self.where:
            options["exclusive"] = True
        try:
            self._port = serial.serial_for_url(self.where, **options)
        except ValueError as error:
            raise SoftsenseError(
                f"not a port: {error}", where=self.where, remedy="give /dev/tty… or socket://…"
            ) from error
        except (serial.SerialException, OSError) as error:
            self._port = None
            number = getattr(error, "errno", None)
            text = str(error)
            if number in (errno.EACCES, errno.EPERM):
                raise SoftsenseError(
                    "may not be opened",
                    where=self.where,
                    remedy="join the group that owns it (dialout), then log in again",
                ) from error
            if number in (errno.EBUSY, errno.EAGAIN) or "lock" in text:
                raise SoftsenseError(
                    "is used by another program",
                    where=self.where,
                    remedy="close that program, or choose another port",
                ) from error
            if number in (errno.ENOTTY, errno.EINVAL) or "configure port" in text:
                raise SoftsenseError(
                    "is not a serial port", where=self.where, remedy="softsense device list"
                ) from error
            raise Unplugged(text) from error

    def close(self) -> None:
        """Close it; closed already is fine."""
        port, self._port = self._port, None
        if port is not None:
            try:
                port.close()
            except OSError:
                return  # the device has gone: there is nothing left to close

    def send(self, data: bytes) -> None:
        """Send all of ``data``. Raises ``Unplugged``."""
        try:
            if self._port is None:
                raise Unplugged("closed")
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise Unplugged(str(error)) from error

    def receive(self, timeout_s: float) -> bytes:
        """What has arrived, waiting at most ``timeout_s`` for the first byte. Raises
        ``Unplugged``."""
        try:
            if self._port is None:
                raise Unplugged("closed")
            ready, _, _ = select.select([self._port.fileno()], [], [], max(timeout_s, 0.0))
            return bytes(self._port.read(_CHUNK)) if ready else b""
        except (serial.SerialException, OSError, ValueError, TypeError) as error:
            # pyserial raises TypeError or ValueError when its file number is gone already.
            raise Unplugged(str(error)) from error


def ports() -> list[tuple[str, str]]:
    """Serial ports of this machine: (path, description)."""
    return [(str(port.device), str(port.description)) for port in list_ports.comports()]


def now_s() -> float:
    """The clock of all waiting here."""
    return time.monotonic()

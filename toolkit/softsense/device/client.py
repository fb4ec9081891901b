"""The client: requests with retries over a line that loses, damages and delays.

An answer is accepted only when its CRC, its second check (which covers the very request), its
sequence number, its kind and its session are right; everything else is thrown away and asked
again, until ``patience_s`` has passed without one good answer.
"""

from __future__ import annotations

import secrets
import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softsense.device.board import Network
from softsense.device.framing import (
    OVERHEAD,
    STRUCTS,
    VERSION,
    Flag,
    Frame,
    Kind,
    Refusal,
    Splitter,
    answers,
    decode,
    encode,
)
from softsense.device.transport import Line, Unplugged, now_s
from softsense.errors import SoftsenseError

CHOOSE = 0xFF
# More requests than this in flight gain nothing; fewer where the board's queue is small.
MOST_IN_FLIGHT = 16
FIRST_TIMEOUT_S = 0.3
SHORTEST_TIMEOUT_S = 0.01
LONGEST_TIMEOUT_S = 2.0
# Later requests answered before one is taken for lost: one may be a mere swap on the way.
OVERTAKEN = 2

Codes = NDArray[np.int16]
Estimates = NDArray[np.int32]


@dataclass(frozen=True)
class Identity:
    """What a board says it is. ``networks``: the primary one, then its fallbacks."""

    networks: tuple[Network, ...]
    channels: tuple[str, ...]
    firmware: str
    board: str
    protocol: int
    frame_bytes: int
    queue_bytes: int
    baud: int

    @property
    def digest(self) -> str:
        """Digest of the primary network."""
        return self.networks[0].digest


@dataclass(frozen=True)
class Verdict:
    """One answer with estimates: ``estimate`` is (rows, outputs) int32 of network ``network``."""

    estimate: Estimates
    network: int
    flags: Flag
    uncalibrated: int
    failed: int


@dataclass(frozen=True)
class Sample:
    """One conversion that the device has estimated on its own."""

    conversion: int
    time_us: int
    network: int
    flags: Flag
    uncalibrated: int
    failed: int
    codes: tuple[int, ...]
    estimate: tuple[int, ...]


@dataclass
class Counters:
    """What the line has cost."""

    answers: int = 0
    retries: int = 0
    damaged: int = 0
    stray: int = 0
    resets: int = 0
    reconnects: int = 0


@dataclass
class _Request:
    """A request on its way; ``sent_s`` is None while it waits to be (re)sent."""

    index: int
    kind: int
    payload: bytes
    wire: bytes = b""
    check: int = 0
    sequence: int = 0
    sent_s: float | None = None
    tries: int = 0
    overtaken: int = 0


class _Reset(Exception):
    """The board has forgotten this session."""


@dataclass
class _Timing:
    """Round-trip time and its deviation, smoothed (RFC 6298)."""

    smooth_s: float | None = None
    deviation_s: float = 0.0
    byte_s: float = 10 / 57600  # at most: the quickest trip, per byte there and back
    backoff: float = 1.0  # doubled by every timeout until a trip has been measured again
    window: float = 2.0  # requests under way: one more per answer, half as many after a timeout
    rows: float = 8.0  # per request: on a bad cable long frames seldom arrive whole
    lossy: bool = False

    def late(self) -> None:
        # A late answer still counts, so asking again too soon costs little; waiting costs time.
        self.backoff = min(2 * self.backoff, 4.0)
        self.window = max(self.window / 2, 1.0)

    def lost(self) -> None:
        self.rows = max(self.rows / 2, 1.0)
        self.lossy = True

    def learn(self, trip_s: float, carried: int) -> None:
        self.backoff = 1.0
        self.byte_s = min(self.byte_s, trip_s / carried)
        self.window = min(self.window + 0.5, float(MOST_IN_FLIGHT))
        self.rows += 1.0 if self.lossy else self.rows / 2
        if self.smooth_s is None:
            self.smooth_s, self.deviation_s = trip_s, trip_s / 2
            return
        self.deviation_s += (abs(self.smooth_s - trip_s) - self.deviation_s) / 4
        self.smooth_s += (trip_s - self.smooth_s) / 8

    def timeout_s(self) -> float:
        if self.smooth_s is None:
            return FIRST_TIMEOUT_S
        base = max(self.smooth_s + 4 * self.deviation_s, SHORTEST_TIMEOUT_S)
        return min(base * self.backoff, LONGEST_TIMEOUT_S)


@dataclass
class Device(AbstractContextManager["Device"]):
    """A connection to a board that is answered, or fails with one clear line.

    ``expected``: the digest that the board must have; None takes any board. A context manager:
    leaving it switches the stream off and closes the port.
    """

    line: Line
    expected: str | None = None
    patience_s: float = 5.0
    owner: AbstractContextManager[Any] | None = None
    counters: Counters = field(default_factory=Counters)
    samples: deque[Sample] = field(default_factory=deque)
    _identity: Identity | None = None
    _session: int = 0
    _sequence: int = field(default_factory=lambda: secrets.randbelow(0x10000))
    _splitter: Splitter = field(default_factory=Splitter)
    _timing: _Timing = field(default_factory=_Timing)
    _heard_s: float = 0.0
    _period_us: int = 0

    def __enter__(self) -> Device:
        try:
            self._heard_s = now_s()
            self._open()
            self._identify()
        except BaseException:
            self._leave()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if self._period_us and not isinstance(value, SoftsenseError):
                self.patience_s = min(self.patience_s, 1.0)
                self._heard_s = now_s()
                self.stream(0)
        except SoftsenseError:
            return  # the board has gone: it cannot be told to be silent
        finally:
            self._leave()

    def _leave(self) -> None:
        self.line.close()
        if self.owner is not None:
            self.owner.__exit__(None, None, None)

    @property
    def identity(self) -> Identity:
        """What the board said it is."""
        if self._identity is None:
            raise ValueError("not connected: use the device in a with statement")
        return self._identity

    # -- what a board can be asked -----------------------------------------------------------

    def ping(self) -> float:
        """Seconds that one small request took there and back."""
        started = now_s()
        self._ask(Kind.STATISTICS, b"")
        return now_s() - started

    def statistics(self) -> dict[str, int]:
        """The board's own counters since its start."""
        names = (
            *("time_us", "frames", "damaged", "overrun"),
            *("answers", "refused", "estimates", "conversions"),
        )
        values = STRUCTS["statistics answer"].unpack(self._ask(Kind.STATISTICS, b""))
        return dict(zip(names, values, strict=True))

    def self_test(self, network: int = 0) -> tuple[int, int]:
        """Runs the vectors in the board's flash; returns (compared, mismatches)."""
        compared = mismatches = 0
        while True:
            request = STRUCTS["self-test request"].pack(network, compared, 64)
            answer = STRUCTS["self-test answer"].unpack(self._ask(Kind.SELF_TEST, request))
            total, done, wrong = answer
            compared += done
            mismatches += wrong
            if compared >= total or not done:
                return compared, mismatches

    def rows_per_batch(self, network: int = 0) -> int:
        """Rows of codes that fit into one frame, there and back."""
        chosen = self.identity.networks[0 if network == CHOOSE else network]
        columns = self._columns(network)
        room = self.identity.frame_bytes - OVERHEAD
        there = (room - STRUCTS["estimate request"].size) // (2 * columns)
        back = (room - STRUCTS["estimate answer"].size) // (4 * len(chosen.outputs))
        return min(there, back)

    def _columns(self, network: int) -> int:
        if network == CHOOSE:
            return len(self.identity.channels)
        return len(self.identity.networks[network].inputs)

    def estimate(
        self,
        codes: Codes,
        network: int = 0,
        batch: int | None = None,
        advance: Callable[[float], None] | None = None,
    ) -> Estimates:
        """Estimates (rows, outputs) int32 of ``codes`` (rows, inputs), in batches.

        ``network``: number of the network, 0 the primary one. ``batch``: rows per request, by
        default as many as fit and the cable lets through. ``advance`` is told the rows done.
        Raises ``SoftsenseError`` where the board stops answering or refuses.
        """
        parts = []
        done = 0
        for verdict in self.verdicts(codes, network, batch):
            parts.append(verdict.estimate)
            done += len(verdict.estimate)
            if advance is not None:
                advance(done)
        outputs = len(self.identity.networks[0].outputs)
        return np.concatenate(parts) if parts else np.zeros((0, outputs), np.int32)

    def verdicts(
        self, codes: Codes, network: int = 0, batch: int | None = None
    ) -> Iterator[Verdict]:
        """As ``estimate``, one ``Verdict`` per request, in order, with what the board says about
        the sensors. ``network`` CHOOSE: ``codes`` are those of all channels, and the board
        chooses the network by the sensors' health."""
        codes = np.asarray(codes)
        columns = self._columns(network)
        if codes.ndim != 2 or codes.shape[1] != columns:
            raise ValueError(f"codes {codes.shape} are not (rows, {columns})")
        if codes.size and (codes.min() < -0x8000 or codes.max() > 0x7FFF):
            raise ValueError("codes are beyond int16")
        most = self.rows_per_batch(network)
        packed = codes.astype("<i2")
        outputs = len(self.identity.networks[0].outputs)
        fixed = STRUCTS["estimate answer"]

        def requests() -> Iterator[tuple[int, bytes]]:
            start = 0
            while start < len(packed):
                self._timing.rows = min(self._timing.rows, float(most))
                part = packed[start : start + min(batch or int(self._timing.rows), most)]
                start += len(part)
                kind = Kind.ESTIMATE if len(part) == 1 else Kind.BATCH
                head = STRUCTS["estimate request"].pack(network, len(part))
                yield kind, head + part.tobytes()

        for answer in self._exchange(requests()):
            used, flags, uncalibrated, failed, count = fixed.unpack_from(answer)
            values = np.frombuffer(answer, "<i4", offset=fixed.size).astype(np.int32)
            yield Verdict(values.reshape(count, outputs), used, Flag(flags), uncalibrated, failed)

    def stream(self, rate_hz: float) -> None:
        """Let the board estimate its own samples ``rate_hz`` times a second; 0: stop."""
        period_us = round(1e6 / rate_hz) if rate_hz else 0
        self._ask(Kind.STREAM, STRUCTS["stream request"].pack(period_us))
        self._period_us = period_us

    def watch(self) -> Iterator[Sample]:
        """Samples as they come, for ever. After a reset or an unplug the stream is started again.
        Raises ``SoftsenseError`` when nothing comes for ``patience_s``."""
        self._heard_s = now_s()
        while True:
            while self.samples:
                yield self.samples.popleft()
            wait = max(self.patience_s, 4e-6 * self._period_us)
            try:
                frames = self._frames(0.1)
                for frame in frames:
                    self._stray(frame, {})
                if self.samples:
                    self._heard_s = now_s()
                elif now_s() - self._heard_s > wait / 4:
                    self.ping()
                    self.stream(1e6 / self._period_us)
            except _Reset:
                self._again()
            except Unplugged as gone:
                self._reopen(gone)
                self._again()

    # -- the exchange ------------------------------------------------------------------------

    def _ask(self, kind: int, payload: bytes) -> bytes:
        return next(iter(self._exchange(iter([(kind, payload)]))))

    def _exchange(self, requests: Iterator[tuple[int, bytes]]) -> Iterator[bytes]:
        """Answers in the order of the requests, several of which are under way at once."""
        pending: dict[int, _Request] = {}
        ready: dict[int, bytes] = {}
        following = 0
        number = 0
        more = True
        self._heard_s = now_s()
        while more or pending or ready:
            while more and self._room(pending):
                item = next(requests, None)
                if item is None:
                    more = False
                    break
                request = _Request(number, *item)
                number += 1
                self._enlist(request, pending)
            try:
                self._transmit(pending)
                for frame in self._frames(self._wait_s(pending)) if pending else ():
                    answered = self._match(frame, pending)
                    if answered is not None:
                        ready[answered.index] = frame.payload
            except _Reset:
                self._again()
                self._renew(pending)
            except Unplugged as gone:
                self._reopen(gone)
                self._again()
                self._renew(pending)
            while following in ready:
                yield ready.pop(following)
                following += 1

    def _room(self, pending: dict[int, _Request]) -> bool:
        if self._identity is None or not pending:
            return not pending
        used = sum(len(request.wire) for request in pending.values())
        longest = max(len(request.wire) for request in pending.values())
        return len(pending) < self._timing.window and used + longest < self._identity.queue_bytes

    def _enlist(self, request: _Request, pending: dict[int, _Request]) -> None:
        self._sequence = (self._sequence + 1) & 0xFFFF
        request.sequence = self._sequence
        frame = Frame(request.kind, request.sequence, self._session, request.payload)
        request.wire, request.check = encode(frame)
        request.sent_s = None
        request.overtaken = 0
        pending[request.sequence] = request

    def _renew(self, pending: dict[int, _Request]) -> None:
        """Ask everything again in the new session, under new numbers."""
        old = list(pending.values())
        pending.clear()
        for request in old:
            self._enlist(request, pending)

    def _transmit(self, pending: dict[int, _Request]) -> None:
        now = now_s()
        if now - self._heard_s > self.patience_s:
            raise SoftsenseError(
                f"no answer for {self.patience_s:g} s",
                where=self.line.where,
                remedy="check cable, power and baud rate, and that it is the softsense firmware",
            )
        wire = b""
        timeout_s = self._timeout_s(pending)
        timed_out = lost = False
        for request in pending.values():
            late = request.sent_s is not None and now - request.sent_s > timeout_s
            timed_out |= late
            if request.sent_s is None or late or request.overtaken > OVERTAKEN:
                self.counters.retries += request.sent_s is not None
                lost |= request.tries == 1
                request.sent_s, request.overtaken = now, 0
                request.tries += 1
                wire += request.wire
        if timed_out:
            self._timing.late()
        if lost:
            self._timing.lost()
        if wire:
            self.line.send(wire)

    def _timeout_s(self, pending: dict[int, _Request]) -> float:
        """The smoothed trip, and the time that the bytes under way take at the board's rate, or
        took so far where it has none: a first large request must not be judged by the small ones
        before it."""
        timeout_s = self._timing.timeout_s()
        if self._identity is not None:
            there = sum(len(request.wire) for request in pending.values())
            baud = self._identity.baud
            timeout_s += 2 * there * (10 / baud if baud else self._timing.byte_s)
        return timeout_s

    def _wait_s(self, pending: dict[int, _Request]) -> float:
        timeout_s = self._timeout_s(pending)
        due = [r.sent_s + timeout_s for r in pending.values() if r.sent_s is not None]
        return max(min(due) - now_s(), 0.0005)

    def _frames(self, timeout_s: float) -> list[Frame]:
        frames = []
        for piece in self._splitter.push(self.line.receive(timeout_s)):
            frame = decode(piece)
            if frame is None:
                self.counters.damaged += 1
            else:
                frames.append(frame)
        return frames

    def _match(self, frame: Frame, pending: dict[int, _Request]) -> _Request | None:
        request = pending.get(frame.sequence)
        if request is None or not answers(frame, request.check):
            self._stray(frame, pending)
            return None
        if frame.kind == Kind.ERROR | Kind.ANSWER:
            self._refused(frame)
        identify = request.kind == Kind.IDENTIFY
        if frame.kind != request.kind | Kind.ANSWER or frame.version != VERSION:
            self.counters.stray += 1
            return None
        if not identify and frame.session != self._session:
            raise _Reset
        del pending[frame.sequence]
        now = now_s()
        self._heard_s = now
        self.counters.answers += 1
        if request.tries == 1 and request.sent_s is not None:
            # Karn: a retried trip tells nothing.
            carried = len(request.wire) + OVERHEAD + len(frame.payload)
            self._timing.learn(now - request.sent_s, carried)
            for other in pending.values():
                if other.sent_s is not None and other.sent_s <= request.sent_s:
                    older = (request.sequence - other.sequence) & 0xFFFF < 0x8000
                    other.overtaken += older
        return request

    def _refused(self, frame: Frame) -> None:
        (code,) = STRUCTS["error"].unpack(frame.payload)
        if code == Refusal.BAD_SESSION:
            raise _Reset
        where = self.line.where
        if code == Refusal.BAD_VERSION:
            raise SoftsenseError(
                f"the firmware speaks protocol {frame.version}, this client {VERSION}",
                where=where,
                remedy="flash the firmware of this softsense",
            )
        if code == Refusal.NO_CONVERTER:
            raise SoftsenseError(
                "this board has no converter to sample",
                where=where,
                remedy="start the emulator with --recording, or use device estimate",
            )
        known = {member.value: member.name for member in Refusal}
        raise SoftsenseError(
            f"the board refuses the request: {known.get(code, code)}",
            where=where,
            remedy="flash the firmware of this softsense",
        )

    def _stray(self, frame: Frame, pending: dict[int, _Request]) -> None:
        """A frame that answers nothing: a sample of the stream, or a late or wrong one."""
        if frame.kind == Kind.SAMPLE | Kind.ANSWER and answers(frame, 0):
            if frame.session == self._session and self._identity is not None:
                self.samples.append(self._sample(frame.payload))
            return
        self.counters.stray += 1

    def _sample(self, payload: bytes) -> Sample:
        fixed = STRUCTS["sample"]
        conversion, time_us, network, flags, uncalibrated, failed = fixed.unpack_from(payload)
        channels = len(self.identity.channels)
        outputs = len(self.identity.networks[0].outputs)
        values = struct.unpack_from(f"<{channels}h{outputs}i", payload, fixed.size)
        return Sample(
            *(conversion, time_us, network, Flag(flags), uncalibrated, failed),
            codes=values[:channels],
            estimate=values[channels:],
        )

    # -- who is there ------------------------------------------------------------------------

    def _open(self) -> None:
        try:
            self.line.open()
        except Unplugged as gone:
            raise SoftsenseError(
                f"cannot be opened: {gone}",
                where=self.line.where,
                remedy="check the cable and the name; softsense device list",
            ) from gone
        # Ends whatever half frame the board may hold from before.
        self._splitter = Splitter()
        self.line.send(b"\0")

    def _reopen(self, gone: Unplugged) -> None:
        """Wait for the cable to come back."""
        self.line.close()
        while True:
            try:
                self.line.open()
                self._splitter = Splitter()
                self.line.send(b"\0")
            except Unplugged:
                self.line.close()
            else:
                self.counters.reconnects += 1
                return
            if now_s() - self._heard_s > self.patience_s:
                raise SoftsenseError(
                    f"unplugged: {gone}", where=self.line.where, remedy="plug it in again"
                ) from gone
            _pause(0.02)

    def _again(self) -> None:
        """After a reset or an unplug: the same board with the same networks, or an error."""
        before = self._identity
        heard_s = self._heard_s
        while True:
            try:
                session = self._session
                self._identify()
                break
            except Unplugged as gone:
                self._session = session
                self._heard_s = heard_s
                self._reopen(gone)
            except SoftsenseError:
                # The next request meets the old session's end, and tries again.
                self._identity, self._session = before, session
                raise
        self.counters.resets += 1
        if before is not None and before != self._identity:
            raise SoftsenseError(
                f"another board answers: digest {self.identity.digest[:16]}, before "
                f"{before.digest[:16]}",
                where=self.line.where,
                remedy="connect the board that you began with, or start again",
            )
        if self._period_us and before is not None:
            self.stream(1e6 / self._period_us)

    def _identify(self) -> None:
        """Begin a session and read who answers."""
        self._identity = None
        session = 1 + secrets.randbelow(0xFFFF)
        described = [self._describe(session, 0)]
        count = described[0][0][0]
        described += [self._describe(session, number) for number in range(1, count)]
        fixed, text = described[0]
        self._session = session
        self._identity = Identity(
            networks=tuple(_network(texts) for _, texts in described),
            channels=tuple(text["channels"].split(",")),
            firmware=text["firmware"],
            board=text["board"],
            protocol=VERSION,
            frame_bytes=fixed[4],
            queue_bytes=fixed[5],
            baud=fixed[6],
        )
        if self.expected is not None and self.identity.digest != self.expected:
            raise SoftsenseError(
                f"the board holds another model: {self.identity.networks[0].name}, digest "
                f"{self.identity.digest[:16]} instead of {self.expected[:16]}",
                where=self.line.where,
                remedy="flash this model, or name the folder of the other",
            )

    def _describe(self, session: int, network: int) -> tuple[tuple[int, ...], dict[str, str]]:
        text = b""
        while True:
            request = STRUCTS["identify request"].pack(session, network, len(text))
            answer = self._ask(Kind.IDENTIFY, request)
            fixed = STRUCTS["identify answer"].unpack_from(answer)
            part = answer[STRUCTS["identify answer"].size :]
            text += part
            if len(text) >= fixed[7] or not part:
                break
        lines = text.decode("utf-8", "replace").splitlines()
        return fixed, dict(line.split("=", 1) for line in lines if "=" in line)


def _network(text: dict[str, str]) -> Network:
    scales = [pair.split(":") for pair in text["scales"].split(",")]
    return Network(
        name=text["name"],
        digest=text["digest"],
        inputs=tuple(text["inputs"].split(",")),
        outputs=tuple(text["outputs"].split(",")),
        units=tuple(text["units"].split(",")),
        scales=tuple((float(lsb), float(zero)) for lsb, zero in scales),
    )


def _pause(seconds: float) -> None:
    from time import sleep

    sleep(seconds)


def physical(network: Network, estimate: Sequence[int] | Estimates) -> list[float]:
    """Estimates of one row in the outputs' units: (y - zero) * lsb."""
    return [(int(y) - zero) * lsb for y, (lsb, zero) in zip(estimate, network.scales, strict=True)]

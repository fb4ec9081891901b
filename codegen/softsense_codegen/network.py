"""The integer network: what a device computes, as data. The contract between all stages."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softsense_codegen.errors import SoftsenseError
from softsense_codegen.fixed import FRACTION_BITS, Table

SCHEMA = "softsense.intnetwork/1"
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,47}\Z")
_KEYWORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if "
    "inline int long register restrict return short signed sizeof static struct switch typedef "
    "union unsigned void volatile while asm bool catch class delete export friend namespace new "
    "operator private protected public template this throw true false try using virtual "
    "main".split()
)

Activation = Literal["tanh", "relu", "linear"]


@dataclass(frozen=True)
class Input:
    """One sensor: codes outside ``low`` … ``high`` (inclusive, calibrated) are clipped to it."""

    name: str
    low: int
    high: int
    front_end: str = ""


@dataclass(frozen=True)
class Output:
    """One target: value in ``unit`` = (y - zero) * lsb; ``full_scale`` in ``unit``."""

    name: str
    unit: str
    lsb: float
    zero: int
    full_scale: float


@dataclass(frozen=True)
class IntLayer:
    """z_j = bias_j + sum_i floor(weight_ji * a_i / 2**shift), then the activation.

    ``weight``: (units, inputs) integers of ``bits`` bits (signed, or unsigned where none is
    negative). ``bias``: (units,) int32. ``a``: clipped codes for the first layer, else the former
    layer's activations 0 … 65535.

    Biases of hidden layers, with codes counted from the middle of their ranges, lie on a grid that
    16 bits hold (``bias_grid``).

    "tanh": arguments z, in units of table.step / 2**(16 + fine), are clipped to the table and read
    from it at floor(z / 2**fine). "relu": floor(z / 2**fine) clipped to 0 … 65535.
    "linear" (the last layer only): z itself.
    """

    weight: tuple[tuple[int, ...], ...]
    bias: tuple[int, ...]
    shift: int
    activation: Activation
    fine: int = 0

    @cached_property
    def matrix(self) -> NDArray[np.int64]:
        """``weight`` as an array."""
        return np.asarray(self.weight, dtype=np.int64).reshape(len(self.bias), -1)

    @cached_property
    def bias_grid(self) -> tuple[int, int]:
        """(base, shift): every hidden bias is base + b * 2**shift with b = 0 … 65535."""
        base = min(self.bias)
        shift = bias_shift(max(self.bias) - base)
        if any((b - base) % (1 << shift) for b in self.bias):
            raise ValueError(f"biases do not lie on a grid of 2**{shift}")
        return base, shift

    def clip_at(self, table: Table) -> int:
        """The largest argument that ``table`` takes, in units of z."""
        return (table.segments << (FRACTION_BITS + self.fine)) - 1

    @property
    def unsigned(self) -> bool:
        """Whether no weight is negative, so that they are stored unsigned."""
        return bool(self.matrix.min() >= 0)


@dataclass(frozen=True)
class Accuracy:
    """What is known of |fixed - float|, in units of the output (one entry per output).

    ``worst``: the largest difference found, at the codes ``worst_codes``; ``exhaustive``: every
    code of the calibrated box was tried, so that ``worst`` is the maximum. ``bound``: proved for
    the whole box by adding up all roundings (no search).
    """

    worst: tuple[float, ...]
    worst_codes: tuple[tuple[int, ...], ...]
    exhaustive: bool
    compared: int
    bound: tuple[float, ...]


@dataclass(frozen=True)
class IntNetwork:
    """A static network in integers: ``reference.estimate`` says what it computes."""

    name: str
    bits: int
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    layers: tuple[IntLayer, ...]
    table: Table | None
    accuracy: Accuracy | None = None

    def __post_init__(self) -> None:
        check_name(self.name)
        width = len(self.inputs)
        for number, layer in enumerate(self.layers):
            if layer.matrix.shape[1] != width:
                raise ValueError(f"layer {number} takes {layer.matrix.shape[1]}, has {width}")
            width = len(layer.bias)
        if width != len(self.outputs):
            raise ValueError(f"{width} results for {len(self.outputs)} outputs")

    def __repr__(self) -> str:
        widths = [len(self.inputs), *(len(layer.bias) for layer in self.layers)]
        return (
            f"IntNetwork {self.name!r} {' -> '.join(map(str, widths))}, int{self.bits} weights, "
            f"digest {self.digest[:12]}"
        )

    @cached_property
    def digest(self) -> str:
        """SHA-256 (hex) of what the network computes and is called; ``accuracy`` is left out."""
        data = asdict(self)
        del data["accuracy"]
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def macs(self) -> int:
        """Multiply-accumulate operations per estimate, without table reads."""
        return sum(layer.matrix.size for layer in self.layers)

    def to_json(self) -> str:
        """Text from which ``from_json`` makes the identical network."""
        data = {"schema": SCHEMA, "digest": self.digest, **asdict(self)}
        return json.dumps(data, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str, where: str = "network.json") -> IntNetwork:
        """The inverse of ``to_json``.

        Raises ``SoftsenseError`` for a truncated, foreign or altered file.
        """
        try:
            data: dict[str, Any] = json.loads(text)
            schema, digest = data.pop("schema"), data.pop("digest")
            if schema != SCHEMA:
                raise SoftsenseError(f"schema {schema!r} is not {SCHEMA}", where=where)
            accuracy, table = data.pop("accuracy"), data.pop("table")
            network = cls(
                name=data["name"],
                bits=data["bits"],
                inputs=tuple(Input(**i) for i in data["inputs"]),
                outputs=tuple(Output(**o) for o in data["outputs"]),
                layers=tuple(
                    IntLayer(
                        tuple(tuple(row) for row in layer.pop("weight")),
                        tuple(layer.pop("bias")),
                        **layer,
                    )
                    for layer in data["layers"]
                ),
                table=None if table is None else Table(table["reach"], tuple(table["entries"])),
                accuracy=None
                if accuracy is None
                else Accuracy(
                    tuple(accuracy["worst"]),
                    tuple(tuple(codes) for codes in accuracy["worst_codes"]),
                    accuracy["exhaustive"],
                    accuracy["compared"],
                    tuple(accuracy["bound"]),
                ),
            )
        except (ValueError, KeyError, TypeError, IndexError) as error:
            raise SoftsenseError(
                f"not a whole network file: {error}", where=where, remedy="export it again"
            ) from error
        if network.digest != digest:
            raise SoftsenseError(
                "the digest does not fit the content: the file was altered",
                where=where,
                remedy="export it again",
            )
        return network


def bias_shift(span: int) -> int:
    """The shift of the finest grid on which 16 bits hold biases that ``span`` so much."""
    return max(span.bit_length() - 16, 0)


def bias_words(bias: NDArray[np.float64]) -> NDArray[np.int64]:
    """``bias`` (units,) rounded to the finest grid that 16 bits hold."""
    base = int(np.floor(bias.min()))
    span = int(np.ceil(bias.max())) - base + 1
    shift = bias_shift(span)
    words = np.minimum(np.rint((bias - base) / 2.0**shift), 2.0**16 - 1)
    result: NDArray[np.int64] = base + (words.astype(np.int64) << shift)
    # Rounding may have narrowed the span, which would make the grid finer: that is still exact.
    return result


def check_name(name: str) -> str:
    """``name`` if C can use it as a prefix. Raises ``SoftsenseError`` otherwise."""
    if not _IDENTIFIER.match(name) or name in _KEYWORDS:
        raise SoftsenseError(
            f"{name!r} is not a C identifier",
            remedy="choose --name of letters, digits and _, not starting with a digit",
        )
    return name


def c_name(text: str) -> str:
    """A valid name made of ``text`` (a file's stem, say): foreign characters become _."""
    name = re.sub(r"\W", "_", text, flags=re.ASCII)[:48] or "model"
    if name[0].isdigit() or name in _KEYWORDS:
        name = f"m_{name}"[:48]
    return check_name(name)

"""What the templates need to know of a network, worked out: no arithmetic in templates."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from softsense_codegen import bounds
from softsense_codegen.errors import SoftsenseError
from softsense_codegen.fixed import FRACTION_BITS, NODE_SEGMENTS, Table, table_error
from softsense_codegen.network import IntLayer, IntNetwork

Optimise = Literal["speed", "size"]

OFFSET_16 = 1 << 15
# Up to this many inputs the loop over them is written out.
UNROLL = 8


def network_view(
    net: IntNetwork, cost_lines: Sequence[str] = (), optimise: Optimise = "speed"
) -> dict[str, Any]:
    """Everything that NAME.h and NAME.c show.

    ``optimise`` changes the layout of the table and how far the loop is written out, never a bit.

    Raises ``SoftsenseError`` where 32 bits do not suffice (see ``bounds.prove``).
    """
    bounds.prove(net)
    if len(net.layers) < 2:
        raise SoftsenseError(
            "there is no hidden layer", where=net.name, remedy="1 to 3 hidden layers are generated"
        )
    *hidden, fused, last = net.layers
    for layer in net.layers:
        if layer.shift > net.bits - 1:
            raise SoftsenseError(
                f"a shift of {layer.shift} is beyond {net.bits}-bit weights",
                where=net.name,
                remedy="use fewer units",
            )
    looped = len(net.inputs) > UNROLL or bool(hidden)
    middles = [(i.low + i.high) // 2 for i in net.inputs]
    acts = [_activation(net, layer) for layer in net.layers[:-1]]
    sources = ["in", *(f"h{number + 1}" for number in range(len(hidden)))]
    # The first layer's inputs are counted from the middle of their range.
    origins = [layer.matrix @ middles if layer is net.layers[0] else 0 for layer in net.layers]
    copies = next(n for n in (4, 3, 2, 1) if len(fused.bias) % n == 0)
    packed = optimise == "speed" and net.table is not None
    ratio_bits = 0 if net.table is None or packed else _ratio_bits(net.table)
    return {
        "name": net.name,
        "upper": net.name.upper() if net.name.upper() != net.name else "",
        "guard": f"{net.name.upper()}_SOFTSENSE_H",
        "digest": net.digest,
        "inputs": [
            {
                "name": label(i.name),
                "low": i.low,
                "high": i.high,
                "middle": middle,
                "front_end": label(i.front_end),
            }
            for i, middle in zip(net.inputs, middles, strict=True)
        ],
        "outputs": [
            {
                "name": label(o.name),
                "unit": label(o.unit),
                "zero": o.zero,
                "lsb_text": repr(o.lsb),
                "full_scale_text": f"{o.full_scale:.6g}",
                "bias": last.bias[index] % 2**32,
            }
            for index, o in enumerate(net.outputs)
        ],
        "accuracy_lines": accuracy_lines(net),
        "cost_lines": list(cost_lines),
        "macs": net.macs,
        "tanh_units": sum(len(x.bias) for x in net.layers if x.activation == "tanh"),
        "weight_bytes": _weight_bytes(net),
        "table_bytes": table_bytes(net, optimise),
        "ratio": 1 << ratio_bits,
        "ratio_bits": ratio_bits,
        "stack_note": _stack_note(net, looped),
        "word": f"uint{net.bits}_t",
        "offset": 2 ** (net.bits - 1),
        "dsp": not looped and net.bits == 16 and fused.shift == 0,
        "looped": looped,
        "unroll": 1 if optimise == "size" or looped else copies,
        "table": _table(net, packed),
        "packed": packed,
        "entry_type": "uint32_t" if packed else "uint16_t",
        "saturates": any(act["kind"] == "tanh" for act in acts),
        "table_note": _table_note(net),
        "activations": list({act["id"]: act for act in acts}.values()),
        "hidden": [
            {
                "id": f"h{number + 1}",
                "units": len(layer.bias),
                "inputs": layer.matrix.shape[1],
                "rows": layer.weight,
                **_biases(layer, origins[number]),
                "source": sources[number],
                "shift": layer.shift,
                "offset_shift": net.bits - 1 - layer.shift,
                "act": acts[number]["call"],
            }
            for number, layer in enumerate(hidden)
        ],
        "fused": {
            **_fused(net, fused, last, origins[len(hidden)]),
            "source": sources[len(hidden)],
            "act": acts[len(hidden)]["call"],
        },
        "signed_outputs": not last.unsigned,
        "out_shift": last.shift,
        "out_offset_shift": net.bits - 1 - last.shift,
    }


def vectors_view(
    net: IntNetwork, rows: Sequence[tuple[Sequence[int], Sequence[int]]]
) -> dict[str, Any]:
    """What NAME_vectors.h shows: ``rows`` of codes and estimates."""
    return {
        "name": net.name,
        "digest": net.digest,
        "guard": f"{net.name.upper()}_SOFTSENSE_VECTORS_H",
        "rows": rows,
    }


def label(text: str) -> str:
    """``text`` as it may stand in a C comment or string: names in files are anybody's."""
    return re.sub(r"[^\w .,:;=()+\-°%/|*]|\*/|/\*|,(?! )", "_", text, flags=re.ASCII)


def accuracy_lines(net: IntNetwork) -> list[str]:
    """What is known of |fixed - float|, a line per output and kind."""
    if net.accuracy is None:
        return ["not measured"]
    lines = []
    for index, output in enumerate(net.outputs):
        worst, bound = net.accuracy.worst[index], net.accuracy.bound[index]
        codes = ", ".join(map(str, net.accuracy.worst_codes[index]))
        share = f"1/{output.full_scale / worst:.0f}" if worst > 0 else "0"
        how = (
            f"the maximum: all {net.accuracy.compared} inputs tried"
            if net.accuracy.exhaustive
            else f"worst of {net.accuracy.compared} inputs searched"
        )
        name = label(output.name)
        unit = label(output.unit)
        lines.append(f"{name}: {worst:.4g} {unit} = {share} of full scale at x = ({codes}),")
        lines.append(f"  {how}; proved without search: at most {bound:.4g} {unit}")
    return lines


def _biases(layer: IntLayer, origin: Any) -> dict[str, Any]:
    """A layer's biases as 16-bit words on a grid, once its inputs count from ``origin``."""
    moved = replace(layer, bias=tuple(int(b) for b in np.asarray(layer.bias) + origin))
    base, shift = moved.bias_grid
    return {
        "bias": [(b - base) >> shift for b in moved.bias],
        "whole_bias": [b % 2**32 for b in moved.bias],
        "bias_shift": shift,
        "base": base % 2**32,
    }


def _fused(net: IntNetwork, fused: IntLayer, last: IntLayer, origin: Any) -> dict[str, Any]:
    """The last hidden layer and the output layer, in one loop over the units."""
    width = fused.matrix.shape[1]
    joined = net.bits == 16
    biases = _biases(fused, origin)

    def out(value: int) -> str:
        return f"{value}" if last.unsigned else f"W({value})"

    rows = [
        [f"W({w})" for w in row]
        + ([str(biases["bias"][j])] if joined else [])
        + [out(weights[j]) for weights in last.weight]
        for j, row in enumerate(fused.weight)
    ]
    return {
        **biases,
        "units": len(fused.bias),
        "inputs": width,
        "joined": joined,
        "first_out": width + joined,
        "stride": len(rows[0]),
        "rows": rows,
        "pairs": [{"first": i, "second": i + 1, "both": i + 1 < width} for i in range(0, width, 2)],
        "dsp_stride": (width + 1) // 2 + 1 + len(net.outputs),
        "dsp_rows": [
            [f"W2({a}, {b})" for a, b in zip(row[::2], (*row[1::2], 0), strict=False)]
            + [f"{biases['whole_bias'][j]}u"]
            + [
                f"{weights[j] if last.unsigned else weights[j] + OFFSET_16}u"
                for weights in last.weight
            ]
            for j, row in enumerate(fused.weight)
        ],
        "input_sum": " + ".join(f"x{i}" for i in range(width)),
        "shift": fused.shift,
        "offset_shift": net.bits - 1 - fused.shift,
    }


def _activation(net: IntNetwork, layer: IntLayer) -> dict[str, Any]:
    """The function of a hidden layer; layers of the same kind and scale share it."""
    scaled = f"z >> {layer.fine}" if layer.fine > 0 else "z"
    if layer.fine < 0:
        scaled = f"z << {-layer.fine}"
    if layer.activation == "relu":
        name = f"relu_{layer.fine}".replace("-", "m")
        return {"id": name, "call": f"{name}(z)", "kind": "relu", "scaled": scaled}
    assert net.table is not None
    name = f"tanh_{layer.fine}".replace("-", "m")
    return {
        "id": name,
        "call": f"{name}(z, entries)",
        "kind": "tanh",
        "bits": layer.clip_at(net.table).bit_length(),
        "index_shift": FRACTION_BITS + layer.fine,
        "fraction": f"({scaled})" if layer.fine else "z",
    }


def _ratio_bits(table: Table) -> int:
    """The logarithm (base 2) of how many entries are made per stored node."""
    return 0 if table.nodes is None else (table.segments // NODE_SEGMENTS).bit_length() - 1


def _table(net: IntNetwork, packed: bool) -> list[str]:
    if net.table is None:
        return []
    entries = net.table.entries
    if not packed:
        return [str(entry) for entry in net.table.nodes or entries]
    return [f"{(a << 16) + b - a}u" for a, b in pairwise(entries)]


def table_bytes(net: IntNetwork, optimise: Optimise) -> int:
    """Bytes of the table of tanh as ``optimise`` lays it out."""
    packed = optimise == "speed"
    return len(_table(net, packed)) * (4 if packed else 2)


def _weight_bytes(net: IntNetwork) -> int:
    weights = sum(layer.matrix.size for layer in net.layers) * net.bits // 8
    return weights + sum(2 * len(layer.bias) for layer in net.layers[:-1])


def _table_note(net: IntNetwork) -> str:
    if net.table is None:
        return ""
    return (
        f"(1 + tanh z) * 2^15 for z = {-net.table.reach:.6g} ... {net.table.reach:.6g} in "
        f"{net.table.segments} steps; with interpolation within "
        f"{table_error(net.table, net.table.reach):.2g} of tanh"
    )


def _stack_note(net: IntNetwork, looped: bool) -> str:
    size = sum(4 * len(layer.bias) for layer in net.layers[:-2])
    size += 4 * len(net.inputs) if looped else 0
    return f"about {64 + size} bytes of stack"

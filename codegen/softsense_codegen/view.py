"""What the templates need to know of a network, worked out: no arithmetic in templates."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from softsense_codegen import bounds
from softsense_codegen.errors import SoftsenseError
from softsense_codegen.fixed import FRACTION_BITS, table_error
from softsense_codegen.network import IntLayer, IntNetwork

# Up to this many inputs the loop over them is written out.
UNROLL = 8


def network_view(net: IntNetwork, cost_lines: Sequence[str] = ()) -> dict[str, Any]:
    """Everything that NAME.h and NAME.c show.

    Raises ``SoftsenseError`` where 32 bits do not suffice (see ``bounds.prove``).
    """
    proofs = bounds.prove(net)
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
    many_inputs = len(net.inputs) > UNROLL or bool(hidden)
    unsigned = last.unsigned
    unrolled = not many_inputs and not hidden
    width = fused.matrix.shape[1]
    acts = _activations(net, proofs)
    ids = [f"h{number + 1}" for number in range(len(hidden))]
    sources = ["in", *ids]
    word_bytes = net.bits // 8
    weights = sum(layer.matrix.size for layer in net.layers) * word_bytes
    biases = 4 * sum(len(layer.bias) for layer in net.layers)
    return {
        "name": net.name,
        "upper": net.name.upper() if net.name.upper() != net.name else "",
        "guard": f"{net.name.upper()}_SOFTSENSE_H",
        "digest": net.digest,
        "inputs": [
            {"name": label(i.name), "low": i.low, "high": i.high, "front_end": label(i.front_end)}
            for i in net.inputs
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
        "weight_bytes": weights + biases,
        "table_bytes": 0 if net.table is None else 2 * len(net.table.entries),
        "stack_note": _stack_note(net, many_inputs),
        "word": f"uint{net.bits}_t",
        "offset": 2 ** (net.bits - 1),
        "dsp": unrolled and net.bits == 16 and fused.shift == 0,
        "many_inputs": many_inputs,
        "table": [] if net.table is None else net.table.entries,
        "table_note": _table_note(net),
        "activations": list({act["id"]: act for act in acts}.values()),
        "hidden": [
            {
                "id": ids[number],
                "units": len(layer.bias),
                "inputs": layer.matrix.shape[1],
                "rows": layer.weight,
                "bias": [b % 2**32 for b in layer.bias],
                "source": sources[number],
                "shift": layer.shift,
                "offset_shift": net.bits - 1 - layer.shift,
                "act": acts[number]["id"],
            }
            for number, layer in enumerate(hidden)
        ],
        "fused": {
            "units": len(fused.bias),
            "inputs": width,
            "stride": width + len(net.outputs),
            "rows": _unit_rows(fused, last, unsigned),
            "pairs": [
                {"first": i, "second": i + 1 if i + 1 < width else "z", "both": i + 1 < width}
                for i in range(0, width, 2)
            ],
            "pair_rows": [
                [f"W2({a}, {b})" for a, b in zip(row[::2], (*row[1::2], 0), strict=False)]
                for row in fused.weight
            ],
            "out_rows": [
                [_out(row[j], unsigned) for row in last.weight] for j in range(len(fused.bias))
            ],
            "bias": [b % 2**32 for b in fused.bias],
            "source": sources[len(hidden)],
            "unrolled": unrolled,
            "terms": [f"(uint32_t)unit[{i}] * x{i}" for i in range(width)] if unrolled else [],
            "input_sum": " + ".join(f"x{i}" for i in range(width)) if unrolled else "",
            "shift": fused.shift,
            "offset_shift": net.bits - 1 - fused.shift,
            "act": acts[len(hidden)]["id"],
        },
        "signed_outputs": not unsigned,
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


def _out(value: int, unsigned: bool) -> str:
    return f"{value}" if unsigned else f"W({value})"


def _unit_rows(fused: IntLayer, last: IntLayer, unsigned: bool) -> list[list[str]]:
    return [
        [f"W({w})" for w in row] + [_out(out[j], unsigned) for out in last.weight]
        for j, row in enumerate(fused.weight)
    ]


def _activations(net: IntNetwork, proofs: tuple[bounds.LayerBounds, ...]) -> list[dict[str, Any]]:
    """One entry per hidden layer; layers of the same kind and scale share a function."""
    result = []
    for layer, proof in zip(net.layers[:-1], proofs, strict=False):
        if layer.activation == "tanh":
            assert net.table is not None
            fraction = f"(z >> {layer.fine})" if layer.fine > 0 else "z"
            if layer.fine < 0:
                fraction = f"(z << {-layer.fine})"
            result.append(
                {
                    "id": f"tanh_{layer.fine}".replace("-", "m") + ("c" if proof.clips else ""),
                    "kind": "tanh",
                    "clips": proof.clips,
                    "last": layer.clip_at(net.table),
                    "index_shift": FRACTION_BITS + layer.fine,
                    "fraction": fraction,
                    "note": "(1 + tanh) * 2^15 of a sum, by the table; "
                    + (
                        "clipped to its ends."
                        if proof.clips
                        else "no sum can leave it (proved for all inputs)."
                    ),
                }
            )
        else:
            scaled = f"z >> {layer.fine}" if layer.fine > 0 else "z"
            if layer.fine < 0:
                scaled = f"z << {-layer.fine}"
            result.append(
                {
                    "id": f"relu_{layer.fine}".replace("-", "m"),
                    "kind": "relu",
                    "scaled": scaled,
                    "note": "A sum, or 0 where it is negative, in 16 bits.",
                }
            )
    return result


def _table_note(net: IntNetwork) -> str:
    if net.table is None:
        return ""
    return (
        f"(1 + tanh z) * 2^15 for z = {-net.table.reach:.6g} ... {net.table.reach:.6g} in "
        f"{net.table.segments} steps; with interpolation within "
        f"{table_error(net.table, net.table.reach):.2g} of tanh"
    )


def _stack_note(net: IntNetwork, many_inputs: bool) -> str:
    size = sum(4 * len(layer.bias) for layer in net.layers[:-2])
    size += 4 * len(net.inputs) if many_inputs else 0
    return f"about {64 + size} bytes of stack"

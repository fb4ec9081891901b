"""From a float network to integers that say the same to half a 12-bit step, everywhere.

Rounding each weight to its nearest integer adds up; here the parameters are rounded one after the
other and those not yet rounded absorb the error by least squares, in the metric of the network's
output over the whole calibrated box (Gauss-Newton; Hassibi and Stork 1993, Frantar et al. 2022,
eq. 3). Last, the output weights are fitted to the float network through the hidden layer as the
device computes it, which takes up most of what the table of tanh leaves.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular

from softsense.errors import SoftsenseError
from softsense.mlp import Layer, Mlp, activate
from softsense.notebook import Shown
from softsense_codegen import bounds, reference
from softsense_codegen.fixed import ACTIVATION_MAX, ONE, Table, table_error, tanh_table
from softsense_codegen.network import (
    Accuracy,
    Activation,
    Input,
    IntLayer,
    IntNetwork,
    Output,
    bias_words,
    c_name,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Progress = Callable[[float], None]

# The promise: half a step of a 12-bit reading, as a share of full scale.
TOLERANCE = 1.0 / 8192.0
# Tables (segments, nodes that small code stores) are tried from small to large; the first that
# keeps the promise is taken. Entries that are not made between nodes lie closer to tanh.
TABLES = ((128, 128), (256, 128), (512, 128), (1024, 128), (1024, 1024), (2048, 2048))
# tanh is cut beyond a reach within these limits (or sooner, where no unit reaches that far).
REACHES = (3.5, 8.0)
DAMPING = (1e-6,)
RIDGES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
SAMPLE = 4000
# A search on a sample finds less than the whole box holds; demand this share of the tolerance.
SAMPLE_SHARE = 0.75
WORTH_IT = 0.9
# Above this many parameters the Gauss-Newton matrix is too large to be worth it.
MAX_COMPENSATED = 4000


@dataclass(frozen=True, repr=False)
class Quantised(Shown):
    """An integer network and what was measured of it.

    ``network.accuracy`` holds the worst |fixed - float|; ``share`` is its largest, as a share of
    full scale; ``reached`` says whether that is at most ``tolerance`` (1/8192). ``table_error``:
    worst |table - tanh| over all arguments that occur.
    """

    network: IntNetwork
    share: float
    reached: bool
    tolerance: float
    table_error: float

    def verdict(self) -> str:
        """One sentence: the difference found, how, and whether it is within the tolerance."""
        accuracy = self.network.accuracy
        assert accuracy is not None
        how = "every input of the box" if accuracy.exhaustive else f"{accuracy.compared} inputs"
        parts = f"1/{1 / self.share:.0f}" if self.share > 0 else "0"
        verdict = f"fixed - float is at most {parts} of full scale ({how})"
        if self.reached:
            return f"{verdict}, within 1/{1 / self.tolerance:.0f}"
        factor = self.share / self.tolerance
        return f"{verdict}: {factor:.2f} times the 1/{1 / self.tolerance:.0f} that was aimed at"

    def summary(self) -> list[tuple[str, str]]:
        """What a terminal or a notebook shows of it."""
        return [
            ("network", self.network.name),
            ("weights", f"{self.network.bits} bits"),
            ("verdict", self.verdict()),
            ("digest", self.network.digest[:16]),
        ]


@dataclass(frozen=True)
class _Affine:
    """A layer in plain form: z = weight @ a + bias on raw codes or real activations."""

    weight: Floats
    bias: Floats
    activation: Activation


def quantise(
    mlp: Mlp,
    codes: ArrayLike,
    *,
    name: str = "model",
    bits: int = 16,
    tolerance: float = TOLERANCE,
    seed: int = 0,
    progress: Progress | None = None,
) -> Quantised:
    """The integer network of ``mlp`` with weights of ``bits`` (8 or 16) bits.

    ``codes``: (samples, inputs) codes that the network is used on; the box of calibrated ranges is
    sampled besides. ``tolerance`` is the share of full scale that |fixed - float| should stay
    below. With one or two inputs the worst difference is found by trying every code.

    Raises ``SoftsenseError`` for another word length or weights that 32 bits cannot take.
    """
    if bits not in (8, 16):
        raise SoftsenseError(f"weights of {bits} bits are not made", remedy="choose 8 or 16")
    data = np.atleast_2d(np.asarray(codes, dtype=np.int64))
    if data.shape[1] != len(mlp.inputs):
        raise ValueError(f"codes {data.shape} for {len(mlp.inputs)} inputs")
    for number, layer in enumerate(mlp.layers):
        if not (np.isfinite(layer.weight).all() and np.isfinite(layer.bias).all()):
            raise SoftsenseError(
                f"layer {number + 1} has weights that are not finite", remedy="train again"
            )
    rng = np.random.default_rng(seed)
    plain = _plain(mlp)
    fit_points = _points(mlp, data, rng)
    check_points = _points(mlp, data, rng)
    tanh = any(layer.activation == "tanh" for layer in plain)
    best: IntNetwork | None = None
    best_share = np.inf
    choices = TABLES if tanh else (None,)
    for number, choice in enumerate(choices):
        table = None if choice is None else _best_table(mlp, plain, *choice, check_points)
        for damping in DAMPING:
            network = _round(mlp, plain, table, fit_points, bits, damping, c_name(name))
            share = _worst_share(mlp, network, check_points)
            # A larger table must earn its flash.
            if share < WORTH_IT * best_share:
                best, best_share = network, share
        if progress is not None:
            progress((number + 1) / (len(choices) + 1))
        if best_share <= SAMPLE_SHARE * tolerance:
            assert best is not None
            best = _measured(mlp, plain, best, data, seed)
            # The search finds more than the sample held.
            best_share = _share(best)
            if best_share <= tolerance:
                break
    assert best is not None
    if best.accuracy is None:
        best = _measured(mlp, plain, best, data, seed)
    share = _share(best)
    error = _table_error(best)
    return Quantised(best, share, share <= tolerance, tolerance, error)


def _measured(
    mlp: Mlp, plain: list[_Affine], network: IntNetwork, data: Integers, seed: int
) -> IntNetwork:
    """``network``, proved to fit 32 bits, with its accuracy."""
    bounds.prove(network)
    return replace(network, accuracy=measure(mlp, plain, network, data, seed))


def _share(network: IntNetwork) -> float:
    """The largest difference that was measured, as a share of full scale."""
    assert network.accuracy is not None
    return max(
        worst / output.full_scale
        for worst, output in zip(network.accuracy.worst, network.outputs, strict=True)
    )


def _plain(mlp: Mlp) -> list[_Affine]:
    """``mlp`` on raw codes and in target units, of tanh, relu and one last linear layer."""
    layers: list[_Affine] = []
    weight = np.diag([i.scale for i in mlp.inputs])
    bias = np.array([-i.scale * i.offset for i in mlp.inputs])
    outputs = Layer(
        np.diag([o.scale for o in mlp.outputs]), np.array([o.offset for o in mlp.outputs]), "linear"
    )
    for layer in (*mlp.layers, outputs):
        # A pending linear map (weight, bias) is multiplied into the layer that follows it.
        bias = layer.weight @ bias + layer.bias
        weight = layer.weight @ weight
        if layer.activation == "linear":
            continue
        if layer.activation == "sigmoid":
            # 1 / (1 + exp(-z)) = (1 + tanh(z / 2)) / 2
            layers.append(_Affine(weight / 2, bias / 2, "tanh"))
            weight, bias = np.eye(len(bias)) / 2, np.full(len(bias), 0.5)
        else:
            layers.append(_Affine(weight, bias, layer.activation))
            weight, bias = np.eye(len(bias)), np.zeros(len(bias))
    if len(mlp.outputs) == 1 and layers and layers[-1].activation == "tanh":
        # tanh is odd: turn units around so that no output weight is negative, which doubles the
        # resolution of a word and spares the device sign extensions.
        sign = np.where(weight[0] < 0, -1.0, 1.0)
        layers[-1] = _Affine(layers[-1].weight * sign[:, None], layers[-1].bias * sign, "tanh")
        weight = weight * sign
    layers.append(_Affine(weight, bias, "linear"))
    return layers


def _points(mlp: Mlp, data: Integers, rng: np.random.Generator) -> Integers:
    """Codes over the whole box: uniform, on faces and corners, and as recorded."""
    low = np.array([i.low for i in mlp.inputs])
    high = np.array([i.high for i in mlp.inputs])
    uniform = rng.integers(low, high, size=(SAMPLE // 2, len(low)), endpoint=True)
    faces = rng.integers(low, high, size=(SAMPLE // 4, len(low)), endpoint=True)
    draw = rng.random(faces.shape)
    faces = np.where(draw < 0.25, low, np.where(draw > 0.75, high, faces))
    recorded = data[rng.integers(0, len(data), size=SAMPLE // 4)]
    return np.concatenate([uniform, faces, np.clip(recorded, low, high)])


def _best_table(
    mlp: Mlp, plain: list[_Affine], segments: int, nodes: int, points: Integers
) -> Table:
    """The reach that serves this network best: beyond it tanh is cut, within it steps grow."""
    needed = 1e-3
    a_low = np.array([float(i.low) for i in mlp.inputs])
    a_high = np.array([float(i.high) for i in mlp.inputs])
    for layer in plain:
        ends = np.stack([layer.weight * a_low, layer.weight * a_high])
        z_low = ends.min(axis=0).sum(axis=1) + layer.bias
        z_high = ends.max(axis=0).sum(axis=1) + layer.bias
        if layer.activation == "tanh":
            needed = max(needed, float(np.abs([z_low, z_high]).max()))
        a_low, a_high = activate(layer.activation, z_low), activate(layer.activation, z_high)
    reaches = np.linspace(min(needed, REACHES[0]), min(needed, REACHES[1]), 10)
    truth = mlp.predict(points)

    def error(table: Table) -> float:
        a = points.astype(np.float64)
        for layer in plain:
            z = a @ layer.weight.T + layer.bias
            if layer.activation == "tanh":
                position = (z + table.reach) / table.step * 2.0**16
                a = table.read(np.clip(position, 0, table.last).astype(np.int64)) / ONE - 1.0
            else:
                a = activate(layer.activation, z)
        return float(np.abs((a - truth) / _full_scale(mlp)).max())

    return min((tanh_table(float(reach), segments, nodes) for reach in reaches), key=error)


def _full_scale(mlp: Mlp) -> Floats:
    return np.array([o.high - o.low for o in mlp.outputs])


def _round(
    mlp: Mlp,
    plain: list[_Affine],
    table: Table | None,
    points: Integers,
    bits: int,
    damping: float,
    name: str,
) -> IntNetwork:
    """Integers for ``plain``, with compensation where the network is small enough."""
    parameters = sum(layer.weight.size + layer.bias.size for layer in plain)
    inputs = tuple(Input(i.name, i.low, i.high, i.front_end) for i in mlp.inputs)
    word = 2.0 ** (bits - 1) - 1
    middles = [(i.low + i.high) // 2 for i in inputs]
    layers: list[IntLayer] = []
    a = reference.clip_codes(_shell(inputs), points)
    unit, zero = 1.0, 0.0  # a real activation is unit * a + zero
    bound = (np.array([i.low for i in inputs]), np.array([i.high for i in inputs]))
    floats = list(plain)
    for depth, layer in enumerate(plain[:-1]):
        layer = floats[depth]
        scale = _layer_scale(layer, table, unit, zero, bound, bits, first=depth == 0)
        if parameters <= MAX_COMPENSATED:
            weight, rest = _compensate(floats, depth, points, scale.weight, word, damping)
            floats[depth:] = rest
            bias = floats[depth].bias
        else:
            weight, bias = np.rint(layer.weight * scale.weight), layer.bias
        real_zero = zero * weight.sum(axis=1) / scale.weight  # what the activations' zero adds
        middle = weight @ middles if depth == 0 else np.zeros(len(bias))
        exact = (bias + real_zero + scale.origin) * scale.z
        z_bias = bias_words(exact + middle) - middle
        made = IntLayer(
            _tuples(weight),
            tuple(int(b) for b in z_bias),
            scale.shift,
            scale.activation,
            scale.fine,
        )
        shell = _shell(inputs, table)
        a = reference.activations(shell, made, a)
        layers.append(made)
        unit, zero = scale.unit, scale.zero
        bound = (np.zeros(len(bias)), np.full(len(bias), float(ACTIVATION_MAX)))
    last, outputs = _last_layer(mlp, floats[-1], a, points, bits, unit, zero)
    return IntNetwork(name, bits, inputs, outputs, (*layers, last), table)


@dataclass(frozen=True)
class _Scale:
    """How a hidden layer's reals become integers."""

    weight: float  # integer weight per real weight
    z: float  # integer sum per real sum
    origin: float  # added to the real sum (the table counts from -reach)
    shift: int
    fine: int
    activation: Activation
    unit: float
    zero: float


def _layer_scale(
    layer: _Affine,
    table: Table | None,
    unit: float,
    zero: float,
    bound: tuple[Floats, Floats],
    bits: int,
    first: bool,
) -> _Scale:
    """The largest scales that fit the word of the weights and 32 bits of the sums."""
    largest = float(np.abs(layer.weight).max())
    if largest == 0.0:
        raise SoftsenseError("a layer's weights are all zero", remedy="train again")
    word = 2.0 ** (bits - 1) - 1
    ends = np.stack(
        [layer.weight * (unit * bound[0] + zero), layer.weight * (unit * bound[1] + zero)]
    )
    top = ends.max(axis=0).sum(axis=1) + layer.bias
    bottom = ends.min(axis=0).sum(axis=1) + layer.bias
    if layer.activation == "tanh":
        assert table is not None
        base, origin, next_unit, next_zero = 2.0**16 / table.step, table.reach, 1.0 / ONE, -1.0
    else:
        reach = max(float(top.max()), 1e-9)
        base, origin, next_unit, next_zero = (
            ACTIVATION_MAX / reach,
            0.0,
            reach / ACTIVATION_MAX,
            0.0,
        )
    sum_limit = 2.0**30 / (float(np.abs([top, bottom]).max()) + origin)
    if first:
        # No shift of products: the sum's unit is the product's unit.
        fine = int(np.floor(np.log2(min(word / (largest * unit * base), sum_limit / base)) + 1e-9))
        fine = max(min(fine, 12), -14)
        z = base * 2.0**fine
        if largest * unit * z > word + 0.5:
            raise SoftsenseError(
                f"a weight of {largest * unit:.3g} per code is too steep for {bits} bits",
                remedy="train with more weight decay, or use --bits 16",
            )
        return _Scale(z, z, origin, 0, fine, layer.activation, next_unit, next_zero)
    fine = max(min(int(np.floor(np.log2(sum_limit / base))), 8), -14)
    z = base * 2.0**fine
    shift = max(int(np.floor(np.log2(word / (largest * unit * z)))), 0)
    if largest * unit * z * 2.0**shift > word:
        raise SoftsenseError(
            "a hidden layer's weights are too steep", remedy="train with more weight decay"
        )
    return _Scale(
        unit * z * 2.0**shift, z, origin, shift, fine, layer.activation, next_unit, next_zero
    )


def _compensate(
    floats: list[_Affine], depth: int, points: Integers, scale: float, word: float, damping: float
) -> tuple[Floats, list[_Affine]]:
    """Round the weights of layer ``depth`` one by one; all later parameters absorb the error.

    Returns the integer weights, and the layers from ``depth`` on with what they absorbed.
    """
    jacobian, parameters = _jacobian(floats, depth, points)
    weights = floats[depth].weight.size
    step = np.full(len(parameters), 1.0 / scale)
    step[weights:] = 0.0  # biases are fine enough and later layers come later
    rounded = _round_in_order(jacobian, parameters, step, (-word, word), weights, damping)
    result: list[_Affine] = []
    used = 0
    for layer in floats[depth:]:
        size = layer.weight.size
        weight = rounded[used : used + size].reshape(layer.weight.shape)
        bias = rounded[used + size : used + size + len(layer.bias)]
        used += size + len(layer.bias)
        result.append(_Affine(weight, bias, layer.activation))
    return np.rint(result[0].weight * scale), result


def _round_in_order(
    jacobian: Floats,
    parameters: Floats,
    step: Floats,
    words: tuple[float, float],
    count: int,
    damping: float,
) -> Floats:
    """Round the first ``count`` parameters to ``words`` (least, largest) times ``step``.

    What is not yet rounded absorbs the error.

    After Frantar et al. 2022 ("Optimal Brain Compression"), eq. 3, by the Cholesky factor of the
    inverse Gauss-Newton matrix. The most influential parameters come first.
    """
    scale = np.sqrt((jacobian**2).mean(axis=0)) + 1e-300
    order = np.concatenate(
        [np.argsort(-scale[:count] * step[:count]), np.arange(count, len(scale))]
    )
    normal = jacobian[:, order] / scale[order]
    hessian = normal.T @ normal / len(normal)
    hessian[np.diag_indices_from(hessian)] += damping
    # The upper Cholesky factor of the inverse, from the factor of the reversed matrix: this never
    # inverts, and so stays definite where units are nearly alike.
    reversed_factor = np.linalg.cholesky(hessian[::-1, ::-1])
    identity = np.eye(len(hessian))
    factor = solve_triangular(reversed_factor, identity, lower=True)[::-1, ::-1]
    values = parameters[order] * scale[order]
    steps = step[order] * scale[order]
    for index in range(count):
        word = min(max(np.rint(values[index] / steps[index]), words[0]), words[1])
        target = word * steps[index]
        error = (values[index] - target) / factor[index, index]
        values[index:] -= error * factor[index, index:]
        values[index] = target
    result = np.empty_like(parameters)
    result[order] = values / scale[order]
    return result


def _jacobian(floats: list[_Affine], depth: int, points: Integers) -> tuple[Floats, Floats]:
    """d output / d parameters (points * outputs, parameters) of the layers from ``depth`` on.

    Outputs are in units of their own spread. Returns the parameters besides, in the same order:
    weights (row by row), then biases, layer by layer.
    """
    inputs: list[Floats] = []
    slopes: list[Floats] = []
    a = points.astype(np.float64)
    for layer in floats:
        inputs.append(a)
        a = activate(layer.activation, a @ layer.weight.T + layer.bias)
        if layer.activation == "tanh":
            slopes.append(1.0 - a**2)
        elif layer.activation == "relu":
            slopes.append((a > 0).astype(np.float64))
        else:
            slopes.append(np.ones_like(a))
    spread = a.std(axis=0) + 1e-300
    blocks = []
    for output in range(a.shape[1]):
        back = np.zeros_like(a)
        back[:, output] = 1.0 / spread[output]
        columns: list[Floats] = []
        for number in range(len(floats) - 1, depth - 1, -1):
            back = back * slopes[number]
            product = (back[:, :, None] * inputs[number][:, None, :]).reshape(len(a), -1)
            columns = [product, back, *columns]
            back = back @ floats[number].weight
        blocks.append(np.concatenate(columns, axis=1))
    parameters = np.concatenate(
        [part for layer in floats[depth:] for part in (layer.weight.ravel(), layer.bias)]
    )
    return np.concatenate(blocks), parameters


def _last_layer(
    mlp: Mlp,
    last: _Affine,
    a: Integers,
    points: Integers,
    bits: int,
    unit: float,
    zero: float,
) -> tuple[IntLayer, tuple[Output, ...]]:
    """Output weights fitted to the float network through the integer activations ``a``."""
    truth = mlp.predict(points)
    full = _full_scale(mlp)
    real = (a * unit + zero).astype(np.float64)
    unsigned = bool(last.weight.min() >= 0)
    word = 2.0**bits - 1 if unsigned else 2.0 ** (bits - 1) - 1
    words = (0.0 if unsigned else -word, word)
    rows = [
        _output_row(real, last.weight[o], float(last.bias[o]), truth[:, o], words)
        for o in range(len(full))
    ]
    weight = np.stack([row for row, _ in rows])
    step = np.array([step for _, step in rows])
    # The least shift for which the sum of all products, in either direction, keeps 2**30.
    reach = max(float(np.abs(weight).sum(axis=1).max()) * ACTIVATION_MAX, 1.0)
    shift = max(int(np.ceil(np.log2(reach / 2.0**30))), 0)
    lsb = step * unit * 2.0**shift
    bare = IntLayer(_tuples(weight), (0,) * len(full), shift, "linear")
    sums = reference.arguments(bare, a)
    outputs, biases = [], []
    for output, meant in enumerate(mlp.outputs):
        miss = truth[:, output] / lsb[output] - sums[:, output]
        middle = (float(miss.max()) + float(miss.min())) / 2.0
        # Zero is a round 0 unless the offset would leave 32 bits.
        shifted = 0 if abs(middle) < 2.0**29 else -int(np.rint(middle))
        outputs.append(
            Output(meant.name, meant.unit, float(lsb[output]), shifted, float(full[output]))
        )
        biases.append(int(np.rint(middle + shifted)))
    return IntLayer(_tuples(weight), tuple(biases), shift, "linear"), tuple(outputs)


def _output_row(
    a: Floats, weight: Floats, bias: float, truth: Floats, words: tuple[float, float]
) -> tuple[Floats, float]:
    """One output's integer weights on real activations ``a`` (points, units), and their step."""
    spread = a.std(axis=0) + 1e-12
    design = np.concatenate([a / spread, np.ones((len(a), 1))], axis=1)
    begin = np.append(weight * spread, bias)
    begin[-1] += float((truth - design @ begin).mean())
    step = float(np.abs(weight).max()) / (0.98 * words[1]) or 1.0
    steps = np.append(step * spread, 0.0)
    best, best_worst = np.rint(weight / step), np.inf
    for ridge in RIDGES:
        fitted = _least_maximum(design, begin, truth, ridge)
        rounded = _round_in_order(design, fitted, steps, words, len(weight), ridge)
        miss = truth - design @ rounded
        worst = float(miss.max() - miss.min())
        if worst < best_worst:
            best, best_worst = np.rint(rounded[:-1] / steps[:-1]), worst
    return best, step


def _least_maximum(design: Floats, begin: Floats, truth: Floats, ridge: float) -> Floats:
    """Weights near ``begin`` with a small largest |truth - design @ weights|.

    Lawson's iteration (1961): least squares, reweighted by the error that is left.
    """
    miss = truth - design @ begin
    share = np.ones(len(truth))
    best, best_worst = begin, float(np.abs(miss).max())
    for _ in range(12):
        normal = design.T @ (design * share[:, None]) / len(truth)
        normal[np.diag_indices_from(normal)] += ridge
        change = np.linalg.solve(normal, design.T @ (share * miss) / len(truth))
        left = np.abs(miss - design @ change)
        if left.max() < best_worst:
            best, best_worst = begin + change, float(left.max())
        share *= 0.1 + left / (left.mean() + 1e-300)
        share /= share.mean()
    return best


def _tuples(weight: Floats) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(int(w) for w in row) for row in weight)


def _shell(inputs: tuple[Input, ...], table: Table | None = None) -> IntNetwork:
    """A network that only carries inputs and table, to run single layers by."""
    identity = tuple(tuple(int(i == j) for j in range(len(inputs))) for i in range(len(inputs)))
    outputs = tuple(Output(i.name, "1", 1.0, 0, 1.0) for i in inputs)
    layer = IntLayer(identity, (0,) * len(inputs), 0, "linear")
    return IntNetwork("shell", 16, inputs, outputs, (layer,), table)


def _worst_share(mlp: Mlp, network: IntNetwork, points: Integers) -> float:
    fixed = reference.values(network, reference.estimate(network, points))
    return float((np.abs(fixed - mlp.predict(points)) / _full_scale(mlp)).max())


def measure(
    mlp: Mlp, plain: list[_Affine], network: IntNetwork, data: Integers, seed: int = 0
) -> Accuracy:
    """The worst |fixed - float| per output over the calibrated box, and a proved bound.

    One or two inputs: every code. More: random codes, the recorded ones and corners, then ascent
    along single codes from the worst of them.
    """
    exhaustive = len(network.inputs) <= 2
    worst = np.zeros(len(network.outputs))
    where = np.zeros((len(worst), len(network.inputs)), dtype=np.int64)
    compared = 0

    def keep(error: Floats, codes: Integers) -> None:
        for output, row in enumerate(error.argmax(axis=0)):
            if error[row, output] > worst[output]:
                worst[output] = error[row, output]
                where[output] = codes[row]

    def compare(codes: Integers) -> Floats:
        nonlocal compared
        compared += len(codes)
        error = _difference(mlp, network, codes)
        keep(error, codes)
        return error

    if exhaustive:
        for error, codes in _every_code(mlp, network):
            compared += len(codes)
            keep(error, codes)
    else:
        _search(network, data, compare, np.random.default_rng([seed, 1]))
    return Accuracy(
        tuple(float(w) for w in worst),
        tuple(tuple(int(code) for code in codes) for codes in where),
        exhaustive,
        compared,
        tuple(float(b) for b in _proved_bound(plain, network)),
    )


def _difference(mlp: Mlp, network: IntNetwork, codes: Integers) -> Floats:
    """|fixed - float| (samples, outputs) in the outputs' units."""
    return np.abs(
        reference.values(network, reference.estimate(network, codes)) - mlp.predict(codes)
    )


def _every_code(mlp: Mlp, network: IntNetwork) -> Iterator[tuple[Floats, Integers]]:
    """The differences at every code of a box of one or two inputs, slab by slab."""
    first, *rest = [np.arange(i.low, i.high + 1) for i in network.inputs]
    # Slabs that keep (samples, units) arrays in the cache; numpy runs them on all cores.
    rows = max(reference.CHUNK // (len(rest[0]) if rest else 1), 1)

    def slab(start: int) -> tuple[Floats, Integers]:
        grid = np.meshgrid(first[start : start + rows], *rest, indexing="ij")
        codes = np.stack([g.ravel() for g in grid], axis=1)
        return _difference(mlp, network, codes), codes

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        yield from pool.map(slab, range(0, len(first), rows))


def _search(
    network: IntNetwork,
    data: Integers,
    compare: Callable[[Integers], Floats],
    rng: np.random.Generator,
) -> None:
    """Look for the worst codes of the box; ``compare`` keeps them."""
    low = np.array([i.low for i in network.inputs])
    high = np.array([i.high for i in network.inputs])
    corners = np.where(rng.random((4096, len(low))) < 0.5, low, high)
    starts = np.concatenate(
        [
            rng.integers(low, high, size=(60_000, len(low)), endpoint=True),
            np.clip(data, low, high),
            corners,
        ]
    )
    full = np.array([o.full_scale for o in network.outputs])
    error = (compare(starts) / full).max(axis=1)
    seeds = starts[np.argsort(-error)[:64]]
    best = np.sort(error)[::-1][:64]
    # Growing and shrinking steps along one code at a time, all seeds at once.
    for stride in (256, 64, 16, 4, 1, 64, 16, 4, 1):
        for column in range(len(low)):
            for sign in (-stride, stride):
                moved = seeds.copy()
                moved[:, column] = np.clip(moved[:, column] + sign, low[column], high[column])
                found = (compare(moved) / full).max(axis=1)
                better = found > best
                seeds[better], best[better] = moved[better], found[better]


def _table_error(network: IntNetwork) -> float:
    """Worst |table - tanh| for every argument that some unit can have within the box."""
    if network.table is None:
        return 0.0
    needed = 0.0
    for layer, proof in zip(network.layers, bounds.prove(network), strict=True):
        if layer.activation == "tanh":
            unit = network.table.step / 2.0 ** (16 + layer.fine)
            ends = np.abs(np.array(proof.total) * unit - network.table.reach)
            needed = max(needed, float(ends.max()))
    return table_error(network.table, needed)


def _proved_bound(plain: list[_Affine], network: IntNetwork) -> Floats:
    """|fixed - float| over the whole box, by adding up every rounding (no search).

    tanh and relu are 1-Lipschitz; a unit's argument differs by a function linear in the layer's
    inputs, whose maximum over a box is exact. Cancellation between units is not used, so this is
    far above what is found, but nothing can exceed it.
    """
    low = np.array([float(i.low) for i in network.inputs])
    high = np.array([float(i.high) for i in network.inputs])
    miss = np.zeros(len(low))
    unit, zero = 1.0, 0.0
    table_miss = _table_error(network)
    for layer, meant in zip(network.layers, plain, strict=True):
        if layer.activation == "tanh":
            assert network.table is not None
            z_unit = network.table.step / 2.0 ** (16 + layer.fine)
            origin = network.table.reach
        elif layer.activation == "relu":
            a_top = np.maximum(meant.weight * low, meant.weight * high).sum(axis=1) + meant.bias
            next_unit = max(float(a_top.max()), 1e-9) / ACTIVATION_MAX
            z_unit, origin = next_unit / 2.0**layer.fine, 0.0
        else:
            scale = np.array([o.lsb for o in network.outputs])
            z_unit, origin = 1.0, 0.0
        factor = scale if layer.activation == "linear" else np.full(len(layer.bias), z_unit)
        weight = layer.matrix / unit * factor[:, None] / 2.0**layer.shift
        bias = np.asarray(layer.bias) * factor - origin - zero * weight.sum(axis=1)
        if layer.activation == "linear":
            bias = bias - np.array([o.zero for o in network.outputs]) * scale
        change, constant = weight - meant.weight, bias - meant.bias
        upper = np.maximum(change * low, change * high).sum(axis=1) + constant
        lower = np.minimum(change * low, change * high).sum(axis=1) + constant
        dropped = factor * layer.matrix.shape[1] * (1.0 - 2.0**-layer.shift)
        next_miss = np.maximum(np.abs(upper), np.abs(lower - dropped)) + np.abs(weight) @ miss
        z_low = np.minimum(meant.weight * low, meant.weight * high).sum(axis=1) + meant.bias
        z_high = np.maximum(meant.weight * low, meant.weight * high).sum(axis=1) + meant.bias
        if layer.activation == "tanh":
            next_miss = np.minimum(next_miss, 2.0) + table_miss
            unit, zero = 1.0 / ONE, -1.0
        elif layer.activation == "relu":
            next_miss = next_miss + next_unit
            unit, zero = next_unit, 0.0
        low, high = activate(layer.activation, z_low), activate(layer.activation, z_high)
        miss = next_miss
    return miss

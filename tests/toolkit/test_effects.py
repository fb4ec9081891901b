"""The catalogue of effects: closed forms, invariances, and that a run may be cut anywhere."""

from __future__ import annotations

import importlib
import itertools
import pkgutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Barrier

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from softsense import effects
from softsense.diagnose import pricing
from softsense.diagnose.channel import Channel
from softsense.diagnose.nominal import history_basis, motion_of, nominals, reference_of
from softsense.effects import STRAIGHT, Candidate, Context, all_effects, effect, operators
from softsense.effects.hysteresis import _plane
from softsense.effects.operators import first_order_hold, low_pass
from softsense.effects.saturation import is_rail
from softsense.errors import SoftsenseError

DT_S = 0.05
NAMES = {
    *("hysteresis", "relaxation", "softening", "overshoot", "drift", "random_walk"),
    *("temperature", "gain", "step", "backlash", "delay", "lag", "saturation"),
    *("adc_nonlinearity", "crosstalk", "interference", "spikes", "noise"),
}
CASES = [(name, form) for name, one in all_effects().items() for form in one.forms]
# Linear in the signal at a given motion and time; additive random effects cancel in differences.
LINEAR = [
    *(("relaxation", form) for form in ("prony", "power_law")),
    *(("softening", form) for form in ("exponential", "ogden_roxburgh")),
    *(("gain", form) for form in ("constant", "time", "cycles")),
    *(("lag", form) for form in ("one_pole", "two_poles")),
    ("delay", ""),
    ("crosstalk", "scan"),
]
ADDITIVE = ["overshoot", "drift", "random_walk", "temperature", "interference", "spikes", "noise"]


def signal_of(seed: int, samples: int = 400, channels: int = 3) -> np.ndarray:
    """A wandering signal within 0 … 1."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal((samples, channels)), axis=0)
    return (walk - walk.min(axis=0)) / np.ptp(walk, axis=0)


def context_of(strain: np.ndarray, t0_s: float = 0.0, temp: bool = False, seed: int = 5) -> Context:
    return Context(
        DT_S,
        strain,
        t0_s,
        20.0 + strain if temp else None,
        rng=np.random.default_rng(seed),
    )


def test_the_catalogue_is_whole() -> None:
    assert set(all_effects()) == NAMES


def test_every_effect_documents_itself() -> None:
    for one in all_effects().values():
        assert one.mechanism
        assert "\n" not in one.mechanism
        assert one.equation
        assert one.source
        assert one.fingerprint
        assert one.stage in effects.STAGES
        assert one.parameters
        for parameter in one.parameters:
            assert parameter.unit
            assert parameter.meaning
            assert parameter.low < parameter.high
            zero_means_off = parameter.default == 0.0 or parameter.default == -1.0
            assert parameter.low <= parameter.default <= parameter.high or zero_means_off


def test_a_new_file_is_found_without_touching_another(tmp_path) -> None:
    (tmp_path / "squeak.py").write_text(
        "from softsense.effects import Effect, Parameter\n"
        "EFFECT = Effect('squeak', 'material', 'm', 'u', 's', 'f',\n"
        "    (Parameter('a', '1', 0.0, 1.0, 0.5, 'm'),), lambda u, c, v, f, s: (u + v['a'], {}))\n"
    )
    code = (
        "import numpy as np, softsense.effects as e\n"
        f"e.__path__.append({str(tmp_path)!r})\n"
        "from softsense.effects import Context\n"
        "out, _ = e.effect('squeak').apply(np.zeros((2, 1)), Context(0.1, np.zeros(2)))\n"
        "assert len(e.all_effects()) == 19 and (out == 0.5).all()\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={"PYTHONPATH": ":".join(sys.path)})


def test_only_effects_and_operators_live_in_the_folder() -> None:
    for info in pkgutil.iter_modules(effects.__path__):
        module = importlib.import_module(f"softsense.effects.{info.name}")
        assert hasattr(module, "EFFECT") == (info.name != "operators")
        if info.name != "operators":
            assert module.EFFECT.name == info.name


def test_unknown_names_are_refused() -> None:
    with pytest.raises(SoftsenseError, match="there is no effect 'rust'"):
        effect("rust")
    u = np.zeros((5, 2))
    with pytest.raises(ValueError, match="no parameter depth"):
        effect("gain").apply(u, context_of(u[:, 0]), {"depth": 1.0})
    with pytest.raises(ValueError, match="no form 'cubic'"):
        effect("gain").apply(u, context_of(u[:, 0]), form="cubic")
    with pytest.raises(ValueError, match="3 values for 2 channels"):
        effect("gain").apply(u, context_of(u[:, 0]), {"amplitude": np.ones(3)})


@pytest.mark.parametrize(("name", "form"), CASES)
@pytest.mark.parametrize("temp", [False, True])
def test_a_run_may_be_cut_anywhere(name: str, form: str, temp: bool) -> None:
    one, u = effect(name), signal_of(3)
    strain = u.mean(axis=1)
    whole, last = one.apply(u, context_of(strain, temp=temp), form=form)
    state, parts = None, []
    for begin, end in ((0, 1), (1, 2), (2, 137), (137, 138), (138, 400)):
        here = context_of(strain[begin:end], begin * DT_S, temp, seed=5 if begin == 0 else 99)
        part, state = one.apply(u[begin:end], here, form=form, state=state)
        parts.append(part)
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0, atol=1e-12)
    assert state is not None
    assert set(state) == set(last)


@pytest.mark.parametrize(("name", "form"), CASES)
def test_input_and_state_are_left_alone(name: str, form: str) -> None:
    one, u = effect(name), signal_of(4, 60)
    strain = u[:, 0].copy()
    kept = u.copy()
    _, state = one.apply(u, context_of(strain), form=form)
    once, _ = one.apply(u, context_of(strain, 3.0), form=form, state=state)
    again, _ = one.apply(u, context_of(strain, 3.0), form=form, state=state)
    np.testing.assert_array_equal(u, kept)
    np.testing.assert_array_equal(once, again)


@pytest.mark.parametrize(("name", "form"), [case for case in CASES if case[0] != "crosstalk"])
def test_channels_do_not_depend_on_each_other(name: str, form: str) -> None:
    one, u = effect(name), signal_of(6, 200, 2)
    context = context_of(u[:, 0])
    both, _ = one.apply(u, context, form=form)
    other = u.copy()
    other[:, 1] = 0.3
    again, _ = one.apply(other, context_of(u[:, 0]), form=form)
    np.testing.assert_array_equal(both[:, 0], again[:, 0])


@pytest.mark.parametrize(("name", "form"), LINEAR)
@given(seed=st.integers(0, 10**6), a=st.floats(-3, 3), b=st.floats(-3, 3))
@settings(max_examples=15, deadline=None)
def test_linear_effects_superpose(name: str, form: str, seed: int, a: float, b: float) -> None:
    one = effect(name)
    u, w = signal_of(seed), signal_of(seed + 1)
    strain = signal_of(seed + 2)[:, 0]

    def through(signal: np.ndarray) -> np.ndarray:
        return one.apply(signal, context_of(strain), form=form)[0]

    np.testing.assert_allclose(
        through(a * u + b * w), a * through(u) + b * through(w), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("name", ADDITIVE)
def test_additive_effects_do_not_depend_on_the_signal(name: str) -> None:
    one = effect(name)
    u, w = signal_of(1), signal_of(2)
    strain = signal_of(3)[:, 0]
    added = [one.apply(s, context_of(strain))[0] - s for s in (u, w)]
    np.testing.assert_allclose(added[0], added[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("form", effect("hysteresis").forms)
@given(seed=st.integers(0, 10**6), repeats=st.integers(1, 7))
@settings(max_examples=15, deadline=None)
def test_rate_independent_hysteresis_is_rate_independent(
    form: str, seed: int, repeats: int
) -> None:
    turns = np.random.default_rng(seed).random(8)
    fast = turns[:, None]
    # the same turning points, each way in more samples: monotone between them
    ways = [np.linspace(a, b, repeats + 1)[1:] for a, b in itertools.pairwise(turns)]
    slow = np.concatenate([turns[:1], *ways])[:, None]
    quick, _ = effect("hysteresis").apply(fast, context_of(fast[:, 0]), form=form)
    steady, _ = effect("hysteresis").apply(slow, context_of(slow[:, 0]), form=form)
    np.testing.assert_allclose(steady[::repeats], quick, rtol=0, atol=1e-9)


def test_a_plane_is_the_relays_that_are_on_in_each_of_its_cells() -> None:
    rng = np.random.default_rng(3)
    turns = np.concatenate([[0.0], rng.random(60)])
    strain = np.interp(np.arange(2400) / 40.0, np.arange(len(turns)), turns)
    cells, fine = 4, 60
    places = (np.arange(cells * fine) + 0.5) / (cells * fine)
    up, down = np.meshgrid(places, places, indexing="ij")
    on, found = np.zeros(up.shape, dtype=bool), _plane(strain, cells, 1)
    for k, now in enumerate(strain):
        on = (on | (up <= now)) & (down < now) & (up >= down)
        shares = on.reshape(cells, fine, cells, fine).mean(axis=(1, 3))
        rows, columns = np.tril_indices(cells)
        expected = shares[rows, columns] * np.where(rows == columns, 2.0, 1.0)
        assert np.abs(found[k] - expected).max() < 2.5 / fine
    assert np.array_equal(_plane(strain, cells, 7), found[::7])


@pytest.mark.parametrize("form", effect("hysteresis").forms)
@given(seed=st.integers(0, 10**6))
@settings(max_examples=15, deadline=None)
def test_hysteresis_is_bounded_and_loses_energy(form: str, seed: int) -> None:
    u = signal_of(seed)
    loop = np.concatenate([u, u[::-1], u, u[::-1]])
    values = {"amplitude": 0.1, "threshold": 0.2}
    out, _ = effect("hysteresis").apply(loop, context_of(loop[:, 0]), values, form=form)
    z = out - loop
    assert np.abs(z).max() <= 0.1 + 1e-12
    # Over a closed path in the settled state, the work of the friction is never negative.
    half = 2 * len(u)
    du = np.diff(loop[half - 1 :], axis=0)
    mean = 0.5 * (z[half - 1 : -1] + z[half:])
    assert ((mean * du).sum(axis=0) >= -1e-9).all()


def test_memory_is_wiped_as_the_play_operator_says() -> None:
    """A larger swing forgets every smaller one within it (Madelung's rules)."""
    plain = [0.5, 0.0, 1.0, 0.4]
    detour = [0.5, 0.0, 0.6, 0.3, 0.5, 0.35, 0.45, 0.4, 1.0, 0.4]
    out = []
    for turns in (plain, detour):
        u = np.array(turns)[:, None]
        got, _ = effect("hysteresis").apply(u, context_of(u[:, 0]), {"threshold": 0.3})
        moved, _ = effect("backlash").apply(u, context_of(u[:, 0]), {"width": 0.2})
        out.append((got[-1, 0], moved[-1, 0]))
    assert out[0] == pytest.approx(out[1], abs=1e-12)


def test_backlash_is_flat_over_its_width_after_a_reversal() -> None:
    x = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101)[1:]])[:, None]
    y, _ = effect("backlash").apply(x, context_of(x[:, 0]), {"width": 0.1})
    flat = y[100:, 0] == y[100, 0]
    assert y[100, 0] == pytest.approx(0.95)
    assert int(flat.sum()) == 11
    assert (np.abs(y - x) <= 0.05 + 1e-12).all()
    slack, _ = effect("backlash").apply(x, context_of(x[:, 0]), {"width": 0.1}, form="dead_zone")
    assert slack[:11, 0].max() <= 1e-12
    assert slack[100, 0] == pytest.approx(0.9)


def test_relaxation_relaxes_to_the_closed_form() -> None:
    """A ramp of length T to 1, then a hold: g tau / T (1 - exp(-T/tau)) exp(-t/tau)."""
    tau, g, ramp = 1.7, 0.3, 20
    u = np.concatenate([np.linspace(0, 1, ramp + 1), np.ones(400)])[:, None]
    out, _ = effect("relaxation").apply(u, context_of(u[:, 0]), {"amplitude": g, "tau_s": tau})
    length = ramp * DT_S
    held = DT_S * np.arange(401)
    expected = 1.0 + g * tau / length * -np.expm1(-length / tau) * np.exp(-held / tau)
    np.testing.assert_allclose(out[ramp:, 0], expected, rtol=0, atol=1e-12)


def test_poles_add_up() -> None:
    u = signal_of(8)
    context = context_of(u[:, 0])
    both = effect("relaxation").apply(
        u, context, {"amplitude": np.full((3, 2), 0.1), "tau_s": np.tile([1.0, 9.0], (3, 1))}
    )[0]
    single = [
        effect("relaxation").apply(u, context, {"amplitude": 0.1, "tau_s": tau})[0] - u
        for tau in (1.0, 9.0)
    ]
    np.testing.assert_allclose(both, u + single[0] + single[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("tau_s", [0.0, 0.01, 0.7, 40.0, 1e5])
def test_parts_of_a_long_signal_are_filtered_at_once_as_one(
    tau_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    u = np.cumsum(np.random.default_rng(5).normal(size=(4003, 2)), axis=0)
    whole, memory = low_pass(u, DT_S, np.full(2, tau_s), None)
    monkeypatch.setattr(operators, "LONG", len(u))
    parts, last = low_pass(u, DT_S, np.full(2, tau_s), None)
    np.testing.assert_allclose(parts, whole, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(last, memory, rtol=0.0, atol=1e-11)


@given(tau=st.floats(1e-4, 1e3))
@settings(max_examples=50, deadline=None)
def test_the_filter_passes_rest_and_follows_a_ramp(tau: float) -> None:
    a, b0, b1 = first_order_hold(DT_S, tau)
    assert b0 + b1 == pytest.approx(1.0 - a, abs=1e-9)
    t = DT_S * np.arange(300)
    out, _ = low_pass(t[:, None], DT_S, np.array([tau]), None)
    np.testing.assert_allclose(out[:, 0], t - tau * -np.expm1(-t / tau), rtol=0, atol=1e-8)


def test_lag_attenuates_as_its_transfer_function() -> None:
    tau, frequency = 0.2, 0.5
    t = DT_S * np.arange(4000)
    u = np.sin(2 * np.pi * frequency * t)[:, None]
    for form, order in (("one_pole", 1), ("two_poles", 2)):
        out, _ = effect("lag").apply(u, context_of(u[:, 0]), {"tau_s": tau}, form=form)
        gain = np.abs(1 / (1 + 2j * np.pi * frequency * tau)) ** order
        # first-order hold of a sine loses sinc^2 of half a sample's phase: 0.2 %
        assert np.abs(out[2000:]).max() == pytest.approx(gain, rel=0.005)


def test_delay_moves_without_attenuation() -> None:
    u = signal_of(11)
    context = context_of(u[:, 0])
    late, _ = effect("delay").apply(u, context, {"delay_s": 3 * DT_S})
    np.testing.assert_allclose(late[3:], u[:-3], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(late[:3], np.tile(u[0], (3, 1)))
    skewed, _ = effect("delay").apply(u, context, {"delay_s": 0.0, "skew": 0.01})
    np.testing.assert_allclose(skewed[100], u[99], rtol=0, atol=1e-9)
    np.testing.assert_allclose(skewed[300], u[297], rtol=0, atol=1e-9)


def test_delayed_candidates_are_the_interpolation_of_the_signal() -> None:
    codes = 2000.0 + np.cumsum(np.random.default_rng(4).normal(size=(800, 1)), axis=0)
    motion = motion_of(codes[:, 0], 0.05, 0.0, None)
    (nominal,) = nominals(
        codes, codes, motion, 12, reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    )
    index = np.arange(len(codes), dtype=float)
    made = [c for c in effect("delay").explain(nominal) if "delay_s" in c.values]
    made += effect("delay").zoom(nominal, {"delay_s": -0.3})
    made += effect("delay").zoom(nominal, {"delay_s": 0.2, "skew": 0.001})
    made += effect("delay").fine.at(nominal, {"delay_s": 0.13})
    made += effect("delay").fine.at(nominal, {"delay_s": 0.13, "course2": 0.05})
    assert {c.form for c in made} == {"smooth", "linear", "skewed", "wandering"}
    straight_too = [c for c in made if c.form == "skewed"]
    assert any(STRAIGHT in c.values for c in straight_too)
    assert not all(STRAIGHT in c.values for c in straight_too)
    for candidate in made:
        late_s = candidate.values["delay_s"] + candidate.values.get("skew", 0.0) * 0.05 * index
        passed = 2.0 * index / len(index) - 1.0
        late_s += candidate.values.get("course2", 0.0) * (1.5 * passed**2 - 0.5)
        at = np.clip(index - late_s / 0.05, 0.0, index[-1])
        smooth = CubicSpline(index, codes[:, 0])(at)
        straight = np.interp(at, index, codes[:, 0])
        expected = straight if STRAIGHT in candidate.values else smooth
        np.testing.assert_allclose(candidate.columns[:, 0], expected - codes[:, 0], atol=1e-9)


def test_traces_for_a_thinned_search_are_those_of_the_full_rate(monkeypatch) -> None:
    """Filters run before samples are left out, and what is called memoryless has none."""
    monkeypatch.setattr(pricing, "SEARCHED", 500)
    rng = np.random.default_rng(5)
    strain = np.convolve(rng.random(2000), np.hanning(60), "same")
    codes = 1500.0 + 20.0 * strain[:, None] * np.array([1.0, -0.7])
    motion = motion_of(strain, 0.05, 0.0, 20.0 + np.sin(np.arange(2000) / 300.0))
    nominal = nominals(
        codes,
        codes + 1.0,
        motion,
        12,
        reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3))),
    )[0]
    history = history_basis(motion.strain, 0.05)
    searched = Channel(nominal, rng.normal(size=2000), 1.0, history, (), 1.0, 0.0, 0.1, history)
    for name, one in all_effects().items():
        if one.explain is None:
            continue
        asked = searched._asked(one, nominal)
        thinned, whole = one.explain(asked), one.explain(nominal)
        for values in {tuple(sorted(made.values)): made.values for made in whole}.values():
            if one.zoom is not None:
                thinned = thinned + one.zoom(asked, values)
                whole = whole + one.zoom(nominal, values)
        for thin, full in zip(thinned, whole, strict=True):
            columns = searched._searched(thin)
            expected = full.columns[::4]
            np.testing.assert_allclose(columns, expected, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    "name",
    ["adc_nonlinearity", "delay", "drift", "overshoot", "saturation", "step"],
)
def test_what_has_many_candidates_makes_only_those_that_are_asked_for(name: str) -> None:
    codes = 1500.0 + 900.0 * np.sin(np.arange(500) / 30.0)[:, None]
    motion = motion_of(codes[:, 0], 0.05, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((1, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    one = effect(name)
    made = one.explain(nominal)
    made += one.zoom(nominal, made[-1].values) if one.zoom else []
    assert all(callable(candidate.made) for candidate in made)
    for candidate in made:
        assert candidate.columns.shape[0] == 500
        assert candidate.columns.dtype == np.float64


def test_a_delay_of_more_than_the_recording_reads_its_first_sample() -> None:
    codes = 1500.0 + 900.0 * np.cos(np.arange(500) / 30.0)[:, None]
    motion = motion_of(codes[:, 0], 0.05, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((1, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    fine = effect("delay").fine
    assert fine is not None
    for late_s, read in ((40.0, codes[0]), (-40.0, codes[-1])):
        for candidate in fine.at(nominal, {"delay_s": late_s}):
            np.testing.assert_array_equal(candidate.columns, read - codes)


def test_what_is_made_once_is_made_again_where_the_signal_changes() -> None:
    codes = 1500.0 + 900.0 * np.sin(np.arange(500) / 30.0)[:, None] * np.array([1.0, -0.5])
    motion = motion_of(codes[:, 0], 0.05, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((2, 3)))
    first, second = nominals(codes, codes, motion, 12, reference)
    before = first.share
    assert first.share is before
    changed = first.acting_on(codes[:, 0] + 90.0, None)
    np.testing.assert_allclose(changed.share - before, 90.0 / first.span)
    np.testing.assert_array_equal(changed.codes[1], codes[:, 1])
    # All channels see one strain, until it is another one.
    made = first.once_for_all("mean", lambda: float(first.strain.mean()))
    assert second.once_for_all("mean", lambda: np.nan) == made
    moved = first.acting_on(codes[:, 0], lambda: 0.5 * first.strain)
    assert moved.once_for_all("mean", lambda: float(moved.strain.mean())) == 0.5 * made
    thinned = replace(first, keep=slice(None, None, 5)).kept()
    assert thinned.once_for_all("mean", lambda: 7.0) == 7.0


def test_threads_make_columns_at_the_same_time() -> None:
    both = Barrier(2, timeout=10.0)

    def made() -> np.ndarray:
        both.wait()
        return np.ones((3, 1))

    with ThreadPoolExecutor(2) as pool:
        columns = list(pool.map(lambda _: Candidate(made, {}).columns, range(2)))
    assert [each.shape for each in columns] == [(3, 1)] * 2


def test_softening_is_nil_on_the_virgin_path_and_grows_below_it() -> None:
    x = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0.2, 50)])
    for form in effect("softening").forms:
        out, _ = effect("softening").apply(x[:, None], context_of(x), {"depth": 0.3}, form=form)
        ratio = out[:, 0] / np.where(x > 0, x, 1.0)
        np.testing.assert_allclose(ratio[1:50], 1.0, atol=1e-12)
        assert (np.diff(ratio[50:]) < 0).all()
        assert ratio[-1] > 0.7


def test_overshoot_is_even_in_the_strain_rate_and_dies_at_rest() -> None:
    x = np.concatenate([np.linspace(0, 1, 21), np.ones(400)])
    u = np.zeros((len(x), 1))
    up, _ = effect("overshoot").apply(u, context_of(x))
    down, _ = effect("overshoot").apply(u, context_of(1.0 - x))
    np.testing.assert_allclose(up, down, rtol=0, atol=1e-12)
    assert up[20, 0] > 0.02
    assert up[-1, 0] < 1e-9


@pytest.mark.parametrize("form", effect("drift").forms)
def test_drift_reaches_its_amplitude_after_the_reference_time(form: str) -> None:
    t0_s = effects.REFERENCE_S
    u = np.zeros((2, 2))
    out, _ = effect("drift").apply(
        u, context_of(u[:, 0], t0_s), {"amplitude": [0.1, -0.2]}, form=form
    )
    np.testing.assert_allclose(out[0], [0.1, -0.2], rtol=0, atol=1e-12)
    fresh, _ = effect("drift").apply(u, context_of(u[:, 0]), {"amplitude": 0.1}, form=form)
    assert fresh[0, 0] == 0.0


def test_random_walk_grows_and_its_stationary_forms_do_not() -> None:
    u = np.zeros((8000, 200))
    context = context_of(u[:, 0])
    for form, early, late in (("walk", 0.5, 1.0), ("ornstein_uhlenbeck", 1, 1), ("flicker", 1, 1)):
        out, _ = effect("random_walk").apply(u, context, {"amplitude": 0.02, "tau_s": 50}, form)
        # 200 independent channels: the deviation is known to 5 %, three of its errors are allowed
        assert out[2000].std() == pytest.approx(0.02 * early, rel=0.15)
        assert out[-1].std() == pytest.approx(0.02 * late, rel=0.15)


def test_temperature_follows_the_log() -> None:
    strain = np.linspace(0, 1, 50)
    u = np.zeros((50, 2))
    out, _ = effect("temperature").apply(u, context_of(strain, temp=True), {"alpha": [0.01, 0.02]})
    np.testing.assert_allclose(out, (strain - 5.0)[:, None] * [0.01, 0.02], rtol=0, atol=1e-12)


def test_self_heating_settles_at_its_rise() -> None:
    u = np.zeros((4000, 1))
    values = {"alpha": 0.01, "rise_k": 4.0, "wander_s": 5.0}
    out, _ = effect("temperature").apply(u, context_of(u[:, 0]), values, form="self_heating")
    assert abs(out[0, 0]) < 1e-3
    assert out[-1, 0] == pytest.approx(0.04, abs=1e-6)


def test_step_changes_at_its_time_and_heals() -> None:
    u = np.full((400, 1), 0.5)
    values = {"at_s": 10.0, "offset": 0.1, "gain": 0.2, "recovery": 0.5, "tau_s": 0.5}
    out, _ = effect("step").apply(u, context_of(u[:, 0]), values)
    assert (out[:200] == 0.5).all()
    assert out[200, 0] == pytest.approx(0.7)
    assert out[-1, 0] == pytest.approx(0.6, abs=1e-6)


def test_saturation_touches_only_the_top() -> None:
    u = np.linspace(0, 1, 101)[:, None]
    hard, _ = effect("saturation").apply(u, context_of(u[:, 0]), {"level": 0.6})
    np.testing.assert_array_equal(hard, np.minimum(u, 0.6))
    soft, _ = effect("saturation").apply(u, context_of(u[:, 0]), {"level": 0.6}, form="soft")
    assert (soft <= hard + 1e-12).all()
    assert np.abs(soft - hard).max() == pytest.approx(0.02 * np.log(2), rel=0.02)
    assert (np.diff(soft[:, 0]) > 0).all()


def test_a_rail_is_flat_and_then_falls_off() -> None:
    u = np.sort(np.random.default_rng(3).uniform(1200.0, 2600.0, 4000))
    share = (u - 1200.0) / 1400.0
    soft = -80.0 * np.logaddexp(0.0, (share - 0.7) / 0.08) * 0.08
    for rail in (np.minimum(u, 2000.0) - u, soft, -50.0 * np.maximum(share - 0.1, 0.0) ** 3):
        assert is_rail(u, rail)
        assert is_rail(-u, -rail)
        assert not is_rail(u, -rail)
    bow, s_shape = np.sin(np.pi * u / 4096.0), np.sin(2.0 * np.pi * u / 4096.0)
    line, ripple = share, np.sin(9.0 * share)
    for curve in (bow, s_shape, -bow, -s_shape, line, -line, -(share**2), ripple):
        assert not is_rail(u, 30.0 * curve)


@pytest.mark.parametrize("form", effect("adc_nonlinearity").forms)
def test_adc_nonlinearity_is_a_function_of_the_code(form: str) -> None:
    u = (np.arange(4096) / 4095.0)[:, None]
    shuffled = np.random.default_rng(0).permutation(4096)
    straight, _ = effect("adc_nonlinearity").apply(u, context_of(u[:, 0]), form=form)
    mixed, _ = effect("adc_nonlinearity").apply(u[shuffled], context_of(u[:, 0]), form=form)
    np.testing.assert_array_equal(straight[shuffled], mixed)
    codes = np.floor(straight[:, 0] * 4095 + 0.5)
    if form == "missing_codes":
        assert not np.isin(codes, np.arange(4, 4096, 8)).any()
        assert len(np.unique(codes)) == 4096 - 512
    else:
        assert np.abs(straight - u).max() * 4095 == pytest.approx(4.0, rel=1e-3)


def test_crosstalk_hears_the_channel_scanned_before() -> None:
    u = np.zeros((10, 3))
    u[:, 1] = 1.0
    out, _ = effect("crosstalk").apply(u, context_of(u[:, 0]), {"amplitude": 0.1})
    np.testing.assert_allclose(out[0], [0.0, 0.9, 0.1], atol=1e-12)
    u = np.zeros((10, 3))
    u[4, 2] = 1.0
    out, _ = effect("crosstalk").apply(u, context_of(u[:, 0]), {"amplitude": 0.1})
    assert out[4, 0] == 0.0
    assert out[5, 0] == pytest.approx(0.1)


def test_interference_folds_as_sampling_does() -> None:
    u = np.zeros((4000, 1))
    for frequency, folded in ((50.3, 9.7), (3.0, 3.0)):
        out, _ = effect("interference").apply(u, context_of(u[:, 0]), {"frequency_hz": frequency})
        spectrum = np.abs(np.fft.rfft(out[:, 0]))
        assert np.fft.rfftfreq(4000, DT_S)[spectrum.argmax()] == pytest.approx(folded, abs=0.02)


def test_spikes_come_as_often_and_as_large_as_said() -> None:
    u = np.zeros((20000, 10))
    values = {"rate_hz": 0.5, "decay_s": 0.0}
    out, _ = effect("spikes").apply(u, context_of(u[:, 0]), values)
    seen = out[out != 0.0]
    # 5000 expected: 3 standard deviations are 212
    assert len(seen) == pytest.approx(200_000 * -np.expm1(-0.5 * DT_S), abs=212)
    assert np.abs(seen).mean() * 4095 == pytest.approx(50.0, rel=0.05)
    assert abs(np.sign(seen).mean()) < 0.05


def test_noise_has_its_level_and_its_growth() -> None:
    strain = np.repeat([0.0, 1.0], 20000)
    u = np.repeat(strain[:, None], 2, axis=1)
    values = {"level_lsb": [1.0, 4.0], "by_signal": 2.0}
    white, _ = effect("noise").apply(u, context_of(strain), values)
    np.testing.assert_allclose((white - u).std(axis=0) * 4095, [1.0, 4.0], rtol=0.02)
    grown, _ = effect("noise").apply(u, context_of(strain), values, form="heteroscedastic")
    scatter = (grown - u)[20001:].std(axis=0) / (grown - u)[:20000].std(axis=0)
    np.testing.assert_allclose(scatter, 3.0, rtol=0.03)


def test_gain_grows_with_time_or_cycles() -> None:
    strain = np.abs((np.arange(8001) * 0.01) % 2.0 - 1.0)
    u = np.ones((8001, 1))
    grown = {
        form: effect("gain").apply(u, context_of(strain), {"amplitude": 0.1}, form=form)[0][-1, 0]
        for form in effect("gain").forms
    }
    assert grown["constant"] == pytest.approx(1.1)
    assert grown["time"] == pytest.approx(1.1)
    assert grown["cycles"] == pytest.approx(1 + 0.1 * np.sqrt(40 / 100))

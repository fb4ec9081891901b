"""The search for the cheapest model: where it begins, what it tries, and what counts as more."""

from __future__ import annotations

import importlib
import sys
import threading
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from softsense.diagnose import diagnose
from softsense.diagnose.channel import Channel
from softsense.diagnose.cores import all_at_once, one_core
from softsense.diagnose.design import Entry, Fit
from softsense.diagnose.moved import Together
from softsense.diagnose.nominal import motion_of, nominals, reference_of
from softsense.diagnose.search import (
    Model,
    _fewest_first,
    _said_elsewhere,
    by_price,
    leaner,
    priced,
    search,
)
from softsense.effects import all_effects

sys.path.insert(0, str(Path(__file__).parent))

from made_gaps import (
    GAP,
    RATE_HZ,
    SAMPLES,
    clean,
    filtered,
    first_channel,
    fit_with,
    hide,
    recorded,
    sensed,
)


@pytest.mark.parametrize(
    ("half", "seed", "names"),
    [
        # The coarse grids have it, and then each effect alone goes elsewhere.
        ("wearable", 160041, ("step", "drift")),
        # All pairs that cost least on the coarse grids have a walk.
        ("optical", 160025, ("gain", "step")),
    ],
)
def test_a_close_look_begins_where_the_coarse_one_stood(
    monkeypatch, half: str, seed: int, names: tuple[str, ...]
) -> None:
    """Cases of the benchmark that are not held out."""
    monkeypatch.syspath_prepend(str(GAP))
    excitation = "typical" if half == "wearable" else "rich"
    case = importlib.import_module(half).make(seed, names, excitation)
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_what_says_most_beside_another_is_chosen_with_it() -> None:
    """As least squares on all pairs of single columns have it."""
    x, codes = clean(6, 2000)
    t = np.arange(len(x)) / RATE_HZ
    gap = 30.0 * np.log1p(t / 9.0) + 0.08 * (codes[:, 0] - codes[0, 0])
    channel = first_channel(x, codes, gap, ["drift", "gain"])
    columns = {
        name: [(k, e.columns[:, 0]) for k, e in enumerate(entries) if e.width == 1]
        for name, entries in channel.entries.items()
    }

    def left(*some: np.ndarray) -> float:
        together = np.stack(some, axis=1).astype(np.float64)
        weights = np.linalg.lstsq(together, channel.residual)[0]
        return float(((channel.residual - together @ weights) ** 2).sum())

    for first, second in (("drift", "gain"), ("gain", "drift")):
        best, gained = channel.design.best_beside(first, second)
        least = {k: min(left(one, two) for _, two in columns[second]) for k, one in columns[first]}
        # The design adds up two samples each, in single precision.
        assert least[best] < 1.05 * min(least.values())
        whole = float((channel.residual**2).sum())
        assert gained == pytest.approx(whole - min(least.values()), rel=0.01)


def test_two_effects_that_only_together_say_much_are_found(monkeypatch) -> None:
    """A case of the benchmark that is not held out: whichever comes first takes the other's part,
    and nothing that is near its candidate is what happened."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("liquid").make(720005, ("drift", "gain"), "typical")
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_two_effects_that_say_little_alone_are_found_together(monkeypatch) -> None:
    """A case of the training half: five effects alone cost less than either."""
    monkeypatch.syspath_prepend(str(GAP))
    names = ("backlash", "adc_nonlinearity")
    case = importlib.import_module("cases").make(250096, names, "rich", False)
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_an_effect_that_says_nothing_is_not_named_for_what_came_closer_beside_it(
    monkeypatch,
) -> None:
    """A case of the benchmark that is not held out: rails that were found beside a crosstalk."""
    monkeypatch.syspath_prepend(str(GAP))
    make, equation = importlib.import_module("optical").make, {"saturation": "both_rails"}
    case = make(292003, ("saturation",), "typical", equation)
    assert diagnose(case.sim, case.real).effects == ("saturation",)


def test_of_several_effects_that_say_nothing_on_a_channel_none_stays() -> None:
    """But the last one: what is left of the first is what the second is left out of."""

    def without(fit: Fit, name: str, composed: bool) -> Fit:
        return fit_with("+".join(n for n, _ in fit.picks if n != name), left=1.0)

    channel = SimpleNamespace(
        **dict.fromkeys(("samples", "excess", "guard"), 1.0),
        price=lambda fit: float(len(fit.picks)),
        left=lambda fit: 1.0,
        exact=lambda fit: False,
        idle=lambda fit, curved: (),
        without=without,
    )
    made = priced([channel], (fit_with("drift+overshoot+relaxation", 1.0),))
    assert leaner([channel], made).names == {"relaxation"}


def test_what_moves_nothing_on_a_channel_keeps_its_curve_there() -> None:
    """Without it, that channel would seem to cost little."""
    x, codes = clean(3, 1500)
    channel = first_channel(x, codes, 20.0 * x**2, ["gain"])
    fit = min((channel._fit((("gain", k),), 2) for k in range(3)), key=channel.price)
    assert fit.static is not None
    assert channel.with_motion(fit, {}, bare=True) is fit


def test_a_curve_of_what_was_read_leaves_no_less_than_the_noise() -> None:
    """What noise moves goes with what was read."""
    x, codes = clean(3, 1500)
    channel = first_channel(x, codes, np.cumsum(np.random.default_rng(2).normal(size=1500)), [])
    nothing = Fit((("random_walk", 0),), np.zeros(1), np.zeros(0), None)
    assert channel.gain > 0.1
    assert channel.left(nothing) == 0.0


def test_an_effect_says_all_of_a_small_gap_whatever_it_costs_to_name_it() -> None:
    fits = {"step": Fit((("step", 0),), None, None, None)}
    entries = {"step": [Entry((), None, np.zeros((9, 1)), 0, None, "")]}

    def channel(excess: float, left: float) -> SimpleNamespace:
        price = 1000.0 + 250.0 + left
        return SimpleNamespace(
            excess=excess,
            samples=1000,
            effect_price=250.0,
            entries=entries,
            best=lambda names: fits[min(names)],
            price=lambda fit: price,
        )

    small, large = channel(13e3, 100.0), channel(60e3, 20e3)
    assert _said_elsewhere([small, large], ["step"]) == [{}, {"step": entries["step"][0]}]
    assert _said_elsewhere([channel(13e3, 1e3), large], ["step"]) == [{}, {}]


def test_the_best_is_no_worse_for_what_was_tried_upon_it(monkeypatch) -> None:
    x, codes = clean(11)
    channel = first_channel(x, codes, 20.0 * (np.arange(SAMPLES) > 3000), ["step", "drift"])
    beyond = Together(np.inf, 1.0)
    best = search([channel], ["step", "drift"], beyond)[0]
    assert best.names == {"step"}

    def upon(channels, models, names):
        return [replace(models[0], names=frozenset({"drift"}), price=1e9)]

    monkeypatch.setattr(importlib.import_module("softsense.diagnose.search"), "_upon_best", upon)
    assert search([channel], ["step", "drift"], beyond)[0].names == {"step"}


def test_fits_begin_with_what_another_channel_has_where_this_one_has_it_too() -> None:
    x, codes = clean(11)
    channel = first_channel(x, codes, 30.0 * x, ["crosstalk"])
    before = len(channel.entries["crosstalk"])
    entry = channel.entries["crosstalk"][0].apart()
    elsewhere = replace(entry.candidate, values={"source": 0.0})
    for other in (replace(entry, number=10**6), replace(entry, candidate=elsewhere)):
        channel.begin_with({"crosstalk": other})
        assert len(channel.entries["crosstalk"]) == before
    channel.begin_with({"crosstalk": entry})
    assert len(channel.entries["crosstalk"]) == before + 1


def test_what_acts_upon_an_effect_may_say_little_side_by_side(monkeypatch) -> None:
    """A converter's curve upon a material that relaxes: a training case of the benchmark."""
    monkeypatch.syspath_prepend(str(GAP))
    case = importlib.import_module("cases").make(
        82034, ("adc_nonlinearity", "relaxation"), "rich", False
    )
    assert set(diagnose(case.sim, case.real).effects) == set(case.truth)


def test_where_fewer_effects_say_all_no_more_are_missed(monkeypatch) -> None:
    """One effect alone on one channel, beside another on the next: what is not looked at would not
    have paid."""
    x, codes = clean(4)
    made = hide(x, hide(x, codes, "drift"), "overshoot")
    sim, real = recorded(x, codes, 1), recorded(x, made, 2)
    quick = diagnose(sim, real)
    monkeypatch.setattr(Channel, "_said_by_fewer", lambda channel, count: False)
    whole = diagnose(sim, real)
    assert set(quick.effects) == {"drift", "overshoot"}
    assert quick.state_json() == whole.state_json()
    assert quick.data["after"] == whole.data["after"]


def test_short_work_stays_on_its_core() -> None:
    def where(item: int) -> int:
        return threading.get_ident()

    with one_core():
        assert set(all_at_once(where, range(8))) == {threading.get_ident()}
    assert threading.get_ident() not in all_at_once(where, range(8))


def test_an_effect_more_must_leave_less() -> None:
    """Each channel may find a cheaper one than the others have."""
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=50.0, samples=1.0)] * 2
    alone = fit_with("crosstalk", 0.1), fit_with("crosstalk", 0.2)
    one = Model(frozenset({"crosstalk"}), alone, 8.3)
    other = fit_with("adc_nonlinearity", 0.3)
    two = Model(frozenset({"crosstalk", "adc_nonlinearity"}), (alone[0], other), 8.0)
    assert by_price(_fewest_first(channels, [two, one]))[0].names == one.names
    better = replace(two, fits=(alone[0], fit_with("adc_nonlinearity", 0.1)))
    assert by_price(_fewest_first(channels, [better, one]))[0].names == two.names
    cheaper = replace(two, price=7.7)
    assert by_price(_fewest_first(channels, [cheaper, one]))[0].names == two.names


def test_a_walk_alone_is_as_good_where_an_effect_beside_it_leaves_more() -> None:
    channels = [SimpleNamespace(left=lambda fit: fit.errors[0], excess=50.0, samples=1.0)] * 2
    walk = fit_with("random_walk", 0.1)
    alone = Model(frozenset({"random_walk"}), (walk, walk), 8.3)
    for left, names in ((0.2, 1), (0.05, 2)):
        fits = walk, fit_with("relaxation", left)
        both = Model(frozenset({"random_walk", "relaxation"}), fits, 8.0)
        assert len(by_price(_fewest_first(channels, [both, alone]))[0].names) == names


def test_a_round_that_was_made_is_not_made_again(monkeypatch) -> None:
    """Models of more effects than a channel has ask for the same."""
    x, codes = clean(3, 1500)
    gap = 40.0 * x**2 + 30.0 * (filtered(codes, 0.3) - codes)[:, 0]
    channel = first_channel(x, codes, gap, ["gain", "lag"])
    fit = channel.best(frozenset({"gain", "lag"}))
    assert len(fit.picks) == 2
    first = channel.composed(fit, frozenset({"gain", "lag"}))
    monkeypatch.setattr(Channel, "_upon_each_other", None)
    assert channel.composed(fit, frozenset({"gain", "lag"})) is first


def test_what_is_offered_before_is_offered_again() -> None:
    x, codes = clean(2, 1500)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    gap = 20.0 * x + np.random.default_rng(1).normal(0.0, 1.3, len(x))
    given = nominal, gap, 1.3, x[:, None] ** [1, 2]
    rest = 1.7, 0.0, 0.1, motion.history
    offered: dict = {}
    Channel(*given, ["lag"], *rest, offered)
    lag = offered["lag"]
    both = Channel(*given, ["gain", "lag"], *rest, offered)
    fresh = Channel(*given, ["gain", "lag"], *rest)
    assert offered.keys() == {"lag"}
    assert offered["lag"] is lag
    assert np.shares_memory(both.entries["lag"][0].columns, lag[0].columns)
    for name in ("gain", "lag"):
        for one, other in zip(both.entries[name], fresh.entries[name], strict=True):
            assert one.at == other.at
            np.testing.assert_array_equal(one.columns, other.columns)


def test_of_a_long_recording_what_leaves_far_more_is_not_looked_at_closely(monkeypatch) -> None:
    module = importlib.import_module("softsense.diagnose.pricing")
    monkeypatch.setattr(module, "SEARCHED", 500)
    x, codes = clean(2)
    gap = np.where(np.arange(len(x)) > 3000, 40.0, 0.0)

    def looked_at(beside: tuple[str, ...]) -> int:
        made = first_channel(x, codes, gap, ["step", "drift"])
        assert made.long
        made.zoom((), beside, {}, {}, ())
        assert len(made.entries["step"]) > 1
        return len(made.entries["drift"])

    # Alone a drift says much of a step, and would be worth a look.
    assert looked_at(()) == 1
    assert looked_at(("drift",)) > 1


def test_every_effect_that_explains_says_finite_columns() -> None:
    from softsense.diagnose.nominal import motion_of, nominals, reference_of

    x, codes = clean(2, 1500)
    sim = recorded(x, codes, 1)
    motion = motion_of(sim.target[:, 0], sim.dt_s, 0.0, None)
    nominal = nominals(
        codes, codes, motion, 12, reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    )[0]
    for name, effect in all_effects().items():
        for candidate in effect.explain(nominal) if effect.explain else ():
            assert candidate.columns.shape[0] == len(x), name
            assert np.isfinite(candidate.columns).all(), name
            assert not candidate.fixed or candidate.columns.shape[1] == 1, name


def test_what_remembers_runs_at_the_full_rate_where_samples_are_thinned() -> None:
    x, _ = clean(11, 3000)
    x = x * np.linspace(0.4, 1.0, len(x))
    codes, motion = sensed(x), motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    whole = nominals(codes, codes, motion, 12, reference)[0]
    thinned = replace(whole, keep=slice(None, None, 3))
    for name, effect in all_effects().items():
        if effect.explain is None or effect.memoryless:
            continue
        for one, other in zip(effect.explain(whole), effect.explain(thinned), strict=True):
            some = other.columns if len(other.columns) == 1000 else other.columns[::3]
            size = np.abs(one.columns).max() + 1e-9
            assert np.abs(one.columns[::3] - some).max() < 1e-6 * size, (name, one.form, one.values)


def test_what_channels_say_of_one_strain_is_the_same_asked_together() -> None:
    x, codes = clean(2, 1500)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    effect = all_effects()["backlash"]
    for nominal in nominals(codes, codes, motion, 12, reference)[1:]:
        alone, together = (effect.explain(each) for each in (nominal, replace(nominal, alike=True)))
        for one, other in zip(alone, together, strict=True):
            np.testing.assert_allclose(other.columns, one.columns, rtol=1e-6, atol=1e-3)


def test_candidates_are_the_same_ones_whatever_moves_the_strain() -> None:
    """They are known by their number."""
    x, codes = clean(2, 1500)
    motion = motion_of(0.4 * x, 1 / RATE_HZ, 0.0, None)
    reference = reference_of(codes, motion, np.zeros((0, 3)), np.zeros((4, 3)))
    nominal = nominals(codes, codes, motion, 12, reference)[0]
    strain = motion.strain
    still = nominal.acting_on(codes[:, 0], lambda: np.where(strain > 0.0, 0.9 + 0.1 * strain, 0.9))
    for name, effect in all_effects().items():
        made = effect.explain(nominal) if effect.explain else []
        assert len(effect.explain(still) if effect.explain else []) == len(made), name
        for candidate in made if effect.zoom else ():
            near = effect.zoom(nominal, candidate.values)
            assert len(effect.zoom(still, candidate.values)) == len(near), name


def test_a_walk_takes_back_no_more_than_a_few_times_what_there_is() -> None:
    """Of an effect beside it only what is fast is seen."""
    x, codes = clean(9, 1500)
    walk = np.cumsum(np.random.default_rng(3).normal(0.0, 0.5, len(x)))
    channel = first_channel(x, codes, 0.05 * (codes[:, 0] - codes[0, 0]) + walk, ["gain"])
    fit = channel.fit([("gain", 0), ("random_walk", 0)])
    assert np.isfinite(channel.price(fit))
    assert channel.price(replace(fit, weights=9.0 * fit.weights)) == np.inf

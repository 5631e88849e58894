"""A bounded quantity: the profile over its interval, and what it leaves open of the parameters."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from ilg_circuit.fit.bounded import BoundedProfile, likeliest, likeliest_place, matters, profile_bounded
from ilg_circuit.fit.fitting import fit
from ilg_circuit.fit.observation import observation
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.fit.problem import Problem

Array = NDArray[np.float64]
T = np.linspace(0.5, 10.0, 96)
NOISE = 0.01


def problem(data: Array, shift: float, *, told: bool) -> Problem:
    """a exp(-(t - shift)/b): a shift is a factor of a; ``told`` adds a term that only fits without one."""

    def predict(values: Array) -> Array:
        a, b = values[:, :1], values[:, 1:]
        return a * np.exp(-(T - shift) / b) + told * 0.3 * np.sin(3 * (T - shift))

    return Problem((observation(predict, data, ["a", "b"]),), (Parameter("a"), Parameter("b")))


def sets(shift: float, *, told: bool, count: int) -> list[Array]:
    truth = 2.0 * np.exp(-(T - shift) / 3.0) + told * 0.3 * np.sin(3 * (T - shift))
    return [truth + NOISE * np.random.default_rng(seed).standard_normal(len(T)) for seed in range(count)]


def profiled(data: Array, *, told: bool) -> tuple[BoundedProfile, Array, Array]:
    found = fit(problem(data, 0.0, told=told), np.array([2.0, 3.0]))
    made = profile_bounded(found, lambda s: problem(data, s, told=told), (-0.4, 0.4), (0,))
    return made, found.errors / found.units, found.coordinates


def test_what_the_data_do_not_tell_stays_open() -> None:
    data = sets(0.3, told=False, count=1)[0]
    found, errors, coordinates = profiled(data, told=False)
    assert found.deviance.max() < 1e-6
    assert found.admitted == (-0.4, 0.4)
    assert found.middle == pytest.approx(0.0, abs=1e-12)
    # log a = log a0 - shift/b exactly, and b does not move
    b = float(np.exp(coordinates[1]))
    assert found.range == pytest.approx([-0.8 / b, 0.0], abs=1e-6)
    low, high = found.reach(errors, np.full(2, 1.96))
    first = fit(problem(data, 0.0, told=False), np.array([2.0, 3.0]))
    covariance = first.covariance / np.outer(first.units, first.units)
    # so the error of log a at another place has that of shift/b in it
    below, above = (np.sqrt(np.array([1, shift / b]) @ covariance @ [1, shift / b]) for shift in (0.4, -0.4))
    assert abs(below / above - 1) > 0.1
    # the range is many errors wide, and beside it an interval of 95 % is one-sided
    beside = 1.96 * norm.ppf(0.95) / norm.ppf(0.975)
    assert low == pytest.approx([0.4 / b + beside * below, 1.96 * errors[1]], rel=1e-4)
    assert high == pytest.approx([0.4 / b + beside * above, 1.96 * errors[1]], rel=1e-4)
    assert matters(found, errors).tolist() == [True, False]
    assert (
        likeliest(
            fit(problem(data, 0.0, told=False), np.array([2.0, 3.0])),
            lambda s: problem(data, s, told=False),
            (-0.4, 0.4),
        )
        == 0.0
    )


@pytest.mark.parametrize("width", [0.0, 0.02, 0.5, 1.0, 3.0, 30.0])
def test_an_interval_over_a_range_holds_every_place_of_it_in_95_percent(width: float) -> None:
    """Two places that are equally likely, ``width`` standard errors apart: the least coverage is at the ends."""
    profile = BoundedProfile(np.array([0.0, 1.0]), np.zeros(2), np.array([[0.0], [width]]), np.ones((2, 1, 1)))
    below, above = profile.reach(np.ones(1), np.array([norm.ppf(0.975)]))
    low, high = width / 2 - below[0], width / 2 + above[0]
    for truth in (0.0, width):
        # the estimates of both ends move alike: the interval holds the truth unless they are too far from it
        assert norm.cdf(truth - low) - norm.cdf(truth - high) == pytest.approx(0.95, abs=1e-6)


@pytest.mark.parametrize("place", [0.0, 0.5, 1.0])
def test_an_interval_beside_a_range_that_the_data_tell_holds_the_truth_at_its_ends(place: float) -> None:
    """One-sided quantiles, right beside a range that is known, held 91.5 % of the truths at its ends."""
    count, spread, slope = 3000, 0.2, 20.0
    random = np.random.default_rng(7)
    places = np.linspace(0.0, 1.0, 101)
    held = 0
    for told, error in zip(place + spread * random.standard_normal(count), random.standard_normal(count), strict=True):
        deviance = ((places - told) / spread) ** 2
        coordinates = (slope * (places - place) + error)[:, None]
        profile = BoundedProfile(places, deviance - deviance.min(), coordinates, np.ones((len(places), 1, 1)))
        below, above = profile.reach(np.ones(1), np.array([norm.ppf(0.975)]))
        middle = float(np.interp(profile.middle, places, coordinates[:, 0]))
        held += bool(middle - below[0] <= 0.0 <= middle + above[0])
    assert held >= 0.93 * count


@pytest.mark.parametrize("shift", [-0.4, 0.0, 0.25])
def test_what_the_data_tell_is_found(shift: float) -> None:
    """The interval of the quantity, and those of the parameters, hold the truth."""
    held = np.zeros(3)
    data = sets(shift, told=True, count=40)
    for each in data:
        found, errors, _ = profiled(each, told=True)
        low, high = found.admitted
        middle = np.array([np.interp(found.middle, found.places, c) for c in found.coordinates.T])
        down, up = found.reach(errors, np.full(2, 1.99))
        truth = np.log([2.0, 3.0])
        held += [low <= shift <= high, *((middle - down <= truth) & (truth <= middle + up))]
        assert high - low < 0.1
    assert (held >= 0.9 * len(data)).all()


def test_a_place_that_is_known_already_is_not_one_more() -> None:
    places = np.array([0.0, 1.0, 2.0])
    profile = BoundedProfile(places, np.zeros(3), np.zeros((3, 1)), np.ones((3, 1, 1)))
    for place in (0.0, 1.0, 2.0, 0.5):
        known = profile.knowing(place, np.array([7.0]))
        assert (np.diff(known.places) > 0).all()
        assert known.coordinates[np.searchsorted(known.places, place), 0] == 7.0
        assert np.isfinite(known.range).all()


def _made(places: list[float], deviance: list[float], coordinates: list[float]) -> BoundedProfile:
    rows = np.array(coordinates)[:, None]
    return BoundedProfile(np.array(places), np.array(deviance), rows, np.ones((len(places), 1, 1)))


def test_a_profile_holds_what_another_model_admits_too() -> None:
    own = _made([-1.0, 0.0, 1.0], [4.84, 0.0, 4.84], [1.0, 2.0, 3.0])
    other = _made([2.0, 3.0, 4.0], [4.84, 0.0, 4.84], [6.0, 7.0, 8.0])
    both = own.beside(other)
    assert both.middle == own.middle == pytest.approx(0.0)
    assert both.admitted == pytest.approx((own.admitted[0], other.admitted[1]))
    (low,), (high,) = both.reach(np.array([0.1]), np.array([1.96]))
    assert low == pytest.approx(own.reach(np.array([0.1]), np.array([1.96]))[0][0])
    assert 2.0 + high == pytest.approx(7.0 + other.reach(np.array([0.1]), np.array([1.96]))[1][0])


def test_what_both_models_admit_is_held_once() -> None:
    own = _made([-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 3.0])
    assert own.beside(own) is own


@pytest.mark.parametrize(
    ("slope", "place", "width"),
    [(30.0, 0.0, 8.0), (30.0, 0.0, 2.0), (3.0, 0.0, 8.0), (0.3, 0.0, 8.0), (30.0, 4.0, 8.0)],
)
def test_a_place_at_its_bound_costs_no_coverage(slope: float, place: float, width: float) -> None:
    """A parameter c + slope (place) of a place that is told with a standard error of 1, and may be at its bound 0."""
    random, places, covariances = np.random.default_rng(1), np.linspace(0, width, 81), np.ones((81, 1, 1))
    draws = random.standard_normal((4000, 2))
    held = 0
    for told, own in draws:
        deviance = (places - place - told) ** 2
        at = own + slope * (places - place)
        found = BoundedProfile(places, deviance - deviance.min(), at[:, None], covariances)
        below, above = found.reach(np.ones(1), np.array([1.96]))
        estimate = float(np.interp(found.middle, places, at))
        held += estimate - below[0] <= 0 <= estimate + above[0]
    # 0.938 at the bound with the normal quantile; four thousand draws tell 0.0035
    assert held / len(draws) > 0.942


@pytest.mark.parametrize("shift", [-0.4, -0.11, 0.0, 0.23, 0.39])
def test_the_likeliest_place_is_that_of_a_fine_profile(shift: float) -> None:
    data = sets(shift, told=True, count=1)[0]
    found = fit(problem(data, 0.0, told=True), np.array([2.0, 3.0]))
    place, coordinates = likeliest_place(found, lambda s: problem(data, s, told=True), (-0.4, 0.4))
    fine = np.linspace(-0.4, 0.4, 1601)
    squares = [fit(problem(data, s, told=True), np.array([2.0, 3.0])).sum_of_squares for s in fine[::40].tolist()]
    near = fine[np.abs(fine - fine[::40][int(np.argmin(squares))]) <= 0.02]
    fits = [fit(problem(data, s, told=True), np.array([2.0, 3.0])) for s in near.tolist()]
    best = min(range(len(fits)), key=lambda k: fits[k].sum_of_squares)
    assert place == pytest.approx(near[best], abs=1e-3)
    assert coordinates == pytest.approx(fits[best].coordinates, abs=1e-3)


def test_any_place_is_the_likeliest_of_what_the_data_do_not_tell() -> None:
    data = sets(0.3, told=False, count=1)[0]
    found = fit(problem(data, 0.0, told=False), np.array([2.0, 3.0]))
    place, coordinates = likeliest_place(found, lambda s: problem(data, s, told=False), (-0.4, 0.4))
    assert -0.4 <= place <= 0.4
    left = problem(data, place, told=False).sum_of_squares(coordinates[None])
    assert left == pytest.approx(found.sum_of_squares, rel=1e-6)

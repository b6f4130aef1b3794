"""The elementary functions against exact values, and floats against arrays."""

from decimal import Decimal, getcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam import dmath

getcontext().prec = 60
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")


def exact_sin(x: Decimal) -> Decimal:
    x = x % (2 * PI)
    term: Decimal = x
    result: Decimal = x
    n = 1
    while abs(term) > Decimal("1e-55"):
        term *= -x * x / ((n + 1) * (n + 2))
        n += 2
        result += term
    return result


def exact_atan(x: Decimal) -> Decimal:
    """By halving the argument until the series converges fast."""
    doublings = 0
    while abs(x) > Decimal("0.01"):
        x = x / (1 + (1 + x * x).sqrt())
        doublings += 1
    result = Decimal(0)
    for n in range(16):
        term = x ** (2 * n + 1) / (2 * n + 1)
        result += -term if n % 2 else term
    return Decimal(result * 2**doublings)


def exact_atan2(y: Decimal, x: Decimal) -> Decimal:
    if abs(y) > abs(x):
        return (PI / 2 if y > 0 else -PI / 2) - exact_atan(x / y)
    angle = exact_atan(y / x)
    return angle if x > 0 else angle + (PI if y >= 0 else -PI)


def ulps(value: float, exact: Decimal) -> float:
    return abs(float((Decimal(value) - exact) / Decimal(float(np.spacing(abs(float(exact)))))))


RNG = np.random.default_rng(1)
ANGLES = np.concatenate([RNG.uniform(-7, 7, 700), RNG.uniform(-1e5, 1e5, 300), np.arange(-8, 9) * np.pi / 4])
PAIRS = np.concatenate([RNG.normal(size=(900, 2)), np.array([[0.0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [-1, -1]])])
POSITIVE = np.exp(RNG.uniform(-40, 40, 600))


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_sine_and_cosine_are_within_an_ulp(name: str) -> None:
    shift = PI / 2 if name == "cos" else Decimal(0)
    values = getattr(dmath, name)(ANGLES)
    for x, value in zip(ANGLES, values, strict=True):
        exact = exact_sin(Decimal(float(x)) + shift)
        assert ulps(value, exact) <= 1.0 or abs(Decimal(float(value)) - exact) < Decimal("1e-21"), x


def test_atan2_is_within_an_ulp() -> None:
    values = dmath.atan2(PAIRS[:, 1], PAIRS[:, 0])
    for (x, y), value in zip(PAIRS, values, strict=True):
        exact = exact_atan2(Decimal(float(y)), Decimal(float(x)))
        assert (value == 0.0 and exact == 0) or ulps(value, exact) <= 1.0, (y, x)
    assert dmath.atan2(0.0, 0.0) == 0.0


def test_exp_log_and_hypot_are_within_an_ulp() -> None:
    exponents = np.log(POSITIVE)
    for x, value in zip(exponents, dmath.exp(exponents), strict=True):
        assert ulps(value, Decimal(float(x)).exp()) <= 1.0, x
    for x, value in zip(POSITIVE, dmath.log(POSITIVE), strict=True):
        assert ulps(value, Decimal(float(x)).ln()) <= 1.0, x
    for (x, y), value in zip(PAIRS, dmath.hypot(PAIRS[:, 0], PAIRS[:, 1]), strict=True):
        assert ulps(value, (Decimal(float(x)) ** 2 + Decimal(float(y)) ** 2).sqrt()) <= 1.0


@given(st.floats(-1e5, 1e5), st.floats(-1e3, 1e3), st.floats(1e-300, 1e300))
def test_floats_and_arrays_give_the_same_bits(angle: float, other: float, positive: float) -> None:
    def bits(value: float) -> bytes:
        return np.float64(value).tobytes()

    one = np.array([angle])
    for scalar, array in zip(dmath.sincos(angle), dmath.sincos(one), strict=True):
        assert bits(scalar) == bits(array[0])
    assert bits(dmath.atan2(angle, other)) == bits(dmath.atan2(one, np.array([other]))[0])
    assert bits(dmath.hypot(angle, other)) == bits(dmath.hypot(one, np.array([other]))[0])
    assert bits(dmath.exp(other / 2)) == bits(dmath.exp(np.array([other / 2]))[0])
    assert bits(dmath.log(positive)) == bits(dmath.log(np.array([positive]))[0])


def test_sums_have_one_order() -> None:
    values = np.array([1e16, 1.0, -1e16, 1.0])
    assert dmath.total(values) == dmath.ordered_sum(values.tolist()) == 1.0
    assert dmath.mean(values) == 0.25

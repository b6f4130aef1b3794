"""Elementary functions that give the same bits on every machine, numpy and Python.

Built from + − * / sqrt, rint, frexp and ldexp alone, which IEEE 754 fixes to the bit; a platform's own sin or exp is
not. The series are Taylor's on a reduced argument (Cody and Waite, *Software Manual for the Elementary Functions*,
1980); low parts are carried along so that the last rounding decides. Each function takes floats or float64 arrays and
gives the same bits for both.

Errors, checked against exact values in the tests, for finite arguments: sin, cos (|x| ≤ 1e5), atan2, exp, log: ≤ 1 ulp
(near a zero of sin or cos, where an ulp means nothing, 1e-21 absolute); hypot ≤ 1 ulp, no guard against overflow.
"""

from collections.abc import Iterable, Sequence
from typing import TypeVar, overload

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Number = TypeVar("Number", float, Floats)

PI = 3.141592653589793
DEGREE = PI / 180.0

_TWO_OVER_PI = 0.6366197723675814
# π/2 in three parts of 33 bits: k times a part is exact for |k| < 2^20.
_HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
_LN2 = (0.6931471803691238, 1.9082149292705877e-10)  # ln 2 in two parts, the first of 32 bits
_SQRT_HALF = 0.7071067811865476
_SPLIT = 134217729.0  # 2^27 + 1: Veltkamp's constant

_SIN = tuple((-1.0) ** n / f for n, f in enumerate((6.0, 120.0, 5040.0, 362880.0, 39916800.0, 6227020800.0,
                                                    1307674368000.0, 355687428096000.0), start=1))  # fmt: skip
_COS = tuple((-1.0) ** n / f for n, f in enumerate((24.0, 720.0, 40320.0, 3628800.0, 479001600.0, 87178291200.0,
                                                    20922789888000.0, 6402373705728000.0), start=2))  # fmt: skip
_SIN_SIGN, _COS_SIGN = np.array([1.0, 1.0, -1.0, -1.0]), np.array([1.0, -1.0, -1.0, 1.0])  # by quadrant
_EXP = tuple(1.0 / f for f in (2.0, 6.0, 24.0, 120.0, 720.0, 5040.0, 40320.0, 362880.0, 3628800.0, 39916800.0,
                               479001600.0, 6227020800.0, 87178291200.0))  # fmt: skip
_ATAN = tuple((-1.0) ** n / (2.0 * n + 1.0) for n in range(1, 8))
_LOG = tuple(1.0 / (2.0 * n + 1.0) for n in range(1, 11))

# atan(k/8) for k = 0..8, high and low parts.
_ATAN_EIGHTHS = (0.0, 0.12435499454676144, 0.24497866312686414, 0.35877067027057225, 0.4636476090008061,
                 0.5585993153435624, 0.6435011087932844, 0.7188299996216245, 0.7853981633974483)  # fmt: skip
_ATAN_EIGHTHS_LOW = (0.0, -3.1253241424539383e-18, 1.0698755618734451e-17, -2.4623815582638635e-17,
                     2.2698777452961687e-17, -5.4556305485916264e-18, 1.5834785051444286e-17,
                     -2.1478388444456983e-17, 3.061616997868383e-17)  # fmt: skip
_HIGH, _LOW = np.array(_ATAN_EIGHTHS), np.array(_ATAN_EIGHTHS_LOW)
_HALF_PI_HIGH, _HALF_PI_LOW = 1.5707963267948966, 6.123233995736766e-17


def _series(x: Number, coefficients: tuple[float, ...]) -> Number:
    """c0 + x (c1 + x (c2 + …)), in Horner's order."""
    total = x * coefficients[-1]
    total += coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        total *= x
        total += coefficient
    return total


def _reduce(x: Number, k: Number) -> tuple[Number, Number]:
    """x − k π/2 as a high and a low part."""
    first = x - k * _HALF_PI[0]
    second = k * _HALF_PI[1]
    high = first - second
    low = ((first - high) - second) - k * _HALF_PI[2]
    total = high + low
    return total, (high - total) + low


def _sin_kernel(r: Number, low: Number) -> Number:
    square = r * r
    return r + (r * square * _series(square, _SIN) + low * (1.0 - 0.5 * square))


def _cos_kernel(r: Number, low: Number) -> Number:
    square = r * r
    half = 0.5 * square
    head = 1.0 - half
    return head + (((1.0 - head) - half) + (square * square * _series(square, _COS) - r * low))


def sincos(x: Number) -> tuple[Number, Number]:
    """Sine and cosine of x rad."""
    if isinstance(x, np.ndarray):
        k = np.rint(x * _TWO_OVER_PI)
        r, low = _reduce(x, k)
        s, c = _sin_kernel(r, low), _cos_kernel(r, low)
        quadrant = k.astype(np.int64) & 3
        odd = (quadrant & 1) == 1
        return np.where(odd, c, s) * _SIN_SIGN[quadrant], np.where(odd, s, c) * _COS_SIGN[quadrant]
    turns = round(x * _TWO_OVER_PI)
    r, low = _reduce(x, float(turns))
    s, c = _sin_kernel(r, low), _cos_kernel(r, low)
    return ((s, c), (c, -s), (-s, -c), (-c, s))[turns & 3]


def sin(x: Number) -> Number:
    """Sine of x rad."""
    return sincos(x)[0]


def cos(x: Number) -> Number:
    """Cosine of x rad."""
    return sincos(x)[1]


@overload
def atan2(y: float, x: float) -> float: ...
@overload
def atan2(y: Floats, x: Floats) -> Floats: ...
def atan2(y: float | Floats, x: float | Floats) -> float | Floats:
    """Angle of the vector (x, y), in (−π, π]; 0 for the zero vector."""
    if isinstance(y, np.ndarray) and isinstance(x, np.ndarray):
        ax, ay = np.abs(x), np.abs(y)
        steep = ay > ax
        small, large = np.where(steep, ax, ay), np.where(steep, ay, ax)
        safe = np.where(large == 0.0, 1.0, large)
        eighth = np.rint(small / safe * 8.0)
        z = _atan_remainder(small, safe, eighth * 0.125)
        index = eighth.astype(np.int64)
        angle, tail = _atan_kernel(z, _HIGH[index], _LOW[index])
        other, other_tail = _from(_HALF_PI_HIGH, _HALF_PI_LOW, angle, tail)
        angle, tail = np.where(steep, other, angle), np.where(steep, other_tail, tail)
        other, other_tail = _from(PI, 2.0 * _HALF_PI_LOW, angle, tail)
        angle = np.where(x < 0.0, other + other_tail, angle + tail)
        return np.where(y < 0.0, -angle, angle)
    return _atan2_scalar(float(y), float(x))


def _atan2_scalar(y: float, x: float) -> float:
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    small, large = (ax, ay) if steep else (ay, ax)
    large = 1.0 if large == 0.0 else large
    eighth = round(small / large * 8.0)
    z = _atan_remainder(small, large, eighth * 0.125)
    angle, tail = _atan_kernel(z, _ATAN_EIGHTHS[eighth], _ATAN_EIGHTHS_LOW[eighth])
    if steep:
        angle, tail = _from(_HALF_PI_HIGH, _HALF_PI_LOW, angle, tail)
    if x < 0.0:
        angle, tail = _from(PI, 2.0 * _HALF_PI_LOW, angle, tail)
    return -(angle + tail) if y < 0.0 else angle + tail


def _atan_remainder(small: Number, large: Number, c: Number) -> Number:
    """z with atan(small/large) = atan(c) + atan(z); c has 4 bits, so that c times half of `large` is exact."""
    big = _SPLIT * large
    high = big - (big - large)
    low = large - high
    return ((small - c * high) - c * low) / (large + c * small)


def _atan_kernel(z: Number, high: Number, low: Number) -> tuple[Number, Number]:
    """atan(z) plus a constant, as a high and a low part."""
    square = z * z
    rest = z * square * _series(square, _ATAN) + low
    angle = high + z
    return angle, ((high - angle) + z) + rest


def _from(whole: float, whole_tail: float, angle: Number, tail: Number) -> tuple[Number, Number]:
    """A constant minus an angle, each in two parts."""
    difference = whole - angle
    return difference, ((whole - difference) - angle) + (whole_tail - tail)


def hypot(x: Number, y: Number) -> Number:
    """Length of the vector (x, y)."""
    return sqrt(x * x + y * y)


def sqrt(x: Number) -> Number:
    """Square root; IEEE 754 rounds it correctly everywhere."""
    if isinstance(x, np.ndarray):
        return np.sqrt(x)
    return float(np.sqrt(x))


def exp(x: Number) -> Number:
    """e to the power x, for |x| < 700."""
    if isinstance(x, np.ndarray):
        k = np.rint(x / (_LN2[0] + _LN2[1]))
        return np.ldexp(_exp_kernel(x, k), k.astype(np.int32))
    k_int = round(x / (_LN2[0] + _LN2[1]))
    return float(np.ldexp(_exp_kernel(x, float(k_int)), k_int))


def _exp_kernel(x: Number, k: Number) -> Number:
    high = x - k * _LN2[0]
    low = k * _LN2[1]
    r = high - low
    tail = (high - r) - low
    return 1.0 + (r + (r * r * _series(r, _EXP) + tail * (1.0 + r)))


def log(x: Number) -> Number:
    """Natural logarithm of a positive, normal x."""
    if isinstance(x, np.ndarray):
        mantissa, exponent = np.frexp(x)
        low = mantissa < _SQRT_HALF
        k = exponent.astype(np.float64) - low
        return _log_kernel(np.where(low, 2.0 * mantissa, mantissa) - 1.0, k)
    m, e = np.frexp(x)
    f, k_float = (2.0 * float(m) - 1.0, float(e) - 1.0) if m < _SQRT_HALF else (float(m) - 1.0, float(e))
    return _log_kernel(f, k_float)


def _log_kernel(f: Number, k: Number) -> Number:
    """log(1 + f) + k ln 2: with s = f/(2+f), log(1+f) = f − (f²/2 − s (f²/2 + R))."""
    s = f / (2.0 + f)
    square = s * s
    rest = 2.0 * square * _series(square, _LOG)
    half = 0.5 * f * f
    return k * _LN2[0] - ((half - (s * (half + rest) + k * _LN2[1])) - f)


def total(values: Floats) -> float:
    """Sum of a one-dimensional array from first to last, whatever the machine's vector width."""
    return float(np.cumsum(values)[-1]) if len(values) else 0.0


def mean(values: Floats) -> float:
    """Mean of a one-dimensional array that is not empty, summed from first to last."""
    return total(values) / len(values)


def ordered_sum(values: Iterable[float]) -> float:
    """Sum of floats from first to last (the built-in sum compensates since Python 3.12)."""
    result = 0.0
    for value in values:
        result += value
    return result


def median(values: Sequence[float]) -> float:
    """The middle value, or the mean of the two middle ones."""
    ordered = sorted(values)
    half = len(ordered) // 2
    return 0.5 * (ordered[half] + ordered[~half])

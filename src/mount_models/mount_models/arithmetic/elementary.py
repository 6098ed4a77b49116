"""Elementary functions whose every bit is the same on every processor.

The C library and numpy hold several variants of `exp`, `log` or `sin` and choose one by the processor;
their last bits differ. Here only operations are used of which IEEE 754 prescribes every bit, + - * / and
rounding to a whole number, in an order that no compiler may change (without `fastmath` none contracts or
reorders), and shifts of the exponent, which are exact.

Each argument is brought near 0, where a power series is short. The coefficients are those of the textbook,
such as 1 / n!, each rounded once, and so many that what is left out lies below 2^-55 of the result. The
errors stated are in units in the last place (ulp); tests hold them against longer mantissas.
"""

import math
from fractions import Fraction

import numpy as np

from mount_models.arithmetic.compiled import compiled

_LN_2 = Fraction('0.693147180559945309417232121458176568075500134360255254')
_PI = Fraction('3.141592653589793238462643383279502884197169399375105821')


@compiled
def exp(x):
    """Return e^x within 1 ulp; exact at 0. Below 1e-307 it has the fewer bits of such numbers."""
    if not _LOWEST_EXPONENT < x < _HIGHEST_EXPONENT:
        return math.inf if x > 0.0 else 0.0 if x < 0.0 else x
    doublings, rest = _without_doublings(x)
    first = doublings >> 1  # in two steps, for neither 2^1024 nor 2^-1074 is a normal number
    return (1.0 + _growth(rest)) * _power_of_two(first) * _power_of_two(doublings - first)


@compiled
def expm1(x):
    """Return e^x - 1 within 2 ulp, also of small results; exact at 0."""
    if not -40.0 < x < 40.0:  # from here on one of the two terms lies below half an ulp of the other
        return -1.0 if x < 0.0 else exp(x)
    doublings, rest = _without_doublings(x)
    power = _power_of_two(doublings)
    return (power - 1.0) + power * _growth(rest)


@compiled
def log(x):
    """Return the natural logarithm within 1 ulp; exact at 1, minus infinity at 0, NaN below."""
    if _SMALLEST_NORMAL <= x < math.inf:
        return _scaled_log(x, 0)
    if 0.0 < x < math.inf:
        return _scaled_log(x * 2.0**54, 54)
    return -math.inf if x == 0.0 else x if x > 0.0 else math.nan


@compiled
def atan(x):
    """Return the arc tangent (rad) within 2 ulp; odd, exact at 0."""
    size = abs(x)
    if size <= _TAN_EIGHTH_PI:
        base, base_low, t = 0.0, 0.0, size
    elif size <= 1.0 / _TAN_EIGHTH_PI:
        base, base_low, t = _QUARTER_PI, _QUARTER_PI_LOW, (size - 1.0) / (size + 1.0)
    else:
        base, base_low, t = 2.0 * _QUARTER_PI, 2.0 * _QUARTER_PI_LOW, -1.0 / size
    square, series = t * t, 0.0
    for k in range(len(_ATAN) - 1, 0, -1):
        series = (series + _ATAN[k]) * square
    return math.copysign(base + (t + (t * series + base_low)), x)


@compiled
def sine_and_cosine(turns):
    """Return (sin, cos) of 2 pi `turns`, each within 2 ulp; exact at every quarter turn.

    An angle in turns needs no reduction by pi: what is beyond the nearest quarter is left over exactly.
    """
    within = turns - np.rint(turns)
    quarters = np.rint(4.0 * within)
    rest = within - 0.25 * quarters  # -1/8 .. 1/8
    square = rest * rest
    fourth = square * square
    eighth = fourth * fourth
    s, c = _SINE, _COSINE
    sine = (s[1] + s[2] * square) + (s[3] + s[4] * square) * fourth
    sine += ((s[5] + s[6] * square) + (s[7] + s[8] * square) * fourth) * eighth
    sine = rest * s[0] + rest * (square * sine + _TWO_PI_LOW)
    cosine = (c[1] + c[2] * square) + (c[3] + c[4] * square) * fourth
    cosine += ((c[5] + c[6] * square) + (c[7] + c[8] * square) * fourth) * eighth
    cosine = 1.0 + square * cosine
    if quarters == 0.0:
        return sine, cosine
    if quarters == 1.0:
        return cosine, -sine
    if quarters == -1.0:
        return -cosine, sine
    return -sine, -cosine


@compiled
def sines(turns):
    """Return sin(2 pi t) for each t of `turns`, (n,)."""
    return _each(turns, 0)


@compiled
def cosines(turns):
    """Return cos(2 pi t) for each t of `turns`, (n,)."""
    return _each(turns, 1)


@compiled
def _each(turns, place):
    result = np.empty(turns.size)
    for k in range(turns.size):
        result[k] = sine_and_cosine(turns[k])[place]
    return result


def _high(value: Fraction, bits: int) -> float:
    """Return `value` cut off behind so many binary places: few enough for exact products."""
    return math.floor(value * 2**bits) / 2**bits


_LN_2_HIGH = _high(_LN_2, 40)
_LN_2_LOW = float(_LN_2 - Fraction(_LN_2_HIGH))
_PER_LN_2 = float(1 / _LN_2)
_LOWEST_EXPONENT, _HIGHEST_EXPONENT = -745.2, 709.79  # 0 below, infinity above
_SMALLEST_NORMAL = 2.0**-1022
_ROOT_HALF_BITS = int(np.float64(math.sqrt(0.5)).view(np.int64))
_TAN_EIGHTH_PI = math.sqrt(2.0) - 1.0
_QUARTER_PI = float(_PI / 4)
_QUARTER_PI_LOW = float(_PI / 4 - Fraction(_QUARTER_PI))
_TWO_PI_LOW = float(2 * _PI - Fraction(float(2 * _PI)))

_EXP = tuple(1 / math.factorial(n) for n in range(14))
_ARTANH = tuple(1 / (2 * n + 1) for n in range(11))
_ATAN = tuple((-1) ** n / (2 * n + 1) for n in range(21))
_SINE = tuple(float((-1) ** n * (2 * _PI) ** (2 * n + 1) / math.factorial(2 * n + 1)) for n in range(9))
_COSINE = tuple(float((-1) ** n * (2 * _PI) ** (2 * n) / math.factorial(2 * n)) for n in range(9))


@compiled
def _power_of_two(exponent):
    """Return 2^exponent for whole numbers -1022 .. 1023."""
    return np.int64((exponent + 1023) << 52).view(np.float64)


@compiled
def _without_doublings(x):
    """Return (k, r) with x = k ln 2 + r and |r| <= ln 2 / 2; the product with the high part is exact."""
    doublings = np.rint(x * _PER_LN_2)
    return int(doublings), (x - doublings * _LN_2_HIGH) - doublings * _LN_2_LOW


@compiled
def _growth(r):
    """Return e^r - 1 for |r| <= ln 2 / 2."""
    e, square = _EXP, r * r
    fourth = square * square
    low = (e[2] + e[3] * r) + (e[4] + e[5] * r) * square
    middle = (e[6] + e[7] * r) + (e[8] + e[9] * r) * square
    high = (e[10] + e[11] * r) + (e[12] + e[13] * r) * square
    return r + square * (low + fourth * (middle + fourth * high))


@compiled
def _scaled_log(x, halvings):
    """Return ln(x / 2^halvings) of a positive normal number x = 2^k (1 + z) with -0.3 < z < 0.42.

    ln(1 + z) = 2 artanh f with f = z / (2 + z), that is 2 f + f r with r = 2 f^2 / 3 + 2 f^4 / 5 + ...; as
    2 f is z - f z, this is z - f (z - r), in which the rounding of f hardly counts.
    """
    bits = np.float64(x).view(np.int64)
    doublings = (bits - _ROOT_HALF_BITS) >> 52
    z = np.int64(bits - (doublings << 52)).view(np.float64) - 1.0
    doublings -= halvings
    f = z / (2.0 + z)
    a, square = _ARTANH, f * f
    fourth = square * square
    low = (a[1] + a[2] * square) + (a[3] + a[4] * square) * fourth
    high = (a[5] + a[6] * square) + (a[7] + a[8] * square) * fourth
    eighth = fourth * fourth
    series = low + eighth * (high + eighth * (a[9] + a[10] * square))
    return doublings * _LN_2_HIGH + (z - (f * (z - 2.0 * square * series) - doublings * _LN_2_LOW))

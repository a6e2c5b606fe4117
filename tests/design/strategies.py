"""Random plants and closed loops for the design tests."""

import numpy as np
from hypothesis import strategies as st

from design.polynomial import from_roots, multiply
from identification.arrays import Array


@st.composite
def stable_polynomial(draw: st.DrawFn, low: int = 1, high: int = 8) -> Array:
    """A polynomial of degree low to high with all roots inside |z| < 0.95."""
    degree = draw(st.integers(low, high))
    pairs = draw(st.integers(0, degree // 2))
    radius = st.floats(0.05, 0.95)
    z: list[complex] = []
    for _ in range(pairs):
        r, angle = draw(radius), draw(st.floats(0.05, np.pi - 0.05))
        z += [r * np.exp(1j * angle), r * np.exp(-1j * angle)]
    z += [draw(radius) * draw(st.sampled_from((-1, 1))) for _ in range(degree - 2 * pairs)]
    return from_roots(np.array(z))


@st.composite
def plant(draw: st.DrawFn, high: int = 6) -> tuple[Array, Array]:
    """(A, B) with a delay of 1 to 5 samples, A stable or with an integrator, B of any zeros."""
    A = draw(stable_polynomial(1, high))
    if draw(st.booleans()):
        A = multiply(A, np.array([1.0, -1.0]))
    zeros = draw(st.lists(st.floats(-3, 3).filter(lambda z: abs(z) > 0.02), max_size=high - 1))
    gain = draw(st.floats(-4, 1).map(lambda x: 10.0**x)) * draw(st.sampled_from((-1, 1)))
    B = gain * multiply(*(np.array([1.0, -z]) for z in zeros))
    return A, np.concatenate([np.zeros(draw(st.integers(1, 5))), B])

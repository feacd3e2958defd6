"""Which numeric side suits an expression."""

import numpy as np
import sympy

from implicit.algebra.expand import Expansion
from implicit.algebra.polynomial import Polynomial, expansion_terms
from implicit.evaluate import Field, PolynomialField, TapeField
from implicit.tape import make_tape

_MOST_COEFFICIENTS = 4096  # of a polynomial written as a full table
_MOST_DEGREE = 40  # in one variable


def make_field(expression: sympy.Expr, expansion: Expansion | None, polynomial: Polynomial | None) -> Field:
    """Coefficients for polynomials of moderate degree, a tape for everything else.

    A polynomial of high degree loses digits when it is multiplied out; its tape computes it as it was written.
    """
    degrees = np.array(expansion.flint.degrees()[:3]) if expansion is not None else np.array([np.inf])
    if expansion is not None and degrees.max() <= _MOST_DEGREE and np.prod(degrees + 1) <= _MOST_COEFFICIENTS:
        if polynomial is not None:
            return PolynomialField(polynomial.exponents, polynomial.coefficients, polynomial.coefficient_errors)
        return PolynomialField(*expansion_terms(expansion))
    return TapeField(make_tape(expression))

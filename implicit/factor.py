"""Square-free parts and factors over Q and over real number fields."""

from math import prod

from implicit.polynomial import Polynomial


def square_free(p: Polynomial) -> Polynomial:
    """The product of the distinct irreducible factors of p."""
    if p.field is None:
        _, parts = p.flint.factor_squarefree()
        return Polynomial(prod((part for part, _ in parts), start=p.flint * 0 + 1))
    raise NotImplementedError


def factors(p: Polynomial) -> list[tuple[Polynomial, int]]:
    """The irreducible factors of p with their multiplicities."""
    if p.field is None:
        return [(Polynomial(part), int(power)) for part, power in p.flint.factor()[1]]
    raise NotImplementedError

"""Singular points and curves of surfaces, with proofs."""

from implicit.singular.kinds import SingularCurve, SingularLocus, SingularPoint
from implicit.singular.locus import singularities

"""Singular points and curves of surfaces, with proofs."""

from implicit.singular.locus import SingularCurve, SingularLocus, SingularPoint, singularities

"""Random members of families: the mesh has the topology that theory gives, at default settings, and is not refused."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from implicit.polygonizers.conforming import conforming
from tests.singular_cases import residual, topology
from tests.singular_families import (
    NORMAL_FORMS,
    Member,
    between_roots,
    cone_over_a_curve,
    euler_from_levels,
    four_nodes,
    normal_form,
    two_quadrics,
)

_SEEDS = st.integers(0, 10**6)


def _check(member: Member) -> None:
    mesh = conforming(member.surface, member.bounds, 24)
    assert topology(mesh) == member.truth
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0
    if len(mesh.faces):
        assert residual(member.surface, mesh) <= 1e-10 * member.bounds.radius


@pytest.mark.parametrize("family", [cone_over_a_curve, between_roots, two_quadrics])
@settings(max_examples=8, deadline=None, derandomize=True)
@given(_SEEDS)
def test_random_members_are_what_theory_says(family: Callable[[np.random.Generator], Member | None], seed: int) -> None:
    member = family(np.random.default_rng(seed))
    assume(member is not None)
    assert member is not None
    _check(member)


@pytest.mark.parametrize("kind", NORMAL_FORMS)
def test_affine_images_of_simple_singularities(kind: str) -> None:
    member = normal_form(kind, np.random.default_rng(list(NORMAL_FORMS).index(kind)))
    _check(member)
    solitary = member.truth["links"] == [(0, 0)]
    assert euler_from_levels(member.surface, member.bounds, 48) == member.truth["euler"] + solitary


@settings(max_examples=4, deadline=None, derandomize=True)
@given(_SEEDS)
def test_cubics_with_four_nodes_lie_halfway_between_their_levels(seed: int) -> None:
    surface, bounds = four_nodes(np.random.default_rng(seed))
    euler = euler_from_levels(surface, bounds, 64)
    assume(euler is not None)
    mesh = conforming(surface, bounds, 24)
    assert mesh.unresolved is not None and len(mesh.unresolved) == 0
    assert topology(mesh)["euler"] == euler

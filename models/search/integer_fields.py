"""Fields by greedy rounding and descent over integers: of orthogonal crosses, and of all on meshes.

Where crosses on a mesh may have any angles, the integers of orthogonal ones give the jumps to begin with.
Then angles and best jumps alternate.
"""

from __future__ import annotations

from typing import Final

from ..field.field import CrossField
from ..instance.domain import Ints
from ..instance.instance import Instance
from ..instance.mesh import Mesh
from ..instance.sparse_systems import SimilarSystems
from ..orthogonal.energy import MOST_DENSE, OrthogonalEnergy, field_of, integers_of
from ..orthogonal.greedy import round_greedily
from ..processes.deadline import IsOver
from ..smooth.polyvector import power_field
from .box_qp import FreeField, fit_in_box
from .charge_search import move_charges
from .improvement import settle

_STEPS: Final = 30  # of the power field, where it is the first field


def greedy_integer_field(instance: Instance, is_over: IsOver) -> CrossField:
    """The field of greedy rounding."""
    energy = OrthogonalEnergy.of(instance)
    return finish_field(instance, energy, round_greedily(energy, is_over), is_over)


def first_integer_field(instance: Instance, is_over: IsOver) -> CrossField:
    """The power field after 30 steps; of up to 6,000 points, the lowest of it and others after descent."""
    energy = OrthogonalEnergy.of(instance)
    z = energy.nearest(power_field(instance, steps=_STEPS).alpha)
    if energy.size <= MOST_DENSE:
        starts = [*starting_integers(instance, energy, None, is_over), energy.descend(z, is_over)]
        z = min(starts, key=energy.least_total)
    return finish_field(instance, energy, z, is_over)


def starting_integers(
    instance: Instance, energy: OrthogonalEnergy, start: CrossField | None, is_over: IsOver
) -> list[Ints]:
    """Integers of the power field, the greedy field and a given one, after descent.

    On closed surfaces without handles or strokes, also the lowest of them after moves of charges.
    """
    starts = [energy.nearest(power_field(instance).alpha), round_greedily(energy, is_over)]
    if start is not None:
        starts.append(integers_of(start))
    starts = [energy.descend(z, is_over) for z in starts]
    if energy.size <= MOST_DENSE and energy.sums is None and _are_spheres(instance, energy):
        lowest = min(starts, key=energy.least_total)
        starts.append(move_charges(energy, instance.domain.rings, lowest, is_over))
    return starts


def _are_spheres(instance: Instance, energy: OrthogonalEnergy) -> bool:
    """Whether all parts of a domain are closed and have neither handles nor strokes."""
    domain, free = instance.domain, not len(instance.theta)
    return isinstance(domain, Mesh) and free and domain.euler_characteristic == 2 * len(energy.pins)


def have_energies_of_fields(instance: Instance) -> bool:
    """Whether the energy of integers is that of their field: beta is 0, and no window binds."""
    return instance.orthogonal and instance.gauge == "strokes"


def finish_field(instance: Instance, energy: OrthogonalEnergy, z: Ints, is_over: IsOver) -> CrossField:
    """The field of integers z (r,) in the windows; where beta is free or windows bind, best angles and jumps
    in turn.
    """
    field = field_of(instance, z, energy)
    if instance.indices is not None:
        return field  # within its windows and limits
    if have_energies_of_fields(instance):
        return fit_in_box(field, is_over)
    state = FreeField.of(field)
    settle(state, SimilarSystems(), is_over)
    return state.fit_in_bounds(is_over)

"""Lower bounds of the energy on one refinement level.

A reader may take the modules in this order:

- the problem on a level: `lattice` (labels and costs), `state` (the same as arrays);
- its relaxation: `dual` (the local polytope's dual, by TRW-S), with the compiled code in `passes` and
  `min_plus`, `clusters` (a tighter relaxation at vortices), and `orthogonal_dual` for orthogonal crosses;
- what follows from a dual solution: `combs` (min-marginals on trees), `pruning` (the cells that are left, and
  their boxes), `rounding` (fields), `encoding` (arrays of a certificate).
"""

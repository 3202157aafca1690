"""Proofs that no field has a lower energy.

docs/proofs.md has the theorem. A reader may take the modules in this order:

- the problem on a refinement level: `lattice` (labels and costs), `state` (the same as arrays);
- its relaxation: `dual` (the local polytope's dual, by TRW-S), with the compiled code in `passes` and
  `min_plus`, `clusters` (a tighter relaxation at vortices), `combs` (min-marginals on trees), `pruning` (the
  cells that are left, and their boxes);
- the search for the optimum: `descent` (level after level), `rounding` (fields from the dual), `last_step`
  (pieces of the last boxes), `absolute_descent` (the same for absolute values), `prove` (the function for
  users), `compiling`;
- what stays: `record` (a proof in memory), `certificate` and `encoding` (in a file), `check_certificate` (its
  checker, which uses nothing else), `tightening` (the bounds of variables that it leaves).
"""

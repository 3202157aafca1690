"""Proofs that no field has a lower energy.

docs/proofs.md has the theorem. `prove` is the function for users, and `compiling` compiles what it calls.
`certificate` writes a proof to a file and reads it; `tightening` derives bounds of variables from it.

Crosses of any angle and orthogonal crosses have a prover and a checker each. Both have one idea: labels round
a centre, shares of pairs, tables on short cycles, levels that exclude labels, and a last step. One prover
over points, pairs and rings (`instance.domain`) would have these parts:

- Labels: per point a rectangle in alpha and beta. Orthogonal crosses have the one beta 0. The angle kappa
  between the frames of a pair is added to its difference in alpha.
- Levels: half the spacing, with labels shifted by half a step on one of two colours, where a domain has two
  colours without a conflict. Elsewhere a third, as in `orthogonal`: on an odd ring, some pairs have equal
  colours, and their costs another deduction.
- Shares: passes over the points in an order. The anti-diagonals of a grid may be visited by many threads; the
  general order is that of `orthogonal`.
- Tables: on the alphas of a ring of any length. The quads of a grid are its rings.
- Exclusion: min-marginals of pairs and rings; on a grid also those of two forests, its combs.
- Last step: pieces with multipliers. The cases of `orthogonal` are pieces with a chosen jump at each open
  pair, and a tangent is one choice of multipliers.

`descent/orthogonal.py`, `bound/orthogonal_dual.py` and `check_orthogonal.py` have nearly 1,400 lines; kappa,
rings and the second rule of levels would add some 300 to the others. Skewed crosses on meshes, which have no
proofs, would have them. The costs: passes over sketches lose their regular arrays, unless grids keep a path
of their own, and the certificates that ship have to be made again in one format. The checker comes first,
because it defines the costs of labels and is tested by brute force on small instances.
"""

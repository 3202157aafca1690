"""The theorem of docs/proofs.md and its proof, as the page prints it."""

from __future__ import annotations

from typing import Final

PROOF: Final = r"""
## The theorem

Symbols as in [the mathematics](mathematics.md). Pairs $e = (i, j)$ are neighbours; the energy is the 2-norm
one.

### 1. No integers: crosses are points of a strip

The cross with the label $(\alpha, \beta)$ has the lines $u$ at $\alpha + \beta$ and $v$ at
$\alpha + \pi/2 - \beta$. The label $(\alpha + \pi/2, -\beta)$ exchanges $u$ and $v$: it is the same cross. So
crosses are the points of $\mathbb{R} \times [-\pi/4, \pi/4]$ with these labels glued together: a flat Moebius
strip of length $\pi/2$. A pair with the jump $p$ costs $2(A^2 + B^2)$,

$$
A = \alpha_i - \alpha_j + \tfrac{\pi}{2} p, \qquad B = (-1)^p \beta_i - \beta_j ,
$$

which is twice the squared distance between one of the labels of cross $i$ and a label of cross $j$. The best
jump takes the nearest label, so that the least cost is $2 d(x_i, x_j)^2$, with the distance $d$ on the
strip. With the nearer line at every stroke, at the turn that is nearest, a field of crosses $x$ costs

$$
F(x) = \sum_{ij} \min_p 2(A^2 + B^2) \;+\; \sum_{\text{strokes}} W_i \min_{\text{lines, turns}} R_i^2
\;+\; w_\beta \sum_i \beta_i^2 , \qquad R_i = \text{line} - \theta_i + \text{turn}.
$$

The energy of a field, with whatever labels and jumps, is at least $F$ of its crosses. In the gauge `strokes`
every cross has a label in its window, for which $u$ is the nearer line, and the best jumps are within their
ranges: the least energy is the least $F$. In the gauge `box` it may be higher, and the bound holds as well.

What is left is to minimise a sum of terms of one and of two points of a strip: a Markov random field with
continuous labels.

### 2. A lattice of labels

Let $(\alpha^\ast, \beta^\ast, p^\ast)$ be the best field that is known and $U$ its energy. A *level* has a
spacing $h$. Its labels at pixel $i$ are

$$
\bigl( \alpha^\ast_i + h (k + o_i), \; \beta^\ast_i + h (l + o_i) \bigr), \qquad k, l \in \mathbb{Z},
$$

with $o_i = 0$ on the black and $1/2$ on the white pixels of the checkerboard. They are the corners of square
cells. Some labels are *allowed*; the *domain* of a pixel is the union of the cells with four allowed corners.
On the first level, that is the whole strip.

### 3. Discrete costs that are never too high

For labels $x_i$, $x_j$ let

$$
c_{ij} = \min_p 2 (A^2 + B^2) - h^2, \qquad
D_i = W_i \bigl( \min_{\text{lines, turns}} R_i^2 - \tfrac{1}{2} h^2 \bigr)
      + w_\beta \bigl( \beta_i^2 - \tfrac{1}{4} h^2 \bigr),
$$

without the first term where there is no stroke.

**Lemma 1 (rounding).** Let the crosses $x$ lie in the domains. Then there are a probability distribution
$\mu_i$ on the allowed labels of each pixel, and one $\mu_{ij}$ on the pairs of labels of each pair whose
marginals are $\mu_i$ and $\mu_j$, with

$$
\sum_i \mathbb{E}_{\mu_i} [D_i] + \sum_{ij} \mathbb{E}_{\mu_{ij}} [c_{ij}] \le F(x).
$$

*Proof.* Let $\alpha_i$ and $\beta_i$ be the parts $f$ and $g$ of a step above the lower corner of their cell.
Round $\alpha_i$ up where a threshold $t < f$, and $\beta_i$ up where $t' < g$, for $t$, $t'$ uniform in
$[0, 1]$ and independent. The corner that is hit has the distribution $\mu_i$; its means are $\alpha_i$ and
$\beta_i$, and it says nothing of how thresholds of different pixels depend on each other. That is chosen for
each pair by itself, $p$ being its best jump:

- both pixels take the same $t$. Then $A$ goes to one of the two neighbouring values of a grid of spacing $h$
  between which it lies, because $\lceil a - t \rceil - \lceil b - t \rceil$ is $a - b$ rounded down or up;
- where $p$ is even, both take the same $t'$; where it is odd, one takes $t'$ and the other $1 - t'$, which is
  again uniform and turns rounding upside down, as $B$ does with $\beta_i$. So $B$ as well goes to one of two
  neighbouring values.

The means of both are right. A variable on two values with the distance $h$ has a variance of $h^2/4$ at most.
So the mean of $2(A^2 + B^2)$ after rounding is at most $2(A^2 + B^2) + h^2$, and the least over all jumps is
no more than that of this one: $\mathbb{E}[c_{ij}]$ is at most the pair's term in $F$. At a stroke the nearer
line is a sum or difference of $\alpha_i$ and $\beta_i$, which are rounded independently: its variance is
$h^2 (f(1 - f) + g(1 - g)) \le h^2/2$. The variance of $\beta_i$ is at most $h^2/4$. $\square$

The checkerboard makes this sharp where it matters: at the best known field each difference $A$, $B$ lies in
the middle between two values of its grid, where the variance is $h^2/4$ and nothing is given away. For
strokes the same is reached in another way: on black pixels, where the best known cross is a label, the line
$u$ may lose $0$ at labels with $k + l = 0$, $h^2$ where $|k + l| = 1$ and $h^2/2$ elsewhere; the mean of that
is at least the variance in every cell (`models/proof/lattice.py`).

### 4. Any shares give a bound

Let each pair have *shares* $a_{ij}$, a number for each label of $i$, and $b_{ij}$, one for each label of $j$.

**Lemma 2 (dual bound).** For crosses in the domains, and whatever the shares are,

$$
F \;\ge\; L = \sum_i \min_{x_i} \Bigl( D_i(x_i) + \sum_{\text{pairs at } i} \text{share}(x_i) \Bigr)
  \;+\; \sum_{ij} \min_{x_i, x_j} \bigl( c_{ij}(x_i, x_j) - a_{ij}(x_i) - b_{ij}(x_j) \bigr).
$$

*Proof.* Take the means of Lemma 1. The mean of $c_{ij} - a_{ij} - b_{ij}$ is at least its minimum. What was
taken off there is added to the pixels, with the same distributions, because marginals agree; and a mean over
$\mu_i$ is at least the minimum. $\square$

Good shares are found by sequential tree-reweighted message passing (TRW-S, Kolmogorov 2006), over the pixels
row by row and back. For jumps of one parity a pair's cost is a sum of one term in the alphas and one in the
betas, so that a message of $N^2$ labels takes $O(N^3)$ steps. How good the shares are decides what the bound
is worth, not whether it holds. What the local polytope gives away is next to nothing on nearly all
instances: that is an observation, and the reason why all this works.

### 5. What cannot be better is dropped

In a forward pass let $\theta_i(x)$ be what pixel $i$ has gathered at label $x$ when it is its turn, and $L$
the bound before the pass, which no step of it lowers. In Lemma 2 the minimum at this one pixel may be
replaced by the mean: for crosses in the domains

$$
F \;\ge\; L + \mathbb{E}_{\mu_i} \bigl[ \theta_i(x) - \min \theta_i \bigr].
$$

**Lemma 3 (pruning).** If $L + \theta_i - \min \theta_i > U$ at all four corners of a cell, no field of energy
$U$ or less has its cross of pixel $i$ in that cell.

Such cells are dropped. The next level has half the spacing; its allowed labels are those that are needed to
cover the cells that are left. Its shares begin as those of this level, interpolated. So each level knows: a
field of energy $U$ or less lies in its domains. The number of labels stays about the same, because cells get
smaller as fast as the bound gets better: the deductions fall with $h^2$.

### 6. In the end the problem is convex

The cells that are left span a box for each pixel. Let $s = (-1)^{p^\ast}$.

**Lemma 4 (jumps).** If $|A| \le \pi/2$ and $\pi |A| - \pi^2/4 \le 4 s \beta_i \beta_j$ for all crosses of two
boxes, with $A$ at the jump $p^\ast$, then $p^\ast$ is a best jump for all of them.

*Proof.* One step further, $A^2$ changes by at least $\pi^2/4 - \pi |A|$, and $B^2$ grows by
$(s \beta_i + \beta_j)^2 - (s \beta_i - \beta_j)^2 = 4 s \beta_i \beta_j$: together by no less than 0. More
steps have the $B^2$ of none or of one step, and no less $A^2$, because $|A| \le \pi/2$. $\square$

**Lemma 5 (strokes).** Let $a = \alpha - \theta$ be between $\pm 3\pi/4$ on a box. Where $|a| \le \pi/4$, the
line $u$ at this turn is the nearest. Where $a = \pi/4 + e$, it is $v$, and its square is less by
$4 e (\beta + \pi/4)$; where $a = -\pi/4 - e$, by $4 e (\pi/4 - \beta)$.

*Proof.* $u = a + \beta$, and $v = a \mp \pi/2 - \beta$ at the turn next to it. So
$u^2 - v^2 = (u - v)(u + v) = (2\beta \pm \pi/2)(2a \mp \pi/2)$, which for $a = \pi/4 + e$ is
$4 e (\beta + \pi/4)$, and for $a = -\pi/4 - e$ is $4 e (\pi/4 - \beta)$. For
$e < 0$ neither is above 0. The other turns are farther off, because $|a| \le 3\pi/4$. $\square$

With the greatest $e$ of each box these are linear in $\beta$. So where Lemma 4 holds at all pairs and
$|a| \le 3\pi/4$ at all strokes, $F$ is on the boxes at least a convex quadratic $G$: the energy of
[`qp-fixed`](formulations.md#qp-fixed) with the jumps $p^\ast$, less what is linear.
For any $x$ and $y$ in the
boxes, $G(y) \ge G(x) + \nabla G(x) \cdot (y - x)$, and the least value of the right side is a sum of single
terms.

### 7. The theorem

**Theorem.** Let a chain of levels begin with the whole strip, let each domain cover the cells that are left
of the level before it, and let $U$ be the energy of a field. Then every field has an energy of at least
$\min(U, L)$, with the greatest $L$ of all levels. If on the boxes after the last level Lemmas 4 and 5 apply
and $G$ is at least $U$ there, no field has less energy than $U$.

*Proof.* Take a field of energy $U$ or less. Its crosses are in the domains of the first level, and by Lemma 3
in those of each level after it; so by Lemma 2 its energy is at least each $L$. Its crosses are in the last
boxes, where $F \ge G \ge U$. $\square$

For vortices the bound stays open: the domains of pixels round the core keep several places of it, which the
local polytope mixes. The sample `singular` has one.

### 8. What a certificate holds

For each level: spacing, centres, which labels are allowed, and of each pair the shares $a_{ij}$, rounded to
whole multiples of a power of two. What a pair can give besides, $b_{ij} = \min_{x_i} (c_{ij} - a_{ij})$, is
computed by the checker, as are energy, costs, bound, the cells that are left, whether the next level covers
them, Lemmas 4 and 5 and the quadratic. Wrong shares can only make a bound worse. All is done in doubles; an
error bound of every sum is taken off, so that *optimal* says: no field has less energy by more than $10^{-8}$
of it, or of 1 if that is more. The checker is
one file (`models/proof/check_certificate.py`) with NumPy, and repeats this proof with the rounding in it.
It reads the archive once and refuses every archive that
[another program could read differently](files.md#archives). crossfield shows only what it has checked.
"""

"""Text of docs/fields.md and docs/weights.md around the tables of fields.py."""

from typing import Final

FIELDS: Final = """# How good the fields are

{said} `--measure` measures anew; `--sketches FOLDER` adds a folder of line drawings by others to the samples,
as was done here.

{short}

## Hidden curves

A designer draws some curvature lines and wants the others. So one curve of a drawing is hidden: all its
stroke pixels go, the field is made from the rest, and what counts is the mean angle between the hidden curve
and the nearer line of the crosses on it. Up to eight longest curves of a drawing are hidden in turn. No
energy is consulted. Crosses at random, at right angles, would have 22.5 degrees. `crossfield evaluate` does
this for one drawing.

Degrees over all curves, mean / median, and in brackets the mean over drawings with its standard error: curves
of one drawing are alike, so that this is the error to look at. Default weights; {seconds:g} s for a field
that is searched. `prove` and `two-stage`, which only look for less energy, at one size.

{methods}

The same at 32 pixels by drawing, mean over its curves:

{drawings}

`crossfield run` keeps the field of `bend`. Differences between the other methods are smaller than those
between drawings, and [a lower energy](energies.md) is not by itself a better field: where a field starts, and
the weight of the strokes, count for [more](weights.md).

## The strokes that were shown

Stroke pixels whose nearer line is more than {off} degrees off: mean over drawings / worst drawing. Methods
without a time limit, default weights.

{shown}

## Surfaces with a known answer

Mean cross error in degrees, as in [accuracy](accuracy.md), which has the methods that search as well. Noise:
standard deviation in degrees of an independent error of each stroke pixel, mean over {seeds} draws.

{known}

On `torus_patch` at 24 pixels no jump is wrong: with the jumps of the true field the best angles are as far
off as the others. The instance has one arc and one nearly straight line, 29 of 148 pixels, and nothing in it
says how the second family turns beside its one line; smoothness moves that line along unturned. Only a
preference for right angles mends it: the power field before its angles are fitted, which has no others
([accuracy](accuracy.md)), or `--skew-weight 30`. It harms where perspective makes crosses skew.
"""

WEIGHTS: Final = """# Weights

{said} `--measure` measures anew, as in [how good the fields are](fields.md).

The energy of a field is that of its smoothness, plus `w_strokes` times the squared distance from the strokes,
plus `w_beta` times the squared skew ([mathematics](mathematics.md)).

## The same on every grid

The smoothness is a sum over pairs of neighbours. On a grid of half the pixel size there are four times as
many pairs, each with half the difference: the sum stays. But a stroke runs through twice as many pixels, and
there are four times as many pixels that may be skew. With the same coefficients a stroke counts half as much
on a grid of twice the pixel size, and a field at 12 pixels misses strokes that the field at 96 follows.

Therefore weights are divided by the pixels $n$ of the grid's longer side and by their square. These are the
weights of `--stroke-weight` and `--skew-weight`, and `stroke_weight` and `skew_weight` of `cf.read_sketch`,
`cf.sample` and `Instance.with_weights`. On a grid of 24 pixels, the default, they are the coefficients:

$$
\\text{{w\\_strokes}} = W_\\text{{strokes}} \\frac{{24}}{{n}}, \\qquad
\\text{{w\\_beta}} = W_\\beta \\left(\\frac{{24}}{{n}}\\right)^2 .
$$

An instance, its file and every problem file hold the coefficients (`Instance.stroke_coefficient`,
`Instance.skew_coefficient`); `Instance.stroke_weight` and `Instance.skew_weight` are the weights. The paper
has the coefficients 1 and 1e-6 on every grid; so have instances made by hand, and those of the
[library](library.md). `crossfield export mouse --size 48 --stroke-weight 2 --skew-weight 4e-6` has them.

## The default of the strokes: {default}

Greedy fields, in which jumps and angles react to the weight and no time limit has a say.

**Hidden curves.** Degrees, mean / median over the curves, and the mean over drawings with its standard error.

{hidden}

**The strokes that were shown.** Stroke pixels whose nearer line is more than {off} degrees off: mean over
drawings / worst drawing.

{missed}

**Surfaces with a known answer.** Mean cross error in degrees. Noise: standard deviation in degrees of an
independent error of each stroke pixel, mean over {seeds} draws.

{surfaces}

A small weight lets the field smooth over strokes that a designer drew with care. A large one follows every
tremble of the hand. From 10 on hidden curves differ by less than their error; surfaces gain up to 40 without
noise, and lose beyond 5 to 20 under 8 degrees of it, which is a very rough sketch. {default} leaves few
stroke pixels off on any drawing and stays near the best everywhere.

## The default of the skew: 1e-6

It decides only what nothing else does: where neither a stroke nor a neighbour has a say in the second line of
a cross, it is at a right angle to the first. A weight of 0.1 and more keeps fields from the skew that
perspective asks for.
"""

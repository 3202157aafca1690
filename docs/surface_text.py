"""Text of docs/surface.md around the tables of surface.py."""

from typing import Final

PAGE: Final = """# From crosses to a surface

{said} `--measure` measures anew; `--sketches FOLDER` adds a folder of line drawings by others to the samples,
as was done here.

Curvature lines show a shape. `cf.surface(field, hints)` lifts a cross field to heights: one at each corner of
a pixel, in pixels towards the viewer. The surface is seen from the front, along parallel rays. Normals,
slopes and how far to trust them come with it (`cf.Surface`).

## The equations

x runs to the right, y up, z towards the viewer; g is the slope (dz/dx, dz/dy) at the middle of a pixel, from
its four corners. The lines u and v of a cross are seen in the picture; on the surface they are the vectors
(u, u.g) and (v, v.g). Curvature lines have two properties there:

- They meet at right angles in space: u.v + (u.g)(v.g) = 0. Divided by the lengths of both vectors this is the
  cosine of their angle in space, r. Where lines cross at right angles in the picture too, one of them has no
  slope; how far they are from it tells how steep the surface is.
- They are conjugate: along one of them the surface does not twist towards the other, u . d_v g = 0 and
  v . d_u g = 0, where d_v is the derivative along v. These are linear in the heights. They are taken at the
  middle of 2 x 2 pixels with the mean of the four crosses, where differences to all sides are central.

What is minimised is, with n pixels and N the unit normal,

    sum over pixels   s^2 log(1 + r^2 / s^2)                       s = 0.007
    over 2 x 2        0.1 n / 2 ((u . d_v g)^2 + (v . d_u g)^2)
    over neighbours   5e-6 n |N_i - N_j|^2
    over pixels       5e-5 log(1 + |g|^2)

and a tenth of the third weight times the square of what the corners of a pixel are off a plane, which slopes
do not see. The logarithm in the first line means that a cross counts less and less when it misses its right
angle by more than s, 0.4 degrees: crosses between strokes are guesses, and some are wrong by far. The third
line prefers normals that change little, the last one normals towards the viewer; they decide only what the
crosses leave open. Nothing depends on the order of the lines, on their signs or on jumps.

The sum has many lowest places. It is minimised by the method of Levenberg and Marquardt from three starts, a
dome and two planes, on a grid of at most 500 pixels that is made by halving; the lowest answer is refined on
the finer grids. That of a plane is taken only where it has less than 0.8 times the energy of the dome's:
the exact crosses of the cone have two answers whose energies differ by 5 %, and bodies bulge more often.
Parts of the mask that share no corner are independent.

The weights, and s, were chosen on cylinder, torus, vase and spheroid at the sizes below, exact and from
strokes, so that these rows flatter. Cone and ellipsoid took no part, and the wave only with its hint. With
r^2 in the first line the torus from strokes is much farther off.

## What stays open

- **Inside out.** z and -z have the same crosses, always, for each part of the mask. By default each part
  leans outward at its border on the whole; where that is undecided it leans upward, as a floor seen from
  above. `flip` turns it. In the table below the default side is right in {sides} cases,
  exact crosses and three methods.
- **Bas-relief.** Cylinders, cones and waves belong to a family of surfaces, flatter or deeper, that have the
  same crosses exactly. Nothing in the drawing says which is meant. Others belong to one nearly. `firmness`
  says how far this goes: by how many radians the angles between lines change for a radian by which the
  normals turn (conjugacy weighed as above), for the change of the surface where this is least. It is the root
  of the least eigenvalue of the linearised problem. Below 0.01 `freedom` says so. It
  may name a surface that is right, as the torus at 32 pixels from exact crosses, and miss one of a family
  whose crosses contradict each other, as the cone at 32 pixels from strokes: the columns below. Crosses that
  agree and are wrong make a surface that is firm and wrong.
- **A hint** settles both: `cf.Hint(row, column, slant, tilt)` says the normal at a pixel. Slant is its angle
  to the viewer, tilt the direction to which it leans in the picture, counter-clockwise from the right;
  radians. Choose a place that is clearly slanted: below 10 degrees of slant a hint does not choose the side,
  because both fit it nearly alike.

## Surfaces with a known answer

Angle between normal and true normal in degrees, mean / 95 % of pixels, on the side that is nearer to the
truth. Strokes are exact curvature lines, as in the [evidence](evidence.md#surfaces-with-a-known-answer).
*Facing the viewer*: the error of a flat sheet. Vase, cone and spheroid are surfaces of revolution, cylinder
and wave translated curves; the ellipsoid with three different axes is neither.

{known}

The power field has right angles everywhere and says nothing of a shape.

With the true normal at the pixel in the middle as a hint, on the side that follows from it; before that, on
the nearer side:

{hints}

The normal is asked for on a small disc, where that of a curved surface is not the same everywhere, and
crosses from strokes contradict it: on the vase a hint makes things worse. Give hints for what is loose.

Mean errors from bend fields of noisy strokes, an independent error of that standard deviation on each stroke
pixel, mean over {seeds} draws:

{noise}

## Confidence and doubts

`confidence` at a pixel is 1 / (1 + (a / 10 degrees)^2), where a is how far its lines are from a right angle
on the surface, and 0 at singular spots. It says how well the equations hold, not how near the surface is to
what was meant: over the pixels of a surface above, from bend fields, its rank correlation with the true error
is {least} to {most}. Low confidence marks crosses that do not fit; high confidence promises nothing.

`doubts` are sentences that say why the surface as a whole should not be trusted. It is called

- **unfit** where more than 25 % of the crosses are off by more than 10 degrees. One height at each place
  cannot hold hidden lines, and lines of other kinds are no curvature lines. The threshold was put between
  the samples of the table and the drawings by others with hidden lines or of several bodies, and no drawing
  is near it to tell whether it stands at the right place. Wrong crosses that are smooth fit well:
  `torus_patch` at 32 pixels, far off from strokes, is not doubted.
- **singular** with more than 4 singular spots, 2 x 2 pixels round which crosses turn. A smooth surface has
  such spots too, an ellipsoid four; a drawing of a body with more of them is doubted wrongly.
- **nearly flat** with a mean slant below 10 degrees: crosses at right angles everywhere are best explained by
  a flat sheet. A sheet that is meant to be flat is doubted wrongly.

Bend fields, 48 pixels:

{trust}

## Time

On one core:

{times}

## Pictures

`python docs/surface_pictures.py` draws them: bend fields at 48 pixels, strokes, normal map (red to the right,
green up, blue towards the viewer) and the surface in the light of a lamp. Here the true surface is beside,
and the side is that of the truth. The cone is too steep, as no hint says how deep it is.

![Surfaces with a known answer: strokes, normal map, shaded, the true surface](pictures/surface_known.png)

The samples, on the side that is taken by default. Mouse, cube, bottle, pipe, ring and the flat sheet look
like what they are. The saddle is bent in two directions where it is wide, and says little at its tip of a
pixel or two.

![The drawn samples: strokes, normal map, shaded](pictures/surface_samples.png)

## What fails

- Hidden lines, and bodies in front of each other: one surface is fitted through all of them, and is
  shapeless.
- `torus_patch` from strokes. At 48 pixels most crosses are near, but those at its ends are far off, smoothly,
  and consistent with a surface of another shape: lighter weights far from strokes gain nothing, nor does
  correcting crosses by the surface and lifting again. At 32 pixels the crosses are off everywhere.
- The cone, and every surface of a family, without a hint.
- Steep rims: heights are single-valued, and a silhouette, where the surface turns away, is only approached.
- Creases: normals are asked to change little everywhere.
"""

* minlp-quartic on three pixels
$offListing
option optca=0, optcr=1e-6, limrow=0, limcol=0, solprint=off, sysout=off;

Sets
  r         'rows, from the top'          / 00*01 /
  c         'columns, from the left'      / 00*01 /
  I(r,c)    'pixels' /
00.(00*01)
01.(00*00)
/
  S_c(r,c)  'stroke pixels';
Parameters
  theta(r,c) 'direction of the stroke, radians, counter-clockwise from the right' /
00.01 2.5
/
  w(r,c) 'reliability of that direction' /
00.01 0.5
/;
Scalars w_strokes / 1 /, w_beta / 1e-06 /;
S_c(I) = w(I) > 0;

* The pairs (i, j): i is the pixel (r,c), j = (r-north(side),c+east(side)) its upper (u) or right (r) neighbour.
Sets side / u, r /, E(r,c,side) 'pairs of neighbours';
Parameters north(side) / u 1 /, east(side) / r 1 /;
E(I(r,c),side) = I(r-north(side),c+east(side));

* The window of alpha, gauge strokes.
Parameters alpha_lo(r,c), alpha_up(r,c);
alpha_lo(I) = 0;  alpha_up(I) = pi/2;
alpha_lo(S_c) = theta(S_c) - pi/4;  alpha_up(S_c) = theta(S_c) + pi/4;

* The useful jumps of each pair, from the windows of its pixels.
Parameters p_min(r,c,side), p_max(r,c,side);
p_min(E(r,c,side)) = floor(-2*(alpha_up(r,c) - alpha_lo(r-north(side),c+east(side)))/pi + 1e-9);
p_max(E(r,c,side)) = ceil(-2*(alpha_lo(r,c) - alpha_up(r-north(side),c+east(side)))/pi - 1e-9);

Variable objvar 'energy';
Variable alpha(r,c) 'direction of the cross';
  alpha.lo(I) = alpha_lo(I);  alpha.up(I) = alpha_up(I);
Variable beta(r,c) 'skew of the cross';
  beta.lo(I) = -pi/4;  beta.up(I) = pi/4;
Integer Variable p1(r,c,side) '1 when the jump is odd';
  p1.lo(E) = 0;  p1.up(E) = 1;
Integer Variable p2(r,c,side) 'half of the even part of the jump';
  p2.lo(E) = floor(p_min(E)/2);  p2.up(E) = floor(p_max(E)/2);

Equations
  obj 'energy',
  jlo(r,c,side) '(7), bounded';

obj.. objvar =e=
* smooth: section 2, (8)
 + sum(E(r,c,side), 2*sqr(beta(r,c)*(1 - 2*p1(r,c,side)) - beta(r-north(side),c+east(side)))
   + 2*sqr(alpha(r,c) - alpha(r-north(side),c+east(side)) + pi/2*(p1(r,c,side) + 2*p2(r,c,side))))
* strokes: (5)
 + sum(S_c(r,c), w_strokes*w(r,c)*sqr(alpha(r,c) + beta(r,c) - theta(r,c)))
* skew: (6)
 + sum(I(r,c), w_beta*sqr(beta(r,c)));
jlo(E(r,c,side))$(mod(abs(p_min(r,c,side)), 2) = 1).. p1(r,c,side) + 2*p2(r,c,side) =g= p_min(r,c,side);

Model m / all /;
solve m using minlp minimizing objvar;

$ifThen set RESULTS
* gams this.gms --RESULTS=values.csv writes lines name,value: the columns under the names of the manifest
File results / "%RESULTS%" /;
put results;
put 'model_status,' m.modelStat:0:0 / 'solver_status,' m.solveStat:0:0 /;
put 'problem,sha256_6dd96a9a6a79' /;
results.nr = 2; results.nd = 15; results.nw = 24;
put 'objective,' objvar.l:0 /;
loop(I(r,c), put 'alpha_' r.tl:0 '_' c.tl:0 ',' alpha.l(r,c):0 /);
loop(I(r,c), put 'beta_' r.tl:0 '_' c.tl:0 ',' beta.l(r,c):0 /);
loop(E(r,c,side), put 'p1_' r.tl:0 '_' c.tl:0 '_' side.tl:0 ',' p1.l(r,c,side):0 /);
loop(E(r,c,side), put 'p2_' r.tl:0 '_' c.tl:0 '_' side.tl:0 ',' p2.l(r,c,side):0 /);
putclose results;
$endIf

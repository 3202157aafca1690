* minlp-quartic on three pixels
$offListing
option optca=0, optcr=1e-6, limrow=0, limcol=0, solprint=off, sysout=off;

Variables objvar;
Variables
  alpha_00_00, alpha_00_01, alpha_01_00;
Variables
  beta_00_00, beta_00_01, beta_01_00;
Binary Variables
  p1_00_00_r, p1_01_00_u;
Integer Variables
  p2_00_00_r, p2_01_00_u;

Equations obj;
Equations
  jlo_01_00_u;

obj.. objvar =e=
 + 2*sqr(alpha_00_00 - alpha_00_01 + 1.5707963267948966*(p1_00_00_r + 2*p2_00_00_r)) + 2*sqr(beta_00_00*(1 - 2*p1_00_00_r) - beta_00_01)
 + 2*sqr(alpha_01_00 - alpha_00_00 + 1.5707963267948966*(p1_01_00_u + 2*p2_01_00_u)) + 2*sqr(beta_01_00*(1 - 2*p1_01_00_u) - beta_00_00)
 + 0.5*sqr(alpha_00_01 + beta_00_01 - 2.5)
 + 1e-06*sqr(beta_00_00)
 + 1e-06*sqr(beta_00_01)
 + 1e-06*sqr(beta_01_00)
;
jlo_01_00_u.. p1_01_00_u + 2*p2_01_00_u =g= (-1);

alpha_00_00.lo = 0; alpha_00_00.up = 1.5707963267948966;
alpha_00_01.lo = 1.7146018366025517; alpha_00_01.up = 3.2853981633974483;
alpha_01_00.lo = 0; alpha_01_00.up = 1.5707963267948966;
beta_00_00.lo = -0.7853981633974483; beta_00_00.up = 0.7853981633974483;
beta_00_01.lo = -0.7853981633974483; beta_00_01.up = 0.7853981633974483;
beta_01_00.lo = -0.7853981633974483; beta_01_00.up = 0.7853981633974483;
p1_00_00_r.lo = 0; p1_00_00_r.up = 1;
p1_01_00_u.lo = 0; p1_01_00_u.up = 1;
p2_00_00_r.lo = 0; p2_00_00_r.up = 1;
p2_01_00_u.lo = -1; p2_01_00_u.up = 0;

Model m / all /;
solve m using minlp minimizing objvar;

$ifThen set RESULTS
* gams this.gms --RESULTS=values.csv writes lines name,value: the columns under the names of the manifest
File results / "%RESULTS%" /;
put results;
put 'model_status,' m.modelStat:0:0 / 'solver_status,' m.solveStat:0:0 /;
put 'problem,sha256_6dd96a9a6a7' /;
results.nr = 2; results.nd = 15; results.nw = 24;
put 'objective,' objvar.l:0 /;
put 'alpha_00_00,' alpha_00_00.l:0 /;
put 'alpha_00_01,' alpha_00_01.l:0 /;
put 'alpha_01_00,' alpha_01_00.l:0 /;
put 'beta_00_00,' beta_00_00.l:0 /;
put 'beta_00_01,' beta_00_01.l:0 /;
put 'beta_01_00,' beta_01_00.l:0 /;
put 'p1_00_00_r,' p1_00_00_r.l:0 /;
put 'p1_01_00_u,' p1_01_00_u.l:0 /;
put 'p2_00_00_r,' p2_00_00_r.l:0 /;
put 'p2_01_00_u,' p2_01_00_u.l:0 /;
putclose results;
$endIf

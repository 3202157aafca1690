<?xml version = "1.0" encoding="UTF-8" standalone="yes"?>
<CPLEXSolution version="1.2">
 <header
   problemName="w/milp-mccormick.lp"
   solutionName="incumbent"
   solutionIndex="-1"
   objectiveValue="0.55653608284593448"
   solutionTypeValue="3"
   solutionTypeString="primal"
   solutionStatusValue="101"
   solutionStatusString="integer optimal solution"
   solutionMethodString="mip"
   primalFeasible="1"
   dualFeasible="1"
   MIPNodes="9"
   MIPIterations="210"
   writeLevel="1"/>
 <quality
   epInt="1.0000000000000001e-05"
   epRHS="9.9999999999999995e-07"
   maxIntInfeas="0"
   maxPrimalInfeas="4.4408920985006262e-16"
   maxX="3.2561944901923447"
   maxSlack="2"/>
 <linearConstraints>
  <constraint name="c14_00_00_r" index="0" slack="4.4408920985006262e-16"/>
  <constraint name="c14_01_00_u" index="1" slack="0"/>
  <constraint name="c14_01_00_r" index="2" slack="4.4408920985006262e-16"/>
  <constraint name="c14_01_01_u" index="3" slack="0"/>
  <constraint name="c15_00_00_r" index="4" slack="-4.4408920985006262e-16"/>
  <constraint name="c15_01_00_u" index="5" slack="0"/>
  <constraint name="c15_01_00_r" index="6" slack="-4.4408920985006262e-16"/>
  <constraint name="c15_01_01_u" index="7" slack="0"/>
  <constraint name="c16_00_00_r" index="8" slack="8.3266726846886741e-17"/>
  <constraint name="c16_01_00_u" index="9" slack="0"/>
  <constraint name="c16_01_00_r" index="10" slack="-8.3266726846886741e-17"/>
  <constraint name="c16_01_01_u" index="11" slack="0"/>
  <constraint name="c17_00_00_r" index="12" slack="-8.3266726846886741e-17"/>
  <constraint name="c17_01_00_u" index="13" slack="0"/>
  <constraint name="c17_01_00_r" index="14" slack="8.3266726846886741e-17"/>
  <constraint name="c17_01_01_u" index="15" slack="0"/>
  <constraint name="c26_00_00_r" index="16" slack="-0.87079632679489627"/>
  <constraint name="c26_01_00_u" index="17" slack="0"/>
  <constraint name="c26_01_00_r" index="18" slack="0"/>
  <constraint name="c26_01_01_u" index="19" slack="-0.87079632679489638"/>
  <constraint name="c27_00_00_r" index="20" slack="0"/>
  <constraint name="c27_01_00_u" index="21" slack="0.87079632679489627"/>
  <constraint name="c27_01_00_r" index="22" slack="0.87079632679489627"/>
  <constraint name="c27_01_01_u" index="23" slack="0"/>
  <constraint name="c28_00_00_r" index="24" slack="0.70000000000000029"/>
  <constraint name="c28_01_00_u" index="25" slack="0"/>
  <constraint name="c28_01_00_r" index="26" slack="0"/>
  <constraint name="c28_01_01_u" index="27" slack="0.70000000000000018"/>
  <constraint name="c29_00_00_r" index="28" slack="0"/>
  <constraint name="c29_01_00_u" index="29" slack="-0.70000000000000029"/>
  <constraint name="c29_01_00_r" index="30" slack="-0.70000000000000029"/>
  <constraint name="c29_01_01_u" index="31" slack="0"/>
  <constraint name="jlo_00_00_r" index="32" slack="-2"/>
  <constraint name="jup_00_00_r" index="33" slack="1"/>
  <constraint name="c22_00_00" index="34" slack="0"/>
  <constraint name="c22_00_01" index="35" slack="0"/>
  <constraint name="c22_01_01" index="36" slack="0"/>
  <constraint name="c23_00_00" index="37" slack="0"/>
  <constraint name="c23_00_01" index="38" slack="0"/>
  <constraint name="c23_01_01" index="39" slack="-1.4831853071795851"/>
  <constraint name="c24_00_00" index="40" slack="0"/>
  <constraint name="c24_00_01" index="41" slack="-0.1707963267948962"/>
  <constraint name="c24_01_00" index="42" slack="0"/>
  <constraint name="c24_01_01" index="43" slack="0"/>
  <constraint name="c25_00_00" index="44" slack="-0.17079632679489604"/>
  <constraint name="c25_00_01" index="45" slack="0"/>
  <constraint name="c25_01_00" index="46" slack="-0.17079632679489604"/>
  <constraint name="c25_01_01" index="47" slack="-0.1707963267948962"/>
 </linearConstraints>
 <variables>
  <variable name="alpha_00_00" index="0" value="0.11460183660255199"/>
  <variable name="alpha_00_01" index="1" value="1.6853981633974482"/>
  <variable name="alpha_01_00" index="2" value="0.11460183660255199"/>
  <variable name="alpha_01_01" index="3" value="3.2561944901923447"/>
  <variable name="beta_00_00" index="4" value="0.085398163397448018"/>
  <variable name="beta_00_01" index="5" value="-0.085398163397448101"/>
  <variable name="beta_01_00" index="6" value="0.085398163397448018"/>
  <variable name="beta_01_01" index="7" value="0.085398163397448101"/>
  <variable name="p1_00_00_r" index="8" value="1"/>
  <variable name="p1_01_00_u" index="9" value="-0"/>
  <variable name="p1_01_00_r" index="10" value="-0"/>
  <variable name="p1_01_01_u" index="11" value="1"/>
  <variable name="p2_00_00_r" index="12" value="0"/>
  <variable name="p2_01_00_u" index="13" value="0"/>
  <variable name="p2_01_00_r" index="14" value="1"/>
  <variable name="p2_01_01_u" index="15" value="-1"/>
  <variable name="s_00_00_r" index="16" value="0"/>
  <variable name="s_01_00_u" index="17" value="0"/>
  <variable name="s_01_00_r" index="18" value="0"/>
  <variable name="s_01_01_u" index="19" value="0"/>
  <variable name="t_00_00_r" index="20" value="0"/>
  <variable name="t_01_00_u" index="21" value="0"/>
  <variable name="t_01_00_r" index="22" value="0"/>
  <variable name="t_01_01_u" index="23" value="0"/>
  <variable name="z_00_00_r" index="24" value="0.085398163397448018"/>
  <variable name="z_01_00_u" index="25" value="0"/>
  <variable name="z_01_00_r" index="26" value="0"/>
  <variable name="z_01_01_u" index="27" value="0.085398163397448101"/>
  <variable name="gamma_00_00" index="28" value="0"/>
  <variable name="gamma_00_01" index="29" value="0"/>
  <variable name="gamma_01_01" index="30" value="0.74159265358979276"/>
  <variable name="psi_00_00" index="31" value="0.085398163397448018"/>
  <variable name="psi_00_01" index="32" value="0.085398163397448101"/>
  <variable name="psi_01_00" index="33" value="0.085398163397448018"/>
  <variable name="psi_01_01" index="34" value="0.085398163397448101"/>
 </variables>
</CPLEXSolution>

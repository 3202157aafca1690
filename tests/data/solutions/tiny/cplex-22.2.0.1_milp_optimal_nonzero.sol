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
   writeLevel="3"/>
 <quality
   epInt="1.0000000000000001e-05"
   epRHS="9.9999999999999995e-07"
   maxIntInfeas="0"
   maxPrimalInfeas="4.4408920985006262e-16"
   maxX="3.2561944901923447"
   maxSlack="2"/>
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
  <variable name="p1_01_01_u" index="11" value="1"/>
  <variable name="p2_01_00_r" index="14" value="1"/>
  <variable name="p2_01_01_u" index="15" value="-1"/>
  <variable name="z_00_00_r" index="24" value="0.085398163397448018"/>
  <variable name="z_01_01_u" index="27" value="0.085398163397448101"/>
  <variable name="gamma_01_01" index="30" value="0.74159265358979276"/>
  <variable name="psi_00_00" index="31" value="0.085398163397448018"/>
  <variable name="psi_00_01" index="32" value="0.085398163397448101"/>
  <variable name="psi_01_00" index="33" value="0.085398163397448018"/>
  <variable name="psi_01_01" index="34" value="0.085398163397448101"/>
 </variables>
</CPLEXSolution>

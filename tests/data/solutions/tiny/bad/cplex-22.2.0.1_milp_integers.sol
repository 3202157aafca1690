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
   writeLevel="2"/>
 <quality
   epInt="1.0000000000000001e-05"
   epRHS="9.9999999999999995e-07"
   maxIntInfeas="0"
   maxPrimalInfeas="4.4408920985006262e-16"
   maxX="3.2561944901923447"
   maxSlack="2"/>
 <variables>
  <variable name="p1_00_00_r" index="8" value="1"/>
  <variable name="p1_01_00_u" index="9" value="-0"/>
  <variable name="p1_01_00_r" index="10" value="-0"/>
  <variable name="p1_01_01_u" index="11" value="1"/>
  <variable name="p2_00_00_r" index="12" value="0"/>
  <variable name="p2_01_00_u" index="13" value="0"/>
  <variable name="p2_01_00_r" index="14" value="1"/>
  <variable name="p2_01_01_u" index="15" value="-1"/>
 </variables>
</CPLEXSolution>

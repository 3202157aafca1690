<?xml version = "1.0" encoding="UTF-8" standalone="yes"?>
<CPLEXSolution version="1.2">
 <header
   problemName="w/unb.lp"
   objectiveValue="0"
   solutionTypeValue="1"
   solutionTypeString="basic"
   solutionStatusValue="2"
   solutionStatusString="unbounded"
   solutionMethodString="primal"
   primalFeasible="1"
   dualFeasible="0"
   simplexIterations="0"
   writeLevel="1"/>
 <quality
   epRHS="9.9999999999999995e-07"
   epOpt="9.9999999999999995e-07"
   maxPrimalInfeas="0"
   maxDualInfeas="1"
   maxPrimalResidual="0"
   maxDualResidual="0"
   maxX="0"
   maxPi="0"
   maxSlack="3"
   maxRedCost="1"
   kappa="1"/>
 <linearConstraints>
  <constraint name="c" index="0" status="BS" slack="3" dual="0"/>
 </linearConstraints>
 <variables>
  <variable name="free1" index="0" status="SB" value="0" reducedCost="1"/>
  <variable name="alpha_00_00" index="1" status="LL" value="0" reducedCost="1"/>
 </variables>
</CPLEXSolution>

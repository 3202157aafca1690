<?xml version = "1.0" encoding="UTF-8" standalone="yes"?>
<CPLEXSolution version="1.2">
 <header
   problemName="w/qp-fixed.lp"
   objectiveValue="8.8679297801803898"
   solutionTypeValue="2"
   solutionTypeString="nonbasic"
   solutionStatusValue="1"
   solutionStatusString="optimal"
   solutionMethodString="barrier"
   primalFeasible="1"
   dualFeasible="1"
   barrierIterations="10"
   writeLevel="1"/>
 <quality
   barEpComp="1e-08"
   maxPrimalInfeas="0"
   maxPrimalResidual="0"
   maxX="1.814601836888134"
   maxSlack="0"
   maxCompSlack="2.266763770780819e-09"
   objGap="1.1159839274910155e-08"
   maxDualInfeas="0"
   maxDualResidual="8.8817841970012523e-16"
   maxPi="0"
   maxRedCost="12.944802200544681"/>
 <linearConstraints>
  <constraint name="c_ONE" index="0" slack="0" dual="0"/>
 </linearConstraints>
</CPLEXSolution>

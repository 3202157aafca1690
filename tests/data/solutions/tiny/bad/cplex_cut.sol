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
 <variables>
  <variable name="ONE" index="0" value="1" reducedCost="12.944802200544681"/>
  <variable name="alpha_00_00" index="1" value="0.98539816257300306" reducedCost="-2.7494414778422551"/>
  <variable name="alpha_00_01" index="2" value="1.4420970952686405" reducedCost="1.2093850365602066e-09"/>
  <variable name="alpha_01_00" index="3" value="1.5707963263338738" reducedCost="-4.9168146943531443"/>
  <variable name="alpha_01_01" index="4" value="1.814601836888134" reducedCost="7.9373407732610666"/>
  <variable name="beta_00_00" index="5" value="-0.31241585991174414" reducedCost="2.7276937375475541e-09"/>
  <variable name="beta_00_01" index="6" value="0.0082243433557191714" reducedCost="-6.0452531869259474e-11"/>
  <variable name="beta_01_00" index="7" value="-0.27847554479514269" reducedCost="2.3409464366963562e-09"/>
  <variable name="beta_01_01" index="8" value="0.24467446803617551" reducedCost
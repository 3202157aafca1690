<?xml version = "1.0" encoding="UTF-8" standalone="yes"?>
<CPLEXSolution version="1.2">
 <header
   problemName="w/infeasible.lp"
   objectiveValue="1"
   solutionTypeValue="1"
   solutionTypeString="basic"
   solutionStatusValue="3"
   solutionStatusString="infeasible"
   solutionMethodString="primal"
   primalFeasible="0"
   dualFeasible="0"
   simplexIterations="27"
   writeLevel="1"/>
 <quality
   epRHS="9.9999999999999995e-07"
   epOpt="9.9999999999999995e-07"
   maxPrimalInfeas="1"
   maxDualInfeas="0"
   maxPrimalResidual="8.3266726846886741e-17"
   maxDualResidual="0"
   maxX="1.8146018366025518"
   maxPi="1"
   maxSlack="1.6087323186853859"
   maxRedCost="1"
   kappa="19.346664468977334"/>
 <linearConstraints>
  <constraint name="c14_00_00_r" index="0" status="LL" slack="0" dual="-0"/>
  <constraint name="c14_01_00_u" index="1" status="LL" slack="0" dual="-0"/>
  <constraint name="c14_01_00_r" index="2" status="LL" slack="0" dual="-0"/>
  <constraint name="c14_01_01_u" index="3" status="LL" slack="0" dual="-0"/>
  <constraint name="c15_00_00_r" index="4" status="BS" slack="-5.5511151231257827e-17" dual="-0"/>
  <constraint name="c15_01_00_u" index="5" status="BS" slack="2.7755575615628914e-17" dual="-0"/>
  <constraint name="c15_01_00_r" index="6" status="BS" slack="-0" dual="-0"/>
  <constraint name="c15_01_01_u" index="7" status="BS" slack="-0" dual="-0"/>
  <constraint name="c16_00_00_r" index="8" status="BS" slack="-0" dual="-0"/>
  <constraint name="c16_01_00_u" index="9" status="LL" slack="0" dual="0"/>
  <constraint name="c16_01_00_r" index="10" status="LL" slack="0" dual="0"/>
  <constraint name="c16_01_01_u" index="11" status="LL" slack="0" dual="0"/>
  <constraint name="c17_00_00_r" index="12" status="LL" slack="0" dual="-0"/>
  <constraint name="c17_01_00_u" index="13" status="BS" slack="0" dual="-0"/>
  <constraint name="c17_01_00_r" index="14" status="BS" slack="-0" dual="-0"/>
  <constraint name="c17_01_01_u" index="15" status="BS" slack="-0" dual="-0"/>
  <constraint name="c26_00_00_r" index="16" status="LL" slack="0" dual="0"/>
  <constraint name="c26_01_00_u" index="17" status="BS" slack="-0.099999999999999992" dual="-0"/>
  <constraint name="c26_01_00_r" index="18" status="LL" slack="0" dual="0"/>
  <constraint name="c26_01_01_u" index="19" status="BS" slack="0" dual="-0"/>
  <constraint name="c27_00_00_r" index="20" status="BS" slack="0.78539816339744828" dual="0"/>
  <constraint name="c27_01_00_u" index="21" status="BS" slack="0.6853981633974483" dual="0"/>
  <constraint name="c27_01_00_r" index="22" status="BS" slack="0.78539816339744828" dual="0"/>
  <constraint name="c27_01_01_u" index="23" status="BS" slack="1.5707963267948966" dual="0"/>
  <constraint name="c28_00_00_r" index="24" status="BS" slack="0.78539816339744828" dual="0"/>
  <constraint name="c28_01_00_u" index="25" status="BS" slack="0.099999999999999992" dual="0"/>
  <constraint name="c28_01_00_r" index="26" status="BS" slack="0.78539816339744828" dual="0"/>
  <constraint name="c28_01_01_u" index="27" status="LL" slack="0" dual="-0"/>
  <constraint name="c29_00_00_r" index="28" status="BS" slack="-0" dual="-0"/>
  <constraint name="c29_01_00_u" index="29" status="BS" slack="-0.6853981633974483" dual="-0"/>
  <constraint name="c29_01_00_r" index="30" status="BS" slack="-0" dual="-0"/>
  <constraint name="c29_01_01_u" index="31" status="BS" slack="0" dual="-0"/>
  <constraint name="jlo_00_00_r" index="32" status="BS" slack="-1.3912676813146141" dual="-0"/>
  <constraint name="jup_00_00_r" index="33" status="BS" slack="1.6087323186853859" dual="0"/>
  <constraint name="c22_00_00" index="34" status="BS" slack="-0" dual="-0"/>
  <constraint name="c22_00_01" index="35" status="BS" slack="-0" dual="-0"/>
  <constraint name="c22_01_01" index="36" status="BS" slack="0" dual="-0"/>
  <constraint name="c23_00_00" index="37" status="LL" slack="0" dual="0"/>
  <constraint name="c23_00_01" index="38" status="LL" slack="0" dual="0"/>
  <constraint name="c23_01_01" index="39" status="BS" slack="0" dual="-0"/>
  <constraint name="c24_00_00" index="40" status="LL" slack="0" dual="-0"/>
  <constraint name="c24_00_01" index="41" status="LL" slack="0" dual="0"/>
  <constraint name="c24_01_00" index="42" status="LL" slack="0" dual="-0"/>
  <constraint name="c24_01_01" index="43" status="LL" slack="0" dual="0"/>
  <constraint name="c25_00_00" index="44" status="BS" slack="0" dual="-0"/>
  <constraint name="c25_00_01" index="45" status="BS" slack="-1.5707963267948966" dual="-0"/>
  <constraint name="c25_01_00" index="46" status="BS" slack="0" dual="-0"/>
  <constraint name="c25_01_01" index="47" status="BS" slack="-1.5707963267948966" dual="-0"/>
  <constraint name="contra" index="48" status="BS" slack="-1" dual="-1"/>
 </linearConstraints>
 <variables>
  <variable name="alpha_00_00" index="0" status="BS" value="0.20000000000000001" reducedCost="0"/>
  <variable name="alpha_00_01" index="1" status="LL" value="0.81460183660255181" reducedCost="0"/>
  <variable name="alpha_01_00" index="2" status="LL" value="0" reducedCost="0"/>
  <variable name="alpha_01_01" index="3" status="LL" value="1.8146018366025518" reducedCost="0"/>
  <variable name="beta_00_00" index="4" status="BS" value="0" reducedCost="0"/>
  <variable name="beta_00_01" index="5" status="BS" value="0.78539816339744828" reducedCost="0"/>
  <variable name="beta_01_00" index="6" status="BS" value="0" reducedCost="0"/>
  <variable name="beta_01_01" index="7" status="UL" value="0.78539816339744828" reducedCost="0"/>
  <variable name="p1_00_00_r" index="8" status="BS" value="0.5" reducedCost="0"/>
  <variable name="p1_01_00_u" index="9" status="BS" value="0.12732395447351627" reducedCost="0"/>
  <variable name="p1_01_00_r" index="10" status="BS" value="0.5" reducedCost="0"/>
  <variable name="p1_01_01_u" index="11" status="BS" value="0" reducedCost="0"/>
  <variable name="p2_00_00_r" index="12" status="BS" value="-0.054366159342692996" reducedCost="0"/>
  <variable name="p2_01_00_u" index="13" status="UL" value="0" reducedCost="0"/>
  <variable name="p2_01_00_r" index="14" status="BS" value="0.32760570407785583" reducedCost="0"/>
  <variable name="p2_01_01_u" index="15" status="BS" value="-0.31830988618379069" reducedCost="0"/>
  <variable name="s_00_00_r" index="16" status="LL" value="0" reducedCost="1"/>
  <variable name="s_01_00_u" index="17" status="LL" value="0" reducedCost="0"/>
  <variable name="s_01_00_r" index="18" status="LL" value="0" reducedCost="0"/>
  <variable name="s_01_01_u" index="19" status="LL" value="0" reducedCost="0"/>
  <variable name="t_00_00_r" index="20" status="LL" value="0" reducedCost="0"/>
  <variable name="t_01_00_u" index="21" status="LL" value="0" reducedCost="0"/>
  <variable name="t_01_00_r" index="22" status="LL" value="0" reducedCost="0"/>
  <variable name="t_01_01_u" index="23" status="LL" value="0" reducedCost="0"/>
  <variable name="z_00_00_r" index="24" status="BS" value="-0.39269908169872414" reducedCost="0"/>
  <variable name="z_01_00_u" index="25" status="BS" value="0" reducedCost="0"/>
  <variable name="z_01_00_r" index="26" status="BS" value="-0.39269908169872414" reducedCost="0"/>
  <variable name="z_01_01_u" index="27" status="BS" value="0" reducedCost="0"/>
  <variable name="gamma_00_00" index="28" status="LL" value="0" reducedCost="0"/>
  <variable name="gamma_00_01" index="29" status="LL" value="0" reducedCost="0"/>
  <variable name="gamma_01_01" index="30" status="LL" value="0" reducedCost="0"/>
  <variable name="psi_00_00" index="31" status="LL" value="0" reducedCost="0"/>
  <variable name="psi_00_01" index="32" status="BS" value="0.78539816339744828" reducedCost="0"/>
  <variable name="psi_01_00" index="33" status="LL" value="0" reducedCost="0"/>
  <variable name="psi_01_01" index="34" status="BS" value="0.78539816339744828" reducedCost="0"/>
 </variables>
</CPLEXSolution>

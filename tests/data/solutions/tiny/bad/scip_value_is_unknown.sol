solution status: optimal solution found
objective value:                     8.86792936232116
ONE                                                 1 	(obj:12.9448022005447)
alpha_00_00                         0.985398163397448 	(obj:-0.6)
alpha_00_01                          unknown 	(obj:-3.6)
alpha_01_00                           1.5707963267949 	(obj:-6.28318530717959)
alpha_01_01                          1.81460183660255 	(obj:2.38318530717959)
beta_00_00                         -0.312413453183134 	(obj:-0.6)
beta_00_01                         0.0082337113433342 	(obj:-3.6)
beta_01_00                         -0.278358651764212 	(obj:0)
beta_01_01                          0.244844089270874 	(obj:-3.9)
quadobjvar                           8.04786791320424 	(obj:1)

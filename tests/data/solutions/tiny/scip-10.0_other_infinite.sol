objective value:                                    0
alpha_00_00                                 +infinity 	(obj:0)
alpha_00_01                                 -infinity 	(obj:0)

# Solution for model obj
# Objective value = 5.5653608284593448e-01

Model status
Optimal

# Primal solution values
None

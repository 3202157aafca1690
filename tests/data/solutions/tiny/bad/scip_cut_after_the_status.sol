solution status: optimal solution found

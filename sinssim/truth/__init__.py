"""Sources of truth: flights, parked vehicles, analytic motions, and the exact increments along them."""

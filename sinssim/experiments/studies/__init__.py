"""Comparison of algorithms: study file, cost of a step, results, and the claims of the chapter decided."""

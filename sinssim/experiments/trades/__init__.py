"""Trade studies: a scenario's keys in a grid, each cell a covariance budget or an ensemble of runs."""

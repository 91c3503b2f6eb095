"""Runs, ensembles, comparisons and trade studies, each with its directory and with what it has to show."""

"""Flights of aircraft in JSBSim: autopilot, plan, and the cache of flights."""

"""Vehicles on the ground and on water: legs, roughness of the road, sea, and the response of the body."""

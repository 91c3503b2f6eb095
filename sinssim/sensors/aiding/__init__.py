"""Aiding sensors: those beside the inertial ones, which a filter corrects inertial navigation by; one file each."""

"""Aiding sensors, with whose readings a filter corrects inertial navigation; one file each."""

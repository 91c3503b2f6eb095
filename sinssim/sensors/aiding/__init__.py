"""Aiding sensors, with whose readings a filter corrects inertial navigation; a file for each sensor or family."""

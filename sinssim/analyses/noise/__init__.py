"""Identification of sensor noise from records at rest: Allan variance and maximum likelihood."""

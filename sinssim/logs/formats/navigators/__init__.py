"""Formats of inertial navigators: KF-GINS, PSINS, SBET."""

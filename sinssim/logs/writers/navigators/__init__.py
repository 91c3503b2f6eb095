"""Formats of navigators and receivers: KF-GINS, PSINS, gnss-ins-sim, SBET, RTKLIB, NMEA."""

"""Formats of satellite receivers: NMEA 0183, u-blox UBX, NovAtel OEM7."""

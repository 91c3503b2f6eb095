"""Formats of maps: KML, GPX, GeoJSON."""

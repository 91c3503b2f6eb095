"""What is known of a flight plan before the flight: heights over the way, limits of the aircraft."""

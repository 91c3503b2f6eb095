"""What is known of a planned motion before it: limits of the aircraft, the path."""

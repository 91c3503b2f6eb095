"""What follows from inertial measurements alone: vibration, stops, and where a land vehicle's constraint holds."""

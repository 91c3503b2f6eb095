"""What the inertial readings themselves tell: vibration, stops, and where a land vehicle's constraint holds."""

"""An aircraft from a flight dynamics model: survey, linear models, the autopilot's gains, an acceptance flight."""

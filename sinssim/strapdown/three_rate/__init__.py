"""Navigation at three rates in each frame, and the schedule of the rates."""

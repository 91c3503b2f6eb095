"""A user's own algorithms, frames, aiding sensors, grades, aircraft and views, in files outside the package."""

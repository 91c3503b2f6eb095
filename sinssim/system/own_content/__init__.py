"""A user's algorithms, frames, aiding sensors, formats, grades, aircraft and views, in files outside the package."""

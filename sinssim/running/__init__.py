"""What writes and draws every kind of result, and reads the logs of any source."""

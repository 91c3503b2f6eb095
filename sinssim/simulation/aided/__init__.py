"""The filter of a scenario: its states, assumed noise, memory and run."""

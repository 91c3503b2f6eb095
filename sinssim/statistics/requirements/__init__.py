"""Requirements on navigation errors: text to check, verdict from the runs of an ensemble."""

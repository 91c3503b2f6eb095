"""Parts of a run's `summary.json`: one file for each subject."""

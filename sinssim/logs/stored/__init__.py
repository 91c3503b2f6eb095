"""The streams of a run directory: those stored as Parquet, and those that follow exactly from them."""

"""Recorded logs in columns: text, Parquet and npz, as a description names them."""

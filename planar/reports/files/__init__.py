"""Results as CSV, JSON, npz, Parquet, xarray, HTML."""

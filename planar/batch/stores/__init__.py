"""Where the blocks of a sweep are kept: in memory, in Zarr, in Parquet."""

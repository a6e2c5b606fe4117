"""Fleets: many machines' logs identified on a Dask cluster, into the registry and Parquet."""

"""Sweeps of more cases than a process should hold: points made in the workers, rows kept in Parquet parts."""

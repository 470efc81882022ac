"""Read and write recordings, whichever format they have."""

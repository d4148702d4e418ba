"""A cluster of machines, managed by Ray, on which a worker pool can run its jobs."""

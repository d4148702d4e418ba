"""What a notebook shows of a result: tables that can be sorted, and curves, from plain data."""

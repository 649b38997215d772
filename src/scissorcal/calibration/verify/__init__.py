"""The verification: coverage of the intervals, agreement of two halves, prior sensitivity."""

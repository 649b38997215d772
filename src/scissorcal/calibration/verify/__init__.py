"""The trust check: coverage of the intervals, agreement of two halves, prior sensitivity."""

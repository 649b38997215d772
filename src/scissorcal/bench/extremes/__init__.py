"""Numerical stability at the extremes: every quantity from the everyday to the absurd."""

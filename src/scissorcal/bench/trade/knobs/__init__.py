"""The knobs: one module each."""

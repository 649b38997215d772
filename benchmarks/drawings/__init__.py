"""The drawings of the documentation, as SVG."""

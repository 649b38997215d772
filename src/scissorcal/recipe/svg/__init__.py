"""The SVG of plates: what a file may say, and the outlines that it draws."""

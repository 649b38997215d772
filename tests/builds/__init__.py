"""The builds of docs/build as rigs, from the figures of their parts, right and wrong."""

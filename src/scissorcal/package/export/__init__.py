"""A package for other engines: C sources, a header for a microcontroller, an FMU."""

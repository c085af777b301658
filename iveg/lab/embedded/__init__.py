"""FIWARE in one process: measures and requests in, commands and notifications out."""

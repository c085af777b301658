"""The REST API: one module per group of resources."""

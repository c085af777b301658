"""iVeg: supervise mixed robot fleets in greenhouses, and prove every slow-down."""

__version__ = "2.0.0"

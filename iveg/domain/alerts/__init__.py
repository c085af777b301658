"""Alerts to people: raised, acknowledged, cleared (ISA-18.2), and what raises them."""

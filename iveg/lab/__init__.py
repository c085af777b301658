"""Laboratory: stand-ins for robots, brokers and people, beside the product."""

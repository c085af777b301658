"""Laboratory: what stands in for robots, brokers and people, beside the product."""

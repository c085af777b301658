"""Speed limits and STOP: observations enter; feedback, orders and alerts leave."""

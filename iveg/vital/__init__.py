"""Parts of a limit or a STOP: observations in; feedback, orders and alerts out."""

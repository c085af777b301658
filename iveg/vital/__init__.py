"""What a limit or a STOP needs: observations in; feedback, orders and alerts out."""

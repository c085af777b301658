"""What a speed limit or a STOP needs: observations enter, feedback, orders and alerts leave."""

"""What other parameters of the rule would have done with what was kept."""

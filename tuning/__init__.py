"""What is done with many worlds: plans and episodes in batches, results with intervals, pictures, the command line."""

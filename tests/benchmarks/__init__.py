"""What is timed: searches, decisions, episodes a second. `python -m tests.benchmarks` runs it, pytest not."""

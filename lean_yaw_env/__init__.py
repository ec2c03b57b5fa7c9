"""Exact three-dimensional walkers with lean-to-yaw coupling, after Wisse and Schwab (2005), and the steering tasks they make."""

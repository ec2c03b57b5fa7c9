"""Gymnasium environments: one walker, many walkers, and the tasks they share."""

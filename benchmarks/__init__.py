"""How fast the package is, beside its targets and beside what its users compare it with.

    python -m benchmarks                the full run: every benchmark, kept in benchmarks/results
    python -m benchmarks.kernel         the step itself: single calls, batches, derivatives, against scipy
    python -m benchmarks.environments   environments, single and vector, against Gymnasium's classics
    python -m benchmarks.infos          what infos add to the time of a step
    python -m benchmarks.startup        a new process: warm cache, cold cache, no cache
    python -m benchmarks.training       where the time of PPO goes
    python -m benchmarks.compare        the figure users ask for: steps per second of this package and its peers

The full run writes the file of each, which ``python -m benchmarks.NAME --json`` prints. Each takes ``--json`` and ``--smallest``. Nothing here is a test: machines differ. ``tests/test_operation_counts.py`` guards the work itself.
"""

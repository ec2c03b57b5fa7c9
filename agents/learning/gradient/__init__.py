"""Policy optimisation through the exact derivatives of walking steps: short-horizon analytic policy gradients."""

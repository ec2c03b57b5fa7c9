"""``python -m lean_yaw_env.cli``."""

from lean_yaw_env.cli import main

main()

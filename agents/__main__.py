"""``python -m agents``; needs the libraries of ``lean-yaw-env[train]``."""

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.reporting import reporting

if __name__ == "__main__":
    with reporting("agents"), needs_extra("train"):
        from .command_line import app

        app(prog_name=f"python -m {__package__}")

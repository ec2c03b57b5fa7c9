"""Train an agent to walk and steer: ``python train.py`` trains PPO on Heading; ``python train.py --help`` explains every option."""

from __future__ import annotations

from lean_yaw_env.extras import needs_extra
from lean_yaw_env.reporting import reporting

with reporting("train"), needs_extra("train"):
    import typer

    from agents.command_line import train

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(train)

if __name__ == "__main__":
    app()

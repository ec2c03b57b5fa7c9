"""``python -m agents``."""

from lean_yaw_env.rendering.optional import require_module

require_module("typer", "typer, which the command line needs,", "train")

from .command_line import app  # noqa: E402

if __name__ == "__main__":
    app(prog_name="python -m agents")

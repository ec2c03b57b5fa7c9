"""``python -m agents``; needs the libraries of ``lean-yaw-env[train]``."""

import sys

from lean_yaw_env.extras import MissingLibraryError, needs_extra

if __name__ == "__main__":
    try:
        with needs_extra("train"):
            from .command_line import app

            app(prog_name=f"python -m {__package__}")
    except MissingLibraryError as error:
        sys.exit(f"{__package__}: {error}")

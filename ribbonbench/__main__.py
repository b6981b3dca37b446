"""`python -m ribbonbench` is the command."""

import os
import sys

# `python -m` puts the current folder first: a folder `compare` that a user has there is not ours.
if not sys.flags.safe_path and sys.path[0] != os.path.dirname(os.path.dirname(os.path.abspath(__file__))):
    del sys.path[0]

from ribbonbench import command

command()

"""`python -m crossfield`: the command line."""

from .export.cli import main

main()

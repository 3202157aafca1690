"""`python -m crossfield`: the command line."""

from .export.cli.app import main

main()

"""The commands.

Commands, their options and tables, progress and one-line errors. Each command calls one function of another
folder and prints the result. No other folder imports this one.
"""

import gc

gc.set_threshold(100_000)  # new objects before a search for cycles, which slows down imports: so before them

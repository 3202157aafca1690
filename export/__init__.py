"""Files out, files in, solvers, pictures, commands.

At the top only the table of solvers (solvers_table.py): what each takes, reads and proves, wherever it is installed.
Everything else is in the folders; mathematics that needs no file is in models.
"""

"""Files out, files in, solvers, pictures, commands.

At the top only the table of solvers (solvers_table.py): what each reads, refuses, starts from and proves,
and what brings it.
Everything else is in the folders; mathematics that needs no file is in models.
"""

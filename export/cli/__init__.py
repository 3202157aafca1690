"""The commands.

The verbs, their options and tables, progress and one-line errors. A verb calls one function of another folder
and shows what comes back.
Nothing imports from here.
"""

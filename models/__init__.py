"""The mathematics, from a drawing to a field.

The top level holds what every folder uses: errors (one family), storage (files are complete or absent),
archives of arrays, and limits of inputs. Folders: processes, instance, sketch, field, formulations, search.
No module here depends on a solver, a solver's file format, a template or the command line.
"""

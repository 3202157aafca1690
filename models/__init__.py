"""The mathematics, from a drawing to a field.

At the top only what every folder uses: errors (one family), storage (files that are whole or not there),
archives of arrays, and limits of inputs. Folders: processes, instance, sketch, field, formulations, search.
Nothing here knows a solver, a solver's file format, a template or the command line.
"""

"""File formats, one module per format.

LP, MPS, .nl, GAMS, AMPL, OSiL, QPLIB, BARON and the Pyomo model, and the registry with the capabilities of
each. A module writes a Problem as text and does not access files; export/bundle writes sets of files with a
manifest.
"""

"""One module a file format.

LP, MPS, .nl, GAMS, AMPL, OSiL, QPLIB, BARON and the Pyomo model, and the registry that says which carries
what. A module writes a Problem as text and knows no file system; sets of files with a manifest are
export/bundle.
"""

"""Programs that check a certificate without the code of the prover.

Each needs Python and NumPy only; `check_orthogonal` also needs `check_certificate` beside it. A library has
copies of both.
"""

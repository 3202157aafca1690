"""Proofs that no field has a lower energy.

docs/proofs.md has the theorem. `prove` is the function for users, and `compiling` compiles what it calls.
`certificate` writes a proof to a file and reads it; `tightening` derives bounds of variables from it.
"""

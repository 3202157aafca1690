"""What proves that no field is better.

Lower bounds of the 2-norm energy on lattices of crosses, what they leave of the labels, and fields that are
proven optimal. What finds fields is models/search.
"""

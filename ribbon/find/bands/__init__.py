"""Closed bands: seeds of the whole, and bands of n folds by one of them."""

"""Rivals that predict: models that an engineer would fit to the same recording instead.

Each is fitted to one recording of a rig and runs another freely; the score is that of our improved
twin (`elsewhere`). To add a rival, write its module in this folder, with `fit_model(ground)`, and
put it into the tuple of `registry`.
"""

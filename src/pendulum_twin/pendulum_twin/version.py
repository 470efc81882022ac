"""The version of the four packages; `setup.py` reads it, and each `package.xml` says the same."""

__version__ = "0.1.0"

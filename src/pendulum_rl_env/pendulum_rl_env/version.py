"""The version of this package; `setup.py` reads it, and `package.xml` says the same."""

__version__ = "0.1.0"

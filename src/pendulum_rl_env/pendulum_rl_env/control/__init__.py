"""The classical controller: energy swing-up and linear-quadratic regulator on a twin."""

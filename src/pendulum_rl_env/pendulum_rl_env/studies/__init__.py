"""Programs that put packages together: identification, training and control of concealed rigs.

A study may import any package; nothing outside this folder imports a study.
"""

"""Many recordings: an engine that runs tasks on a cluster, a store, and what a history says.

Nothing here is imported by a diagnosis: its libraries are the extra `pendulum_sysid[fleet]`.
"""

"""Write a part of a recording as a recording of its own: `cut_recording.py BAG OUT BEGIN END`, times in s from its start."""

import sys

import numpy as np

from pendulum_sysid.reading.bag import read_bag, write_bag


def cut(bag: str, out: str, begin: float, end: float) -> None:
    """Write what was sampled and received from begin to end; reported velocities are left behind."""
    raw = read_bag(bag)
    rows, sent = (
        (stamps >= begin) & (stamps < end) for stamps in (raw.state_stamp_s, raw.command_stamp_s)
    )
    stamps_ns, times_ns = (
        np.rint((stamps - begin) * 1e9).astype(np.int64)
        for stamps in (raw.state_stamp_s[rows], raw.command_stamp_s[sent])
    )
    joints = {
        name: values[rows]
        for name, values in (("cart", raw.cart), ("pole", raw.pole))
        if values is not None
    }
    write_bag(
        out,
        stamps_ns,
        joints,
        raw.command[sent] if np.any(sent) else None,
        command_times_ns=times_ns,
    )


if __name__ == "__main__":
    cut(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))

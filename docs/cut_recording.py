"""Cut a piece out of a recording: `cut_recording.py BAG OUT BEGIN END`, s from its start."""

import sys

import numpy as np

from pendulum_sysid.reading.bag import read_bag, write_bag


def cut(bag: str, out: str, begin: float, end: float) -> None:
    """Write the samples and commands from begin to end, without reported velocities."""
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

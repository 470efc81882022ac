"""How far blocks of time draw the parameters of a fit apart.

Noise averages out over blocks. Physics that the model leaves out does not, and draws the
parameters its own way in each block.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.gauss_newton import compute_sandwich
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats, Ints, Mask


def compute_spreads(system: System, fit: Fit, free: tuple[Free, ...]) -> Floats:
    """Return how far blocks of time draw each parameter apart, (parameters,), in its unit.

    Each block pulls at the estimate of the whole recording. If all blocks pulled as a block does,
    the estimate would move by the block's pseudo-value: the block's part in the Gauss-Newton step,
    times the number of blocks (infinitesimal jackknife; Jaeckel, Bell Laboratories memorandum
    MM 72-1215-11 (1972)). The spread is the standard deviation of the pseudo-values, without the
    share of noise in the errors' power, which the intervals hold already. A block's own weight in
    the estimate is allowed for as in `compute_half_widths`. A parameter that a single block fixes
    has hardly a spread: no other block tells of it. Measured laws stay as they are.

    system: the normal equations of the fit, a row for each piece of a window. What is believed
        beforehand counts.

    The spread is 0 where there are fewer than three blocks of two windows.
    """
    sizes = np.array([parameter.size for parameter in free])
    blocks = sum_blocks(system, fit.pieces)
    if blocks is None:
        return np.zeros(len(free))
    covariance, known = compute_pseudo_covariance(take_to_optimum(blocks), fit.choose)
    return np.asarray(np.sqrt(np.where(known, np.diag(covariance), np.inf)) * sizes)


def sum_blocks(system: System, pieces: int) -> System | None:
    """Return the normal equations with a row for each block of time; None for too few windows.

    pieces: rows of the system that belong to a whole window.
    """
    windows = len(system.normals) // pieces
    parts = divide_windows(system, pieces, min(decisions.SPREAD_BLOCKS, windows // 2))
    if len(parts) < decisions.SPREAD_LEAST_BLOCKS:
        return None
    return replace(
        system,
        normals=np.array([system.normals[part].sum(axis=0) for part in parts]),
        scores=np.array([system.scores[part].sum(axis=0) for part in parts]),
    )


def compute_pseudo_covariance(
    blocks: System, misfit: float, penalty: Floats | float = 0.0
) -> tuple[Floats, Mask]:
    """Return the covariance of the blocks' pseudo-values, in sizes, and which it knows.

    The covariance is (parameters, parameters); what no block fixes, (parameters,), is not known.

    blocks: the normal equations at the optimum, a row for each block (`compute_spreads`).
    misfit: of the fit, in units of noise, 1 at least.
    penalty: (parameters, parameters) that the fit adds to the normal matrix.
    """
    sandwich, variances, count = compute_sandwich(blocks, 1, penalty)
    systematic = 1.0 - misfit**-2.0  # of the errors' power
    return count**2 * systematic / (count - 1) * sandwich, np.isfinite(variances)


def take_to_optimum(system: System) -> System:
    """Return the normal equations a Gauss-Newton step further."""
    step = np.linalg.lstsq(system.normal, system.gradient, rcond=1e-10)[0]
    return replace(system, scores=system.scores - system.normals @ step)


def divide_windows(system: System, pieces: int, blocks: int) -> list[Ints]:
    """Return the rows of the system that belong to each block of time."""
    whole = len(system.normals) // pieces
    parts = np.array_split(np.arange(whole), min(blocks, whole))
    return [list_pieces(part, pieces) for part in parts]


def list_pieces(whole: Ints, pieces: int) -> Ints:
    """Return the rows of whole windows, a row for each piece."""
    return np.asarray((whole[:, None] * pieces + np.arange(pieces)).reshape(-1))

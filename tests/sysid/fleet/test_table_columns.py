"""Columns in the table of a fleet: what no worker could read is refused before any work."""

from pathlib import Path

import pytest
import yaml
from support.made_recordings import INTECO

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.table import read_table
from pendulum_sysid.reading.columns import Columns
from pendulum_twin.model import save_twin

GOOD = {"time": "t", "command": "u", "cart": "x", "pole": "a"}


def write_table(folder: Path, columns: object) -> Path:
    save_twin(INTECO, folder / "twin.yaml")
    file = folder / "table.yaml"
    rigs = {"cart_1": {"twin": "twin.yaml", "columns": columns}}
    file.write_text(yaml.safe_dump({"schema": "pendulum_fleet/1", "rigs": rigs}))
    return file


def refuse(folder: Path, columns: object) -> str:
    file = write_table(folder, columns)
    with pytest.raises(FileError) as caught:
        read_table(file)
    sentence = str(caught.value)
    assert sentence.startswith(f"{file}: ") and "rig cart_1" in sentence and "\n" not in sentence
    return sentence


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("length_unit", "inch", "--length-unit m, cm or mm, found inch"),
        ("angle_unit", "degrees", "--angle-unit rad, deg or turn, found degrees"),
        ("time_unit", "min", "--time-unit s, ms, us or ns, found min"),
        ("command_unit", "volt", "--command-unit one, percent or per_mille, found volt"),
        ("command_acts", "sometimes", "--command-acts after or before, found sometimes"),
        ("pole_zero", "left", "--pole-zero up or down, found left"),
    ],
)
def test_a_choice_that_is_none_is_refused(
    tmp_path: Path, key: str, value: str, expected: str
) -> None:
    assert f"expected {expected}" in refuse(tmp_path, GOOD | {key: value})


def test_a_column_of_runs_is_refused_with_what_to_do(tmp_path: Path) -> None:
    """A file is a recording of the store: several runs in it would be read as one."""
    sentence = refuse(tmp_path, GOOD | {"segment": "run"})
    assert "found segment: run" in sentence and "sysid import --segment run" in sentence


def test_columns_that_make_no_recording_are_refused(tmp_path: Path) -> None:
    assert "found neither --cart nor --pole" in refuse(tmp_path, {"time": "t", "command": "u"})
    assert "found neither: say when" in refuse(tmp_path, {"cart": "x", "command": "u"})
    assert "--rate above 0, found 0" in refuse(
        tmp_path, {"rate_hz": 0, "command": "u", "cart": "x"}
    )
    assert "found columns: 'x'" in refuse(tmp_path, "x")
    assert "found lenght_unit: 'mm'" in refuse(tmp_path, GOOD | {"lenght_unit": "mm"})


def test_good_columns_are_read(tmp_path: Path) -> None:
    chosen = {
        "length_unit": "mm",
        "angle_unit": "deg",
        "time_unit": "us",
        "command_acts": "before",
    }
    (rig,) = read_table(write_table(tmp_path, GOOD | chosen | {"invert_cart": True, "skip": 1}))
    assert rig.columns == Columns(**GOOD, **chosen, invert_cart=True, skip=1)

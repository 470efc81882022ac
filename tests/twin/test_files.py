"""Files are written whole or not at all, named by their bytes, and read with their schema."""

import hashlib
import json
from pathlib import Path

import pytest

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest, read_json_object, read_yaml, write_atomically

SCHEMA = "pendulum_test/1"


def fail_to_replace(*_):
    raise OSError("disk full")


@pytest.mark.parametrize("content", ["a text, \u03b8", b"\x00\xff"], ids=["text", "bytes"])
def test_what_is_written_is_read(tmp_path, content):
    path = tmp_path / "new" / "folders" / "file"
    write_atomically(path, content)
    assert path.read_bytes() == (content.encode() if isinstance(content, str) else content)
    assert path.stat().st_mode & 0o777 == 0o644


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_atomically(path, "before")
    monkeypatch.setattr(Path, "replace", fail_to_replace)
    with pytest.raises(OSError, match="disk full"):
        write_atomically(path, "after")
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_digest_is_that_of_all_bytes_in_the_order_of_the_names(tmp_path):
    large = bytes(range(256)) * 10_000  # more than is held in memory at once
    for name, content in (("b", large), ("a", b"first")):
        (tmp_path / name).write_bytes(content)
    expected = f"sha256:{hashlib.sha256(b'first' + large).hexdigest()}"
    assert compute_digest([tmp_path / "b", tmp_path / "a"]) == expected


def test_a_json_object_is_read_with_its_schema(tmp_path):
    path = tmp_path / "file.json"
    path.write_text(json.dumps({"schema": SCHEMA, "value": 1}))
    assert read_json_object(path, SCHEMA, "a test") == {"schema": SCHEMA, "value": 1}


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"{", "but it cannot be read: it is no JSON"),
        (b"\xff", "but it cannot be read: it is not UTF-8 (byte 0): save it as UTF-8"),
        (b"[" * 100_000, "but it cannot be read: it is no JSON"),
        (b"[1]", "found another file"),
        (b'{"schema": "other/1"}', "found another file"),
        (None, "but it cannot be read: no such file"),
    ],
    ids=["no JSON", "no text", "too deep", "a list", "another schema", "not there"],
)
def test_another_file_is_refused_by_its_path(tmp_path, content, sentence):
    path = tmp_path / "file.json"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadInputError) as error:
        read_json_object(path, SCHEMA, "a test")
    assert str(error.value).startswith(f"{path}: expected a test with schema {SCHEMA}")
    assert sentence in str(error.value)


def test_a_yaml_file_that_is_none_is_refused_without_pythons_words(tmp_path):
    (tmp_path / "empty.yaml").write_text("")
    for name, sentence in (
        ("nope.yaml", "expected a test, but it cannot be read: no such file"),
        (".", "expected a test, but it cannot be read: it is a folder"),
        ("empty.yaml", "expected a test, found it empty"),
    ):
        with pytest.raises(BadInputError) as error:
            read_yaml(tmp_path / name, "a test")
        assert str(error.value) == f"{tmp_path / name}: {sentence}"

"""The state of drift tests that is stored."""

import hashlib
from pathlib import Path

from design.machine.documents import model_document
from design.machine.model import Model
from design.measured.drift_of_logs import Stream
from workbench.documents.reading import read_result
from workbench.output import dumps, write_whole

DRIFT_STREAM_SCHEMA = "drift_stream/1"


def model_key(model: Model) -> str:
    """What names a model in a stored state: sha256 of what model.json says of it."""
    document = model_document(model)
    if model.own_logs is None:  # as a model was named before it could hold them
        del document["own_logs"]
    if not document["bad_samples"]:
        del document["bad_samples"]
    return hashlib.sha256(dumps(document).encode()).hexdigest()


def read_stream(path: Path) -> Stream | None:
    """What `--state` stored at `path`, None where there is no file yet; raises BadModel."""
    return read_result(path, Stream, DRIFT_STREAM_SCHEMA) if path.exists() else None


def write_stream(path: Path, stream: Stream) -> None:
    """Store the stream, whole or not at all. Raises BadOutput where it cannot be written."""
    write_whole(path, dumps(stream) + "\n", "--state")

"""The JSON Schemas of what commands print, as the package ships them."""

import json
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

SCHEMAS = {
    file.name.removesuffix(".json"): json.loads(file.read_text(encoding="utf-8"))
    for file in files("memscal.cli").joinpath("schemas").iterdir()
}
REGISTRY = Registry().with_resources(
    (f"{name}.json", Resource.from_contents(schema)) for name, schema in SCHEMAS.items()
)


def faults(command: str, printed: Any) -> list[str]:
    """Return where an object is not what a command prints."""
    validator = Draft202012Validator(SCHEMAS[command], registry=REGISTRY)
    return [str(fault) for fault in validator.iter_errors(printed)]

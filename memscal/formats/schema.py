"""Names, versions and limits that the file formats share."""

from __future__ import annotations

SCAN_SCHEMA = "memscal-scan"
REFERENCE_SCHEMA = "memscal-reference"
ARTIFACT_SCHEMA = "memscal-artifact"
STRESS_SCHEMA = "memscal-stress"
SCHEMA_VERSION = "1.1.0"

SCHEMA_ATTRIBUTE = "memscal_schema"
VERSION_ATTRIBUTE = "memscal_schema_version"
DIGEST_ATTRIBUTE = "memscal_content_sha256"

# The list of what was written: a reader can follow it without ever listing a group.
CONTENTS_PATH = "/entry/contents/data"

MAX_FILE_BYTES = 256 * 2**20

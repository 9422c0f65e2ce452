#!/usr/bin/env bash
# Make the files of this folder again, by the commands in README.md: they are written only there.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
export SOURCE_DATE_EPOCH=0
sed -n '/^```sh$/,/^```$/{/^```/!p}' README.md | bash -euo pipefail -x

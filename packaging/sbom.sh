#!/usr/bin/env bash
# Write the software bill of materials of an installation: iccm from a folder of wheels, and what it depends on.
#
# usage: sbom.sh WHEELS OUTPUT.json
#
# It needs cyclonedx-py (the package cyclonedx-bom). The installation is made in a folder that is removed again.
set -euo pipefail
if [ $# -ne 2 ]; then
    echo "usage: sbom.sh WHEELS OUTPUT.json" >&2
    exit 2
fi
wheels=$1 output=$2
here=$(cd "$(dirname "$0")/.." && pwd)

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv --without-pip "$folder/venv"
"${PYTHON:-python3}" -m pip --python "$folder/venv" install --quiet --disable-pip-version-check \
    --find-links "$wheels" --only-binary iccm iccm
cyclonedx-py environment --pyproject "$here/pyproject.toml" --mc-type application \
    --output-reproducible --of JSON --output-file "$folder/iccm.json" "$folder/venv"
# The version is not in pyproject.toml, from which the main component is read.
"$folder/venv/bin/python" - "$folder/iccm.json" "$output" <<'EOF'
import json
import sys
from importlib.metadata import version

with open(sys.argv[1], encoding="utf-8") as file:
    bill = json.load(file)
bill["metadata"]["component"]["version"] = version("iccm")
with open(sys.argv[2], "w", encoding="utf-8") as file:
    json.dump(bill, file, indent=2)
EOF

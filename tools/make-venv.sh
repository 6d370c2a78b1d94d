#!/usr/bin/env bash
# Makes a Python environment with pinned packages: tools/make-venv.sh FOLDER REQUIREMENTS
set -eu
folder=$1
requirements=$2

if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
  echo "error: this Python cannot make environments; on Debian and Ubuntu:" >&2
  echo "  sudo apt-get install python3-venv" >&2
  exit 1
fi
python3 -m venv "$folder"
"$folder/bin/python" -m pip install --quiet --disable-pip-version-check -r "$requirements"

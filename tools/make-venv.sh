#!/usr/bin/env bash
# Makes a Python environment with pinned packages, or adds to it: tools/make-venv.sh FOLDER REQUIREMENTS...
# Files named simulators.txt say all that is needed: the packages in them are installed without dependencies.
set -eu
folder=$1
shift

if ! python3 -c 'import ensurepip, venv' 2>/dev/null; then
  echo "error: this Python cannot make environments; on Debian and Ubuntu:" >&2
  echo "  sudo apt-get install python3-venv" >&2
  exit 1
fi
python3 -m venv "$folder"
for requirements; do
  alone=
  if [ "$(basename "$requirements")" = simulators.txt ]; then alone=--no-deps; fi
  "$folder/bin/python" -m pip install --quiet --disable-pip-version-check $alone -r "$requirements"
done

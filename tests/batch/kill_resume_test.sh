#!/bin/sh
# kill_resume_test.sh CROWNFIT CAPTURE: a short form of the acceptance check, with true fits: a batch killed again and again
# ends as the undisturbed one. Exit code 77: the check is not here.
set -eu
check=${CROWNFIT_REFERENCE:-../shared}/acceptance/check_kill_resume.py
if [ ! -f "$check" ]; then
  echo "NOT RUN: no $check; set CROWNFIT_REFERENCE to the folder of data from elsewhere"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
{
  echo "id,capture,max_pixels,profiles"
  for i in 1 2 3; do echo "c$i,$2,${i}00,0"; done
} >"$folder/manifest.csv"
python3 "$check" "$1" "$folder/manifest.csv" --kills 4

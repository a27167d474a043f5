#!/bin/sh
# bad_inputs_test.sh CROWNFIT CAPTURE: the reference collection's check_bad_inputs.py; 77 (not run) when it is absent.
check=${CROWNFIT_REFERENCE:-../shared}/acceptance/check_bad_inputs.py
if [ ! -f "$check" ]; then
  echo "NOT RUN: $check is absent; set CROWNFIT_REFERENCE to the reference data"
  exit 77
fi
exec python3 "$check" "$1" "$2"

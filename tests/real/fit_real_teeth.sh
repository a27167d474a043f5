#!/bin/sh
# fit_real_teeth.sh BUILD OUT [FDI]: fits two real incisors, or the one named, to real photographs; exits 77 when the reference
# data is absent.
# The photographs are an unknown phone's, display-encoded, without colour chart: the right answer is `not_usable`, with
# reasons that say so, and a picture in which the render lies on the tooth.
set -eu
build=$1 out=$2 only=${3:-}
case_folder=${CROWNFIT_REFERENCE:-../shared}/data/real/teeth-photos-scan-smartee-case1
if [ ! -d "$case_folder" ]; then
  echo "NOT RUN: $case_folder is absent; set CROWNFIT_REFERENCE to the reference data"
  exit 77
fi
status=0
for crown in "11 frontal left right" "21 frontal left"; do
  # shellcheck disable=SC2086
  set -- $crown
  fdi=$1
  shift
  [ "${only:-$fdi}" = "$fdi" ] || continue
  "$build/tests/make_real_capture" "$case_folder" "$fdi" "$out/crown$fdi" "$@"
  code=0
  "$build/crownfit" fit "$out/crown$fdi" -o "$out/result$fdi" --model shader --max-pixels 1500 --profiles 0 --progress none || code=$?
  [ "$code" -eq 1 ] || { echo "FAIL: crown $fdi: exit $code, expected 1 (not usable)"; status=1; }
  for words in "light was not calibrated" "colour was not calibrated" "absolute reflectance is not identified"; do
    grep -q "$words" "$out/result$fdi/material.json" || { echo "FAIL: crown $fdi: material.json does not say: $words"; status=1; }
  done
done
exit $status

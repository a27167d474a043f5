#!/bin/sh
# installed_test.sh SOURCE BUILD: the archive of the program runs from wherever it is unpacked, in an empty environment,
# with the trees it was made from out of sight; what is installed and the Debian package hold the same files.
set -eu
source=$1 build=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

cpack --config "$build/CPackConfig.cmake" -G TGZ -B "$folder" >"$folder/log"
tar -xzf "$folder"/crownfit-*.tar.gz -C "$folder"
rm "$folder"/crownfit-*.tar.gz
mv "$folder"/crownfit-* "$folder/moved here"
cmake --install "$build" --strip --prefix "$folder/installed" >"$folder/log"
cpack --config "$build/CPackConfig.cmake" -G DEB -B "$folder" >"$folder/log"
dpkg-deb -f "$folder"/crownfit_*.deb Depends | grep -q 'libembree[34]'
dpkg-deb -x "$folder"/crownfit_*.deb "$folder/debian"
for tree in "installed" "debian/usr"; do
  (cd "$folder/$tree" && find . -type f ! -name NEEDS | sort) >"$folder/files"
  (cd "$folder/moved here" && find . -type f ! -name NEEDS | sort) | diff - "$folder/files"
done
photos="$source/datasets_synthetic/incisor_shader/photos"
"$folder/debian/usr/bin/crownfit" compare "$photos/front.exr" "$photos/side.exr" | grep -q de00_median
program="$folder/moved here/bin/crownfit" examples="$folder/moved here/share/crownfit/examples"

for tree in "$source" "$build"; do
  if grep -aq __ubsan_handle "$program"; then break; fi  # sanitizers name sources; such a build is not handed out
  if grep -aqF "$tree/" "$program"; then
    echo "the program names the folder it was built in:" && grep -aoF "$tree/" "$program" | head -3 && exit 1
  fi
done

cat >"$folder/run.sh" <<'END'
set -eu
program=$1 examples=$2 folder=$3
"$program" check "$examples/flat_samples" | grep -q ': valid'
"$program" slab "$folder/slab.json" | grep -q reflectance_collimated
"$program" calibrate target jig -o "$folder/target.svg" >"$folder/log"
photos="$examples/incisor_shader/photos"
"$program" compare "$photos/front.exr" "$photos/side.exr" | grep -q de00_median
"$program" fit "$examples/flat_samples" -o "$folder/result" >"$folder/log"
rm "$folder/result/report.html"
"$program" report "$folder/result" >"$folder/log"
grep -q 'Chart.js' "$folder/result/report.html"
END
echo '{"format": "crownfit-slab/1", "layers": [{"ior": 1.5, "scattering_per_mm": 2, "absorption_per_mm": 0.1, "thickness_mm": 1}]}' >"$folder/slab.json"
set -- env -i PATH=/usr/bin:/bin HOME=/nowhere sh "$folder/run.sh" "$program" "$examples" "$folder"
if unshare -rm true 2>"$folder/log"; then
  export source build
  unshare -rm sh -c 'mount -t tmpfs none "$build" && mount -t tmpfs none "$source" && cd / && exec "$@"' sh "$@"
  echo "ran with its source and build trees hidden"
else
  "$@"
  echo "ran; hiding its source and build trees is not allowed here"
fi

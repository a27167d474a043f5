#include <CLI/CLI.hpp>

#include "command_line_parts.h"
#include "commands.h"

namespace crownfit {

void AddCaptureMeasured(CLI::App& capture, CommandLine& line) {
  auto* measured = capture.add_subcommand(
      "measured",
      "A capture of measurements alone, from iad's file of total reflectance and transmittance (.rxt), and checks it:\n"
      "scattering and absorption free, index and g fixed, a measurement for each thickness. docs/measurements.md.");
  MeasuredParts& m = line.measured;
  measured->add_option("FILE", m.file, "The .rxt file; its readings must need no correction for a sphere.")->required();
  measured->add_option("-o,--output", line.output, "The capture's folder (made when missing).")->required();
  measured
      ->add_option("--wavelengths", m.wavelengths_nm,
                   "NM,NM,NM: of the three bands, or one for all (default 600,540,450). Between the file's own the "
                   "readings are interpolated.")
      ->delimiter(',');
  measured
      ->add_option("--rows", m.rows,
                   "N,N,N: rows of a file without wavelengths that are taken as the bands, or one for all, from 1.")
      ->delimiter(',');
  measured
      ->add_option("--stddev", m.stddev,
                   "Of every reading, repeatability and calibration together (default 0.005). Intervals rest on it.")
      ->check(CLI::Range(1e-7, 0.5));
  measured->add_option("--g", m.asymmetry, "Mean cosine of scattering, where the file has no column g (default 0.8).")
      ->check(CLI::Range(-0.99, 0.99));
  measured->add_option("--layer", m.layer, "Name of the material (default sample).");
  AddCommonOptions(measured, line);
}

int RunCaptureMeasured(const CommandLine& line) {
  InitMeasuredCapture(line.measured, line.output);
  return CheckWhatWasMade(line);
}

}  // namespace crownfit

#pragma once
// What the user asked for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "batch/slurm.h"
#include "calibrate_line.h"
#include "export_material.h"
#include "init_measurements.h"
#include "predict_line.h"
#include "report/crown_fit.h"
#include "trade_off.h"

namespace crownfit {

struct CommandLine {
  std::string command;                          ///< "fit", "check", ...
  std::string text;                             ///< the whole line, for run.json
  std::vector<std::filesystem::path> captures;  ///< of fit
  std::filesystem::path capture, output, material, mask, image_a, image_b;
  std::string photograph;
  bool json = false;
  bool half_float = false, fine = false;
  double scale = 1;          ///< render: of the pictures' width and height
  bool derivatives = false;  ///< render --model path
  std::optional<std::filesystem::path> screenshot;
  std::string size;                           ///< view: WxH
  int benchmark_frames = 0;                   ///< view
  std::vector<std::filesystem::path> meshes;  ///< view: outermost first
  std::filesystem::path save_to = ".";        ///< view
  bool print_layout = false;                  ///< view
  bool physical = false;                      ///< view: not the block "viewer"
  int pixels = 64;                            ///< match: of a picture's side
  double noise = 0;                           ///< render: relative noise to add
  int paths = 256;                            ///< render --model path: per pixel
  uint64_t photons = 1000000;                 ///< slab --model path
  ProgressMode progress = ProgressMode::kAuto;
  FitOptions fit;
  BatchOptions batch;
  std::optional<SlurmOptions> slurm;  ///< batch: submit instead of fitting here
  std::string batch_task;             ///< "status", "collect", "cancel", or empty
  CalibrateLine calibrate;
  MeasuredParts measured;  ///< capture measured
  ExportOptions exported;
  PredictLine predict;
  ShadesLine shades;
  TradeOffOptions trade_off;
  std::optional<int> exit_code;  ///< set when parsing already answered (--help, --version, a wrong option)
};

/// Parses; prints help and complaints itself.
CommandLine ParseCommandLine(int argc, char** argv);

}  // namespace crownfit

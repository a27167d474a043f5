#pragma once
// Cameras and poses as other programs write them.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// One photograph of a set. Lengths are in the source's unit.
struct ImportedView {
  std::string photograph;  ///< its file, as the source names it; may lack its ending
  Camera camera;
  RigidTransform camera_from_world;
};

/// A sparse model of COLMAP (Schönberger and Frahm 2016): cameras and images as .bin or .txt. Camera models
/// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV. Throws InputError for others.
std::vector<ImportedView> ReadColmap(const std::filesystem::path& folder);

/// transforms.json of NeRF programs (Mildenhall et al. 2020; Instant-NGP; Nerfstudio): camera-to-world matrices whose
/// camera looks along -z with y up. Throws InputError for fisheye cameras and matrices that are not rigid.
std::vector<ImportedView> ReadNerfTransforms(const std::filesystem::path& file);

/// The rotation next to a matrix. Nothing where its columns are orthonormal to no better than 1e-3, or left-handed.
std::optional<glm::dmat3> RotationNear(glm::dmat3 axes);

}  // namespace crownfit

// Poses of scanned crowns from their own outlines.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "calibration/align_scan.h"
#include "calibration/contours.h"
#include "calibration/scan_poses_product.h"
#include "capture/poses.h"
#include "geometry/mesh_file.h"
#include "photo/image_io.h"
#include "photo/photograph.h"
#include "support/real_data.h"
#include "support/rendered_target.h"
#include "support/scanned_mouth.h"

namespace crownfit {
namespace {

/// Turned by `deg` about a random axis through `centre` and shifted by `mm` in a random direction.
RigidTransform Perturbed(const RigidTransform& pose, const glm::dvec3& centre, double deg, double mm, uint64_t seed) {
  const auto direction = [&](int k) {
    return glm::normalize(glm::dvec3(Gaussian(Key(seed), k), Gaussian(Key(seed), k + 1), Gaussian(Key(seed), k + 2)));
  };
  const glm::dmat3 r = RotationFromVector(direction(0) * deg * 3.14159265358979 / 180.0);
  const glm::dvec3 shift = mm * direction(3);
  return {pose.rotation * r, pose.rotation * (centre + shift - r * centre) + pose.translation_mm};
}

/// Mean distance from the drawn lines' pixels to the nearest contour of the mesh.
double OutlineDistance(const Image& outline, const TriangleMesh& mesh, const Camera& camera,
                       const RigidTransform& pose) {
  const RayCaster caster({&mesh});
  const auto contours = Contours(caster, ConnectedParts(mesh), camera, pose, 3);
  double sum = 0, count = 0;
  for (int y = 0; y < outline.height; y += 2)
    for (int x = 0; x < outline.width; x += 2) {
      if (outline.at(x, y, 0) * outline.at(x, y, 3) < 0.5) continue;
      double nearest = 1e9;
      for (const auto& c : contours)
        nearest =
            std::min(nearest, glm::dot(c.pixel - glm::dvec2(x + 0.5, y + 0.5), c.pixel - glm::dvec2(x + 0.5, y + 0.5)));
      sum += std::min(60.0, std::sqrt(nearest));
      ++count;
    }
  return sum / count;
}

/// A crown lit from the left, on a blue ground.
Image CrownPicture(const TriangleMesh& mesh, const Camera& camera, const RigidTransform& pose, uint64_t seed) {
  const RayCaster caster({&mesh});
  const auto normals = CornerNormals(mesh);
  const RigidTransform back = pose.Inverse();
  Image image(camera.width, camera.height, 3);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      glm::dvec3 sum(0.0);
      for (int s = 0; s < 4; ++s) {
        const glm::dvec3 d =
            back.Direction(DirectionFromPixel(camera, {x + 0.25 + 0.5 * (s % 2), y + 0.25 + 0.5 * (s / 2)}));
        const auto hit = caster.Nearest(back.translation_mm, d);
        glm::dvec3 value(0.06, 0.08, 0.15);
        if (hit) {
          const auto& n = normals[hit->point.triangle];
          const glm::dvec3 normal = pose.Direction(
              glm::normalize(hit->point.weights.x * n[0] + hit->point.weights.y * n[1] + hit->point.weights.z * n[2]));
          value = glm::dvec3(0.7, 0.62, 0.45) *
                  (0.3 + 0.7 * std::max(0.0, glm::dot(normal, glm::normalize(glm::dvec3(-1, -1, -2)))));
        }
        sum += 0.25 * value;
      }
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<float>(sum[c]);
    }
  return Noisy(Blurred(image, 0.6), 1e-4, 1e-3, seed);
}

const Camera kCamera{.width = 480, .height = 400, .fx = 5200, .fy = 5200, .cx = 240, .cy = 200, .distortion = {}};

TriangleMesh Incisor() { return ReadMeshFile(std::filesystem::path(CROWNFIT_DATASETS) / "incisor/mesh/incisor.ply"); }

/// Largest image distance, in pixels, between the mesh's vertices under the two poses.
double Misplaced_px(const TriangleMesh& mesh, const RigidTransform& a, const RigidTransform& b) {
  double worst = 0;
  for (const auto& v : mesh.vertices)
    worst = std::max(worst, glm::length(*PixelFromPoint(kCamera, a.Point(v)) - *PixelFromPoint(kCamera, b.Point(v))));
  return worst;
}

TEST(ScanPose, OutlineAloneAlignsACrown) {
  const TriangleMesh mesh = Incisor();
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  for (int trial = 0; trial < 3; ++trial) {
    const RigidTransform truth = LookingAt(centre, 250, 180 - 20 * trial, 60 * trial, 10 * trial);
    const Image image = CrownPicture(mesh, kCamera, truth, trial + 1);
    const RigidTransform start = Perturbed(truth, centre, 5.0, 1.5, 50 + trial);
    const AlignedScan aligned =
        AlignScan(mesh, {{&image, kCamera, start}}, {.search_mm = 1.5, .search_deg = 5, .starts = 120});
    EXPECT_GT(aligned.contrast[0], 0.8);
    EXPECT_GT(aligned.matched[0], 0.7) << trial;
    EXPECT_GT(Misplaced_px(mesh, start, truth), 15) << "starting at the truth would prove nothing";
    // The outline determines the lateral position. A turn about an axis in the image plane hardly changes it.
    const glm::dvec3 off = aligned.camera_from_object[0].Point(centre) - truth.Point(centre);
    EXPECT_LT(std::hypot(off.x, off.y), 0.05) << trial;
    const glm::dmat3 turn = glm::transpose(truth.rotation) * aligned.camera_from_object[0].rotation;
    const double degrees = std::acos(std::clamp(0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0), -1.0, 1.0)) * 57.3;
    EXPECT_LT(degrees, 3.0) << trial << ": other rotations have nearly the same outline";
    EXPECT_LT(aligned.from_start, 1.0);
  }
}

TEST(ScanPose, SeveralPhotographsResolveSingleViewAmbiguity) {
  const TriangleMesh mesh = Incisor();
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  std::vector<RigidTransform> truths;
  std::vector<Image> images;
  for (int k = 0; k < 3; ++k) {
    truths.push_back(LookingAt(centre, 250, 180 - 35 * k, 120 * k, 0));
    images.push_back(CrownPicture(mesh, kCamera, truths.back(), 9 + k));
  }
  // The object's pose is wrong by the same amount in all photographs.
  const RigidTransform wrong = Perturbed({}, centre, 5.0, 1.0, 3);
  std::vector<ScanPhotograph> photographs;
  for (int k = 0; k < 3; ++k)
    photographs.push_back(
        {&images[k], kCamera, {truths[k].rotation * wrong.rotation, truths[k].Point(wrong.translation_mm)}});
  const AlignedScan aligned = AlignScan(mesh, photographs, {.search_mm = 1.0, .search_deg = 5, .starts = 120});
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(Misplaced_px(mesh, aligned.camera_from_object[k], truths[k]), 3.0) << k;
    // Shift of the object's centre in the camera frame, against its stated standard deviation.
    const glm::dvec3 at = truths[k].Point(centre), off = aligned.camera_from_object[k].Point(centre) - at;
    const glm::dmat3 cov = PlaceCovariance(aligned.covariance[k], at);
    for (int i = 0; i < 2; ++i)
      EXPECT_LT(std::abs(off[i]), 4 * std::sqrt(cov[i][i]) + 0.01) << "photograph " << k << " axis " << i;
  }
}

TEST(ScanPose, MeshOfWrongSizeIsRefused) {
  TriangleMesh mesh = Incisor();
  const auto [low, high] = Bounds(mesh);
  const glm::dvec3 centre = 0.5 * (low + high);
  std::vector<RigidTransform> truths;
  std::vector<Image> images;
  for (int k = 0; k < 3; ++k) {
    truths.push_back(LookingAt(centre, 250, 180 - 35 * k, 120 * k, 0));
    images.push_back(CrownPicture(mesh, kCamera, truths.back(), 9 + k));
  }
  std::vector<ScanPhotograph> photographs;
  for (int k = 0; k < 3; ++k) photographs.push_back({&images[k], kCamera, truths[k]});
  const AlignOptions near{.search_mm = 0.3, .search_deg = 2, .starts = 12};
  const AlignedScan right = AlignScan(mesh, photographs, near);
  EXPECT_LT(std::abs(right.larger), 3 * right.larger_stddev);
  for (glm::dvec3& v : mesh.vertices) v = centre + 1.05 * (v - centre);
  const AlignedScan wrong = AlignScan(mesh, photographs, near);
  EXPECT_NEAR(wrong.larger, 1 / 1.05 - 1, 0.015);
  const Product product = ScanPosesProduct(mesh, {"a", "b", "c"}, photographs, {wrong});
  ASSERT_FALSE(product.refusals.empty());
  EXPECT_NE(product.refusals[0].find("larger than its mesh"), std::string::npos) << product.refusals[0];
}

void ExpectReturn(const std::filesystem::path& real, const std::vector<std::string>& views) {
  const ScannedMouth mouth(real);
  for (const std::string& view : views) {
    TriangleMesh mesh;
    for (const auto& entry : std::filesystem::directory_iterator(real / "crowns-byFDI")) {
      const bool is_lower = entry.path().stem().string()[3] >= '3';
      if ((view == "upper_occlusal" && is_lower) || (view == "lower_occlusal" && !is_lower)) continue;
      const TriangleMesh crown = ReadMeshFile(entry.path());
      const int first = static_cast<int>(mesh.vertices.size());
      for (const auto& v : crown.vertices)
        mesh.vertices.push_back(view == "lower_occlusal" ? v : mouth.InUpperScan(v, is_lower));
      for (const auto& t : crown.triangles) mesh.triangles.push_back(t + first);
    }
    RigidTransform published;
    const Camera camera = mouth.ReadView(view, published);
    const ImageFile photo = ReadImageFile(real / "photos" / (view + ".png"));
    Image linear = photo.image;
    for (float& v : linear.values) v = static_cast<float>(LinearFromSrgb(v));
    const Image outline = ReadImageFile(real / "boundary-labels" / (view + ".png")).image;
    const auto [low, high] = Bounds(mesh);
    const RigidTransform start = Perturbed(published, 0.5 * (low + high), 5.0, 5.0, std::hash<std::string>{}(view));
    const AlignedScan aligned = AlignScan(mesh, {{&linear, camera, start}}, {});
    const double of_published = OutlineDistance(outline, mesh, camera, published);
    const double of_start = OutlineDistance(outline, mesh, camera, start);
    const double of_aligned = OutlineDistance(outline, mesh, camera, aligned.camera_from_object[0]);
    std::printf(
        "%-15s published %.2f px, perturbed %.2f px, aligned %.2f px (rms %.2f px, %.0f %% matched, contrast %.2f)\n",
        view.c_str(), of_published, of_start, of_aligned, aligned.rms_px[0], 100 * aligned.matched[0],
        aligned.contrast[0]);
    EXPECT_LE(of_aligned, 1.3 * of_published) << view;
  }
}

TEST(ScanPoseReal, PerturbedCrownsReturnToDrawnOutlines) {
  REQUIRE_REAL_DATA("teeth-photos-scan-smartee-case1");
  ExpectReturn(real, {"frontal", "right", "lower_occlusal"});
}

TEST(ScanPoseReal, PerturbedCrownsReturnToDrawnOutlinesInOtherViews) {
  REQUIRE_REAL_DATA("teeth-photos-scan-smartee-case1");
  ExpectReturn(real, {"left", "upper_occlusal"});
}

}  // namespace
}  // namespace crownfit

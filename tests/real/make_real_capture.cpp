// make_real_capture CASE_FOLDER FDI OUT_FOLDER VIEW...: a capture of one scanned crown and real photographs of it, from
// the published case "teeth-photos-scan-smartee-case1" (scan in millimetres, cameras and outlines by its authors).
//
// Mask: the hand-drawn outline around the crown, filled, eroded by 12 pixels. Neighbours are scenery. The flash is a
// disk at the camera; its power and every exposure are unknown.

#include <cmath>
#include <cstdio>
#include <queue>
#include <string>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "capture/camera.h"
#include "capture/capture.h"
#include "capture/rigid_transform.h"
#include "geometry/mesh_file.h"
#include "photo/image_io.h"
#include "support/scanned_mouth.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Object = JsonValue::Object;
using List = std::vector<double>;
constexpr int kErosion_px = 12;

/// Fills the outline around `seed`, then erodes.
Image MaskFromOutline(const Path& file, const glm::dvec2& seed) {
  const Image outline = ReadImageFile(file).image;
  const int w = outline.width, h = outline.height;
  const auto is_line = [&](int x, int y) {
    return outline.at(x, y, 0) * (outline.channels == 4 ? outline.at(x, y, 3) : 1.0f) > 0.15f;
  };
  std::vector<char> inside(static_cast<size_t>(w) * h, 0);
  std::queue<std::pair<int, int>> open;
  const auto visit = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= w || y >= h || inside[static_cast<size_t>(y) * w + x] || is_line(x, y)) return;
    inside[static_cast<size_t>(y) * w + x] = 1;
    open.emplace(x, y);
  };
  visit(static_cast<int>(seed.x), static_cast<int>(seed.y));
  size_t area = 0;
  for (; !open.empty(); ++area) {
    const auto [x, y] = open.front();
    open.pop();
    visit(x + 1, y);
    visit(x - 1, y);
    visit(x, y + 1);
    visit(x, y - 1);
  }
  if (area < 2000 || area > 100000)
    throw InputError(file, "",
                     "the outline around pixel " + std::to_string(seed.x) + ", " + std::to_string(seed.y) +
                         " encloses " + std::to_string(area) + " pixels, which is not a tooth");
  Image mask(w, h, 3, 0.0f);
  for (int y = kErosion_px; y < h - kErosion_px; ++y) {
    for (int x = kErosion_px; x < w - kErosion_px; ++x) {
      bool keep = true;
      for (int v = -kErosion_px; v <= kErosion_px && keep; ++v)
        for (int u = -kErosion_px; u <= kErosion_px && keep; ++u)
          keep = u * u + v * v > kErosion_px * kErosion_px || inside[static_cast<size_t>(y + v) * w + x + u];
      for (int c = 0; c < 3 && keep; ++c) mask.at(x, y, c) = 1.0f;
    }
  }
  return mask;
}

TriangleMesh Neighbours(const ScannedMouth& scan, const std::string& fdi) {
  TriangleMesh all;
  for (int quadrant = 1; quadrant <= 4; ++quadrant) {
    for (int tooth = 1; tooth <= 7; ++tooth) {
      const std::string name = std::to_string(quadrant) + std::to_string(tooth);
      if (name == fdi) continue;
      const TriangleMesh crown = ReadMeshFile(scan.folder_ / "crowns-byFDI" / ("FDI" + name + ".obj"));
      const int first = static_cast<int>(all.vertices.size());
      for (const auto& v : crown.vertices) all.vertices.push_back(scan.InUpperScan(v, quadrant >= 3));
      for (const auto& t : crown.triangles) all.triangles.push_back(t + first);
    }
  }
  return all;
}

JsonValue::Array Rows(const glm::dmat3& m) {
  JsonValue::Array rows;
  for (int r = 0; r < 3; ++r) rows.push_back(List{m[0][r], m[1][r], m[2][r]});
  return rows;
}

void WriteCapture(const Path& folder, const std::string& fdi, const Path& out, const std::vector<std::string>& views) {
  const ScannedMouth scan(folder);
  const TriangleMesh crown = ReadMeshFile(folder / "crowns-byFDI" / ("FDI" + fdi + ".obj"));
  WritePly(out / "mesh/crown.ply", crown);
  WritePly(out / "mesh/neighbours.ply", Neighbours(scan, fdi));
  glm::dvec3 centre(0.0);
  for (const auto& v : crown.vertices) centre += v / static_cast<double>(crown.vertices.size());
  JsonValue::Array photographs;
  for (const auto& view : views) {
    RigidTransform pose;
    const Camera camera = scan.ReadView(view, pose);
    WriteTextFile(out / "calib" / (view + ".json"), ToJsonText(Object{{"format", "crownfit-camera/1"},
                                                                      {"width", camera.width},
                                                                      {"height", camera.height},
                                                                      {"fx", camera.fx},
                                                                      {"fy", camera.fy},
                                                                      {"cx", camera.cx},
                                                                      {"cy", camera.cy}}));
    WriteImageFile(out / "photos" / (view + "_mask.png"), MaskFromOutline(folder / "boundary-labels" / (view + ".png"),
                                                                          *PixelFromPoint(camera, pose.Point(centre))));
    photographs.push_back(
        Object{{"name", view},
               {"file", std::filesystem::absolute(folder / "photos" / (view + ".png")).string()},
               {"camera", "calib/" + view + ".json"},
               {"camera_from_object",
                Object{{"rotation", Rows(pose.rotation)},
                       {"translation_mm", List{pose.translation_mm.x, pose.translation_mm.y, pose.translation_mm.z}}}},
               {"lights", JsonValue::Array{"flash"}},
               {"scenery", JsonValue::Array{"neighbours"}},
               {"mask", "photos/" + view + "_mask.png"},
               {"exposure_scale", Object{{"initial", 1.0}}}});
  }
  // 311 x (4 mm / 125 mm)^2 x pi is irradiance 1 at the teeth; the true power is unknown and every exposure free.
  const JsonValue flash = Object{{"name", "flash"},
                                 {"type", "disk"},
                                 {"frame", "camera"},
                                 {"centre_mm", List{0, -8, 0}},
                                 {"normal", List{0, 0, 1}},
                                 {"radius_mm", 4},
                                 {"radiance_rgb", List{311, 311, 311}}};
  WriteTextFile(out / "calib/light_rig.json",
                ToJsonText(Object{{"format", "crownfit-light-rig/1"}, {"lights", JsonValue::Array{flash}}}));
  const auto fixed = [](double v) { return Object{{"fixed", v}}; };
  const auto initial = [](List v) { return Object{{"initial", v}}; };
  const JsonValue::Array layers{Object{{"name", "enamel"},
                                       {"surface", "mesh/crown.ply"},
                                       {"thickness_mm", fixed(0.8)},
                                       {"ior", fixed(1.63)},
                                       {"g", fixed(0.96)},
                                       {"reduced_scattering_per_mm", initial({0.3, 0.3, 0.3})},
                                       {"absorption_per_mm", initial({0.01, 0.02, 0.05})}},
                                Object{{"name", "dentine"},
                                       {"ior", fixed(1.54)},
                                       {"g", fixed(0.93)},
                                       {"reduced_scattering_per_mm", initial({2, 2, 2})},
                                       {"absorption_per_mm", initial({0.03, 0.06, 0.2})}}};
  const JsonValue neighbours =
      Object{{"name", "neighbours"}, {"mesh", "mesh/neighbours.ply"}, {"reflectance_rgb", List{0.55, 0.5, 0.4}}};
  WriteTextFile(out / "capture.json",
                ToJsonText(Object{{"format", "crownfit-capture/1"},
                                  {"object", Object{{"layers", layers},
                                                    {"surface", Object{{"roughness", Object{{"initial", 0.2}}}}},
                                                    {"scenery", JsonValue::Array{neighbours}}}},
                                  {"light_rig", "calib/light_rig.json"},
                                  {"photographs", photographs}}));
}

}  // namespace
}  // namespace crownfit

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr, "usage: make_real_capture CASE_FOLDER FDI OUT_FOLDER VIEW...\n");
    return 2;
  }
  try {
    crownfit::WriteCapture(argv[1], argv[2], argv[3], {argv + 4, argv + argc});
  } catch (const crownfit::InputError& e) {
    std::fprintf(stderr, "make_real_capture: %s\n", e.what());
    return 2;
  }
  return 0;
}

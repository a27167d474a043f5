// Cameras of other programs: a point of the source lands on the pixel where the source's own formulas put it.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "capture/capture.h"
#include "exchange/import_capture.h"
#include "exchange/imported_views.h"
#include "geometry/mesh_file.h"
#include "photo/image_io.h"
#include "support/refusal.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

// One image of COLMAP turned by 90 degrees about z: quaternion (sqrt(1/2), 0, 0, sqrt(1/2)), so that its camera's x
// axis is the world's -y and its y axis the world's x.
constexpr double kHalf = 0.7071067811865476;
const glm::dvec3 kPoint(0.3, -0.2, 0.5), kShift(0.1, 0.2, 4.0);
const glm::dvec3 kInCamera(0.2 + 0.1, 0.3 + 0.2, 0.5 + 4.0);

/// By COLMAP's documentation: OPENCV as in OpenCV, pixel centres at halves.
glm::dvec2 ExpectedPixel() {
  const double x = kInCamera.x / kInCamera.z, y = kInCamera.y / kInCamera.z, r2 = x * x + y * y,
               radial = 1 + 0.1 * r2 - 0.05 * r2 * r2;
  return {800 * (x * radial + 2 * 0.001 * x * y + 0.002 * (r2 + 2 * x * x)) + 320,
          810 * (y * radial + 0.001 * (r2 + 2 * y * y) + 2 * 0.002 * x * y) + 240};
}

void ExpectTheView(const std::vector<ImportedView>& views) {
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].photograph, "folder/a photo.png");
  EXPECT_EQ(views[0].camera.width, 640);
  EXPECT_EQ(views[0].camera.height, 480);
  const auto pixel = PixelFromPoint(views[0].camera, views[0].camera_from_world.Point(kPoint));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, ExpectedPixel().x, 1e-9);
  EXPECT_NEAR(pixel->y, ExpectedPixel().y, 1e-9);
  EXPECT_EQ(views[1].camera.fy, 500) << "one focal length for both axes";
  EXPECT_EQ(views[1].camera.distortion[0], 0.02);
}

TEST(Import, ColmapTextIsReadWithItsConventions) {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "cameras.txt") << "# Camera list\n1 OPENCV 640 480 800 810 320 240 0.1 -0.05 0.001 "
                                                "0.002\n7 SIMPLE_RADIAL 100 50 500 50 25 0.02\n";
  std::ofstream(folder.path / "images.txt")
      << "# Image list\n1 0.7071067811865476 0 0 0.7071067811865476 0.1 0.2 4 1 folder/a photo.png\n"
         "12.5 3 -1 4 5 6\n2 1 0 0 0 0 0 1 7 b.png\n\n";
  ExpectTheView(ReadColmap(folder.path));
}

template <class T>
void Put(std::ofstream& out, T value) {
  out.write(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Bytes as COLMAP documents its binary format.
void WriteBinaryModel(const std::filesystem::path& folder, uint32_t first_model = 4) {
  std::ofstream cameras(folder / "cameras.bin", std::ios::binary), images(folder / "images.bin", std::ios::binary);
  Put<uint64_t>(cameras, 2);
  Put<uint32_t>(cameras, 1), Put<uint32_t>(cameras, first_model);
  Put<uint64_t>(cameras, 640), Put<uint64_t>(cameras, 480);
  for (const double p : {800.0, 810.0, 320.0, 240.0, 0.1, -0.05, 0.001, 0.002}) Put(cameras, p);
  Put<uint32_t>(cameras, 7), Put<uint32_t>(cameras, 2);
  Put<uint64_t>(cameras, 100), Put<uint64_t>(cameras, 50);
  for (const double p : {500.0, 50.0, 25.0, 0.02}) Put(cameras, p);
  Put<uint64_t>(images, 2);
  Put<uint32_t>(images, 1);
  for (const double v : {kHalf, 0.0, 0.0, kHalf, kShift.x, kShift.y, kShift.z}) Put(images, v);
  Put<uint32_t>(images, 1);
  images << "folder/a photo.png" << '\0';
  Put<uint64_t>(images, 1), Put(images, 12.5), Put(images, 3.0), Put<uint64_t>(images, 9);
  Put<uint32_t>(images, 2);
  for (const double v : {1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}) Put(images, v);
  Put<uint32_t>(images, 7);
  images << "b.png" << '\0';
  Put<uint64_t>(images, 0);
}

TEST(Import, ColmapBinaryIsReadAndTruncatedFilesAreRefused) {
  const TemporaryFolder folder;
  WriteBinaryModel(folder.path);
  ExpectTheView(ReadColmap(folder.path));
  const auto images = folder.path / "images.bin";
  const std::uintmax_t whole = std::filesystem::file_size(images);
  for (const std::uintmax_t size : {whole - 1, whole - 30, whole / 2, std::uintmax_t{7}}) {
    std::filesystem::resize_file(images, size);
    EXPECT_NE(FaultOf([&] { ReadColmap(folder.path); }).find("truncated"), std::string::npos) << size;
  }
}

TEST(Import, CameraModelsWithoutAnEquivalentAreRefusedByName) {
  const TemporaryFolder folder;
  WriteBinaryModel(folder.path, 5);
  EXPECT_NE(FaultOf([&] { ReadColmap(folder.path); }).find("OPENCV_FISHEYE"), std::string::npos);
}

/// A camera 4 units along the world's x axis that looks back at the origin with the world's z up. OpenGL: its x axis is
/// the world's y, its y axis the world's z, its z axis points away from the origin.
std::string Transforms(const std::string& camera) {
  return "{" + camera +
         ", \"aabb_scale\": 4, \"frames\": [{\"file_path\": \"./images/a\", \"sharpness\": 3, "
         "\"transform_matrix\": [[0, 0, 1, 4], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]}]}";
}

TEST(Import, NerfTransformsLookAlongMinusZ) {
  const TemporaryFolder folder;
  const auto file = folder.path / "transforms.json";
  std::ofstream(file) << Transforms("\"w\": 400, \"h\": 300, \"camera_angle_x\": 0.9");
  const auto views = ReadNerfTransforms(file);
  ASSERT_EQ(views.size(), 1u);
  const double f = 200 / std::tan(0.45);
  // Right in the picture is the world's +y, up its +z.
  const auto pixel = PixelFromPoint(views[0].camera, views[0].camera_from_world.Point({0, 0.5, 0.3}));
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x, 200 + f * 0.5 / 4, 1e-9);
  EXPECT_NEAR(pixel->y, 150 - f * 0.3 / 4, 1e-9);
}

TEST(Import, NerfTransformsWithoutAnEquivalentAreRefusedByName) {
  const TemporaryFolder folder;
  const auto file = folder.path / "transforms.json";
  const auto fault = [&](const std::string& camera) {
    std::ofstream(file) << Transforms(camera);
    return FaultOf([&] { ReadNerfTransforms(file); });
  };
  EXPECT_NE(fault("\"w\": 400, \"h\": 300").find("fl_x"), std::string::npos);
  EXPECT_NE(fault("\"fl_x\": 400").find("size of the photographs"), std::string::npos);
  EXPECT_NE(fault("\"w\": 4, \"h\": 3, \"fl_x\": 4, \"camera_model\": \"OPENCV_FISHEYE\"").find("OPENCV_FISHEYE"),
            std::string::npos);
  std::string scaled = Transforms("\"w\": 4, \"h\": 3, \"fl_x\": 4");
  scaled.replace(scaled.find("[1, 0, 0, 0]"), 12, "[2, 0, 0, 0]");
  std::ofstream(file) << scaled;
  EXPECT_NE(FaultOf([&] { ReadNerfTransforms(file); }).find("no rotation"), std::string::npos);
}

/// Two frames of a camera 4 units from a sphere, one lamp of each photograph's name, and one for both.
ImportParts TwoFrames(const std::filesystem::path& folder) {
  std::ofstream(folder / "transforms.json") << R"({"w": 8, "h": 8, "fl_x": 20, "frames": [
        {"file_path": "a", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]},
        {"file_path": "b", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]}]})";
  std::ofstream(folder / "rig.json") << R"({"format": "crownfit-light-rig/1", "lights": [
        {"name": "a", "type": "point", "position_mm": [0, 0, 100], "radiant_intensity_rgb": 1},
        {"name": "b", "type": "point", "position_mm": [0, 100, 0], "radiant_intensity_rgb": 1},
        {"name": "sky", "type": "dome", "radiance_rgb": 0.1}]})";
  WritePly(folder / "sphere.ply", Sphere(1.0, 8));
  ImportParts parts;
  parts.sources = {folder / "transforms.json"};
  parts.photographs = folder;
  parts.capture.meshes = {{"ball", folder / "sphere.ply"}};
  parts.capture.lights = folder / "rig.json";
  parts.capture.channels = {{"NIR", 850.0}};
  return parts;
}

TEST(Import, LampsOfPhotographsThatAreMissingAreOnNowhere) {
  const TemporaryFolder folder;
  const ImportParts parts = TwoFrames(folder.path);
  WriteImageFile(folder.path / "a.exr", Image(8, 8, 1, 0.5f), false, {"NIR"});
  WriteImageFile(folder.path / "a_variance.exr", Image(8, 8, 1, 0.01f), false, {"NIR"});
  EXPECT_EQ(ImportCapture(parts, folder.path / "one"), std::vector<std::string>{"b"});
  const Capture one = ReadCapture(folder.path / "one");
  ASSERT_EQ(one.photographs.size(), 1u);
  std::vector<std::string> lit;
  for (const size_t l : one.photographs[0].lights) lit.push_back(one.lights[l].name);
  EXPECT_EQ(lit, (std::vector<std::string>{"sky", "a"}));
  EXPECT_EQ(one.channel_names, std::vector<std::string>{"NIR"});
  EXPECT_NEAR(ReadPhotograph(one.photographs[0].files).variance.at(3, 3, 0), 0.01, 1e-8) << "the picture beside it";

  WriteImageFile(folder.path / "b.exr", Image(8, 8, 1, 0.5f), false, {"NIR"});
  EXPECT_TRUE(ImportCapture(parts, folder.path / "both").empty());
  const Capture both = ReadCapture(folder.path / "both");
  ASSERT_EQ(both.photographs.size(), 2u);
  EXPECT_EQ(both.photographs[1].lights.size(), 2u);
  EXPECT_FALSE(both.photographs[1].files.variance);
}

}  // namespace
}  // namespace crownfit

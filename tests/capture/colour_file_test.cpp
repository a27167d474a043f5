// Colour files: matrices that can't tell colours apart are refused.

#include "capture/colour_file.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

std::string RefusalOf(const std::string& matrix, const std::string& more = "") {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "colour.json", R"({"format": "crownfit-colour/1", "white_sensor_rgb": [1, 1, 1],
    "linear_rgb_from_sensor_rgb": )" + matrix + more +
                                                 "}");
  try {
    ReadColourTransform(folder.path / "colour.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ColourFiles, ASingularMatrixIsRefusedByName) {
  for (const char* matrix : {"[[0, 0, 0], [0, 0, 0], [0, 0, 0]]", "[[1, 0, 0], [1, 0, 0], [0, 0, 1]]",
                             "[[1, 2, 3], [4, 5, 6], [5, 7, 9]]", "[[1, 0, 0], [0, 1, 0], [0, 0, 0]]"})
    EXPECT_NE(RefusalOf(matrix).find("colour.json: linear_rgb_from_sensor_rgb: is singular"), std::string::npos)
        << matrix << RefusalOf(matrix);
  const std::string polynomial = R"(, "polynomial": {"terms": "root2", "coefficients": [[0, 0, 0, 0, 0, 0],
    [0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0]]})";
  EXPECT_NE(RefusalOf("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", polynomial).find("polynomial.coefficients: is singular"),
            std::string::npos);
}

TEST(ColourFiles, MatricesOfCamerasAreReadAtAnyScale) {
  // From camera to linear sRGB, of a camera with strong crosstalk, in units of reflectance and of 16-bit counts.
  for (const char* matrix : {"[[2.1, -1.3, 0.2], [-0.4, 1.9, -0.5], [0.1, -1.1, 2.0]]",
                             "[[2.1e-5, -1.3e-5, 0.2e-5], [-0.4e-5, 1.9e-5, -0.5e-5], [0.1e-5, -1.1e-5, 2e-5]]"})
    EXPECT_EQ(RefusalOf(matrix), "");
}

}  // namespace
}  // namespace crownfit

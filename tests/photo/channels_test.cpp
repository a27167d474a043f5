// Values per channel, colours of spectra, and photographs of any number of channels.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numeric>

#include "photo/image_io.h"
#include "photo/observer.h"
#include "photo/photograph.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

TEST(Spectrum, WorksChannelByChannelForAnyNumberOfChannels) {
  for (int channels = 1; channels <= kMostChannels; ++channels) {
    Spectrum a(channels, 0.0), b(channels, 0.0);
    for (int c = 0; c < channels; ++c) a[c] = 1.5 + c, b[c] = 0.25 * c + 1.0;
    const Spectrum product = a * b, quotient = a / b, difference = a - b, scaled = 2.0 * a + 1.0;
    double sum = 0;
    for (int c = 0; c < channels; ++c) {
      EXPECT_EQ(product[c], (1.5 + c) * (0.25 * c + 1.0)) << c << " of " << channels;
      EXPECT_EQ(quotient[c], (1.5 + c) / (0.25 * c + 1.0)) << c << " of " << channels;
      EXPECT_EQ(difference[c], (1.5 + c) - (0.25 * c + 1.0)) << c << " of " << channels;
      EXPECT_EQ(scaled[c], 2.0 * (1.5 + c) + 1.0) << c << " of " << channels;
      EXPECT_EQ(Exp(-a)[c], std::exp(-1.5 - c)) << c << " of " << channels;
      sum += a[c];
    }
    EXPECT_EQ(product.size(), channels);
    EXPECT_DOUBLE_EQ(a.Sum(), sum);
    EXPECT_EQ(a.Largest(), 0.5 + channels);
    EXPECT_EQ(a.Smallest(), 1.5);
  }
}

TEST(Spectrum, OneValueStandsForAllChannels) {
  const Spectrum half(0.5), many(7, 3.0);
  const Spectrum product = half * many;
  EXPECT_EQ(product.size(), 7);
  EXPECT_EQ(product, Spectrum(7, 1.5));
  Spectrum sum;
  for (int i = 0; i < 4; ++i) sum += many;
  EXPECT_EQ(sum, Spectrum(7, 12.0));
  EXPECT_EQ((half + half).size(), 0) << "still of any number";
}

TEST(SpectrumDeathTest, DifferentNumbersOfChannelsDoNotMix) {
  const Spectrum three(3, 1.0), four(4, 1.0);
  EXPECT_DEATH((void)(three + four), "channel");
  SpectrumArray<> none;
  EXPECT_DEATH(none.push_back(Spectrum(1.0)), "channel") << "one value does not state how many there are";
}

std::vector<double> EvenlySpaced(double from_nm, double to_nm, double step_nm) {
  std::vector<double> nm;
  for (double at = from_nm; at <= to_nm; at += step_nm) nm.push_back(at);
  return nm;
}

/// Patches of a ColorChecker, 400 to 700 nm in steps of 20 nm (BabelColor's averages, in colour-science 0.4.7), and
/// their CIELAB under D65 by colour-science: of these samples with linear interpolation, and of the spectra in steps of
/// 10 nm.
struct Patch {
  std::vector<double> reflectance;
  glm::dvec3 of_samples, of_spectrum;
};
const std::vector<Patch> kPatches{
    {{0.294, 0.408, 0.426, 0.419, 0.379, 0.311, 0.254, 0.214, 0.202, 0.193, 0.214, 0.241, 0.279, 0.348, 0.366, 0.358},
     {55.651, 10.836, -23.943},
     {55.532, 11.199, -24.432}},
    {{0.131, 0.133, 0.130, 0.125, 0.115, 0.105, 0.095, 0.092, 0.096, 0.156, 0.399, 0.556, 0.588, 0.593, 0.598, 0.607},
     {50.545, 44.588, 14.990},
     {50.338, 45.441, 14.577}},
    {{0.192, 0.261, 0.317, 0.390, 0.446, 0.423, 0.337, 0.231, 0.146, 0.101, 0.082, 0.074, 0.073, 0.076, 0.076, 0.073},
     {51.872, -23.992, -25.197},
     {51.795, -24.217, -25.519}},
    {{0.062, 0.064, 0.069, 0.085, 0.139, 0.271, 0.476, 0.549, 0.528, 0.471, 0.381, 0.327, 0.312, 0.314, 0.345, 0.376},
     {72.180, -26.373, 57.314},
     {72.367, -27.151, 58.313}}};

TEST(Observer, ColoursOfSpectraAgreeWithColourScience) {
  const ColourTransform transform = ColourOfChannels(EvenlySpaced(400, 700, 20));
  for (const Patch& patch : kPatches) {
    const glm::dvec3 lab = LabFromLinearRgb(transform(Spectrum(patch.reflectance)));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(lab[k], patch.of_samples[k], 0.02);
    EXPECT_LT(Ciede2000(lab, patch.of_spectrum), 0.5) << "sampled every 20 nm";
  }
}

TEST(Observer, OrderOfChannelsDoesNotMatter) {
  std::vector<double> nm = EvenlySpaced(400, 700, 20), values = kPatches[0].reflectance;
  const glm::dvec3 rising = ColourOfChannels(nm)(Spectrum(values));
  std::reverse(nm.begin(), nm.end());
  std::reverse(values.begin(), values.end());
  EXPECT_LT(glm::distance(ColourOfChannels(nm)(Spectrum(values)), rising), 1e-12);
}

TEST(Observer, WhiteIsWhiteAndGreyIsGrey) {
  for (const std::vector<double>& nm : {EvenlySpaced(400, 700, 20), EvenlySpaced(415, 695, 40)})
    for (const double grey : {1.0, 0.2}) {
      const glm::dvec3 rgb = ColourOfChannels(nm)(Spectrum(static_cast<int>(nm.size()), grey));
      EXPECT_LT(glm::distance(rgb, glm::dvec3(grey)), 1e-6 * grey);
    }
}

TEST(Observer, FewChannelsOrGapsHaveNoColour) {
  EXPECT_FALSE(HaveColour(std::vector{450.0, 540.0, 600.0, 650.0}));
  EXPECT_FALSE(HaveColour(EvenlySpaced(700, 1000, 20))) << "infrared";
  std::vector<double> gap = EvenlySpaced(400, 700, 20);
  std::erase_if(gap, [](double nm) { return nm > 480 && nm < 590; });
  EXPECT_FALSE(HaveColour(gap));
  EXPECT_TRUE(HaveColour(EvenlySpaced(400, 700, 40)));
  const glm::dvec3 grey = ColourTransform()(Spectrum{0.1, 0.2, 0.3, 0.6});
  EXPECT_LT(glm::distance(grey, glm::dvec3(0.3)), 1e-15) << "the mean as grey";
}

/// Values that name their pixel and channel.
Image Numbered(int channels) {
  Image image(4, 3, channels);
  std::iota(image.values.begin(), image.values.end(), 1.0f);
  for (float& v : image.values) v *= 0.01f;
  return image;
}

Photograph ReadWith(const std::filesystem::path& file, const std::vector<std::string>& names) {
  PhotographFiles files;
  files.image = file;
  files.channel_names = names;
  return ReadPhotograph(files);
}

TEST(PhotographOfManyChannels, ExrIsReadByTheNamesOfItsChannels) {
  const TemporaryFolder folder;
  const Image image = Numbered(5);
  const std::vector<std::string> names{"680 nm", "blue", "a", "550", "Z"};
  WriteImageFile(folder.path / "five.exr", image, false, names);
  EXPECT_EQ(ReadWith(folder.path / "five.exr", names).linear.values, image.values);
  const Photograph two = ReadWith(folder.path / "five.exr", {"550", "680 nm"});
  ASSERT_EQ(two.linear.channels, 2);
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) {
      EXPECT_EQ(two.linear.at(x, y, 0), image.at(x, y, 3));
      EXPECT_EQ(two.linear.at(x, y, 1), image.at(x, y, 0));
    }
}

TEST(PhotographOfManyChannels, OneFilePerChannelIsTheSamePhotograph) {
  const TemporaryFolder folder;
  const Image image = Numbered(7);
  PhotographFiles files;
  files.channel_names.clear();
  for (int c = 0; c < 7; ++c) {
    Image plane(4, 3, 1);
    for (size_t p = 0; p < plane.values.size(); ++p) plane.values[p] = image.values[7 * p + c];
    files.channel_names.push_back(std::to_string(400 + 50 * c));
    files.planes.push_back(folder.path / (files.channel_names.back() + ".exr"));
    WriteImageFile(files.planes.back(), plane, false, {"Y"});
  }
  files.image = files.planes[0];
  EXPECT_EQ(ReadPhotograph(files).linear.values, image.values);
}

TEST(PhotographOfManyChannels, OtherChannelsAreRefusedByName) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "rgb.exr", Numbered(3));
  WriteImageFile(folder.path / "grey.exr", Numbered(1), false, {"Y"});
  const auto refusal = [&](const char* file, const std::vector<std::string>& names) {
    return FaultOf([&] { ReadWith(folder.path / file, names); });
  };
  EXPECT_NE(refusal("rgb.exr", {"one"}).find("has 3 channels, but the capture has 1: one"), std::string::npos);
  EXPECT_NE(refusal("grey.exr", {"400", "500"}).find("the capture has 2: 400, 500"), std::string::npos);
  EXPECT_NE(refusal("grey.exr", {"R", "G", "B"}).find("is grey"), std::string::npos);
  EXPECT_EQ(refusal("grey.exr", {"NIR"}), "") << "one channel of any name";
  WriteImageFile(folder.path / "four.exr", Numbered(4), false, {"400", "500", "600", "depth"});
  WriteImageFile(folder.path / "two.exr", Numbered(2), false, {"400", "500"});
  EXPECT_NE(refusal("four.exr", {"400", "500", "600", "700"}).find("has no channel called '700'; it has"),
            std::string::npos);
  EXPECT_NE(refusal("two.exr", {"500", "600"}).find("has no channel called '600'"), std::string::npos)
      << "as many channels, but others";
  EXPECT_NE(refusal("four.exr", {"NIR"}).find("has no channel called 'NIR'"), std::string::npos);
}

}  // namespace
}  // namespace crownfit

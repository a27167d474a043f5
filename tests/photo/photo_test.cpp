#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <lcms2.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "base/error.h"
#include "base/files.h"
#include "photo/image_io.h"
#include "photo/photograph.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

Image Ramp(int width, int height) {
  Image image(width, height, 3);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<float>(i % 251) / 251.0f;
  return image;
}

void WriteAs(const std::filesystem::path& file, const Image& image, OIIO::TypeDesc type) {
  // As the program does: a forked reader would wait for threads that only its parent has.
  // The library that reads pictures starts OpenImageIO's threads first, and waits until they have ended: a child that
  // is forked meanwhile may wait for their lock for ever.
  (void)Resized(Image(2, 2, 1), 1, 1);
  const auto out = OIIO::ImageOutput::create(file.string());
  out->open(file.string(), OIIO::ImageSpec(image.width, image.height, image.channels, type));
  out->write_image(OIIO::TypeDesc::FLOAT, image.values.data());
  out->close();
}

void Truncate(const std::filesystem::path& file) {
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
}

TEST(ImageFiles, ExrAndTiffKeepValuesToTheirPrecision) {
  const TemporaryFolder folder;
  const Image image = Ramp(40, 30);
  struct Case {
    const char* name;
    OIIO::TypeDesc type;
    float tolerance;
  };
  for (const auto& [name, type, tolerance] :
       {Case{"a.exr", OIIO::TypeDesc::FLOAT, 0.0f}, Case{"a.tif", OIIO::TypeDesc::FLOAT, 0.0f},
        Case{"b.tif", OIIO::TypeDesc::UINT16, 0.51f / 65535}, Case{"c.tif", OIIO::TypeDesc::UINT8, 0.51f / 255},
        Case{"a.png", OIIO::TypeDesc::UINT16, 0.51f / 65535}}) {
    WriteAs(folder.path / name, image, type);
    const ImageFile read = ReadImageFile(folder.path / name);
    ASSERT_EQ(read.image.values.size(), image.values.size());
    for (size_t i = 0; i < image.values.size(); ++i)
      ASSERT_NEAR(read.image.values[i], image.values[i], tolerance) << name;
  }
}

TEST(ImageFiles, TruncatedFilesAreRefusedInEveryFormat) {
  const TemporaryFolder folder;
  for (const auto& [name, type] : {std::pair{"a.exr", OIIO::TypeDesc::FLOAT},
                                   {"a.tif", OIIO::TypeDesc::UINT16},
                                   {"b.tif", OIIO::TypeDesc::UINT8},
                                   {"c.tif", OIIO::TypeDesc::FLOAT},
                                   {"a.png", OIIO::TypeDesc::UINT8}}) {
    WriteAs(folder.path / name, Ramp(120, 90), type);
    Truncate(folder.path / name);
    EXPECT_THROW(ReadImageFile(folder.path / name), InputError) << name;
  }
}

TEST(ImageFiles, JpegIsDetectedAndTreatedAsDisplayEncoded) {
  const TemporaryFolder folder;
  WriteAs(folder.path / "a.jpg", Image(16, 16, 3, 128.0f / 255.0f), OIIO::TypeDesc::UINT8);
  const Photograph photo = ReadPhotograph({.image = folder.path / "a.jpg"});
  EXPECT_TRUE(photo.was_jpeg);
  EXPECT_NEAR(photo.linear.at(5, 5, 1), 0.2158605, 1e-2);
  WriteAs(folder.path / "a.png", Image(16, 16, 3, 128.0f / 255.0f), OIIO::TypeDesc::UINT8);
  EXPECT_FALSE(ReadPhotograph({.image = folder.path / "a.png"}).was_jpeg);
}

TEST(ImageFiles, SixteenBitPngIsDecodedUnlessItSaysGammaOne) {
  const TemporaryFolder folder;
  const auto value = [&](const char* name, float gamma) {
    const auto out = OIIO::ImageOutput::create((folder.path / name).string());
    OIIO::ImageSpec spec(4, 4, 3, OIIO::TypeDesc::UINT16);
    spec.attribute("oiio:ColorSpace", gamma == 1 ? "linear" : "GammaCorrected");
    spec.attribute("oiio:Gamma", gamma);
    out->open((folder.path / name).string(), spec);
    out->write_image(OIIO::TypeDesc::FLOAT, Image(4, 4, 3, 0.5f).values.data());
    out->close();
    return ReadPhotograph({.image = folder.path / name}).linear.at(1, 1, 1);
  };
  EXPECT_NEAR(value("linear.png", 1.0f), 0.5, 1e-4);
  EXPECT_NEAR(value("encoded.png", 2.2f), 0.2140, 1e-3);
}

/// A display profile whose curves are value^gamma, as another program would write it.
std::vector<uint8_t> GammaProfile(double gamma, const cmsCIExyYTRIPLE& primaries) {
  const cmsCIExyY d65{0.3127, 0.3290, 1.0};
  cmsToneCurve* curve = cmsBuildGamma(nullptr, gamma);
  cmsToneCurve* const curves[] = {curve, curve, curve};
  const cmsHPROFILE profile = cmsCreateRGBProfile(&d65, &primaries, curves);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::vector<uint8_t> bytes(size);
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  cmsFreeToneCurve(curve);
  return bytes;
}
constexpr cmsCIExyYTRIPLE kSrgb{{0.64, 0.33, 1}, {0.30, 0.60, 1}, {0.15, 0.06, 1}};
constexpr cmsCIExyYTRIPLE kWide{{0.7347, 0.2653, 1}, {0.1596, 0.8404, 1}, {0.0366, 0.0001, 1}};

/// A picture of one value with that profile, if any, and that alpha, if any.
void WriteEven(const std::filesystem::path& file, OIIO::TypeDesc type, const std::vector<float>& pixel,
               const std::vector<uint8_t>& profile = {}) {
  OIIO::ImageSpec spec(8, 8, static_cast<int>(pixel.size()), type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (pixel.size() == 4) spec.alpha_channel = 3;
  if (pixel.size() == 5 && file.extension() == ".exr") {
    spec.channelnames = {"R", "G", "B", "A", "Z"};
    spec.alpha_channel = 3;
  }
  if (!profile.empty())
    spec.attribute("ICCProfile", OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                   profile.data());
  (void)Resized(Image(2, 2, 1), 1, 1);  // as in WriteAs
  std::vector<float> values;
  for (int i = 0; i < 64; ++i) values.insert(values.end(), pixel.begin(), pixel.end());
  const auto out = OIIO::ImageOutput::create(file.string());
  out->open(file.string(), spec);
  out->write_image(OIIO::TypeDesc::FLOAT, values.data());
  out->close();
}

std::string RefusalOf(const PhotographFiles& files) {
  try {
    ReadPhotograph(files);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(Encodings, ToneCurvesOfAProfileAreDecoded) {
  const TemporaryFolder folder;
  for (const char* name : {"p.tif", "p.png"})
    for (const auto type : {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16})
      for (const double gamma : {1.0, 1.8, 2.2}) {
        WriteEven(folder.path / name, type, {0.6f, 0.4f, 0.2f}, GammaProfile(gamma, kSrgb));
        const Photograph photo = ReadPhotograph({.image = folder.path / name});
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(photo.linear.at(3, 3, c), std::pow(0.6 - 0.2 * c, gamma), 1e-4) << gamma;
        EXPECT_FALSE(photo.has_foreign_primaries);
      }
  WriteEven(folder.path / "f.tif", OIIO::TypeDesc::FLOAT, {0.6f, 0.4f, 0.2f}, GammaProfile(1.8, kSrgb));
  EXPECT_NEAR(ReadPhotograph({.image = folder.path / "f.tif"}).linear.at(3, 3, 1), std::pow(0.4, 1.8), 1e-4);
  WriteEven(folder.path / "w.tif", OIIO::TypeDesc::UINT16, {0.5f, 0.5f, 0.5f}, GammaProfile(1.8, kWide));
  EXPECT_TRUE(ReadPhotograph({.image = folder.path / "w.tif"}).has_foreign_primaries);
}

TEST(Encodings, SixteenBitsWithoutAProfileAreAQuestion) {
  const TemporaryFolder folder;
  const auto file = folder.path / "p.tif";
  WriteEven(file, OIIO::TypeDesc::UINT16, {0.5f, 0.5f, 0.5f});
  EXPECT_NE(RefusalOf({.image = file}).find("encoding"), std::string::npos);
  const auto light = [&](const Encoding& encoding) {
    return ReadPhotograph({.image = file, .encoding = encoding}).linear.at(1, 1, 1);
  };
  EXPECT_NEAR(light({Encoding::Kind::kLinear, 1.0}), 0.5, 1e-4);
  EXPECT_NEAR(light({Encoding::Kind::kSrgb, 1.0}), 0.2140, 1e-4);
  EXPECT_NEAR(light({Encoding::Kind::kGamma, 2.2}), std::pow(0.5, 2.2), 1e-4);
  std::vector<uint8_t> damaged = GammaProfile(1.8, kSrgb);
  damaged.resize(200);
  WriteEven(file, OIIO::TypeDesc::UINT16, {0.5f, 0.5f, 0.5f}, damaged);
  EXPECT_NE(RefusalOf({.image = file}).find("ICC profile"), std::string::npos);
}

/// A PNG's chunk (PNG 3, 5.3), with its check sum (annex D).
std::string PngChunk(const std::string& type, const std::string& content) {
  const auto big_endian = [](uint32_t v) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(v >> shift & 255);
    return bytes;
  };
  uint32_t sum = 0xffffffffu;
  for (const char c : type + content) {
    sum ^= static_cast<uint8_t>(c);
    for (int k = 0; k < 8; ++k) sum = sum & 1 ? 0xedb88320u ^ sum >> 1 : sum >> 1;
  }
  return big_endian(static_cast<uint32_t>(content.size())) + type + content + big_endian(~sum);
}

TEST(Encodings, PngChunksAreFoundBehindLongTextsAndRefusedWhereUndecoded) {
  const TemporaryFolder folder;
  const auto plain = folder.path / "p.png", file = folder.path / "q.png";
  WriteEven(plain, OIIO::TypeDesc::UINT8, {0.6f, 0.4f, 0.2f});
  std::ifstream stream(plain, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  const size_t pixels = bytes.find("IDAT") - 4;
  const auto write = [&](const std::string& chunks) {  // in place of what the writer stated
    std::ofstream(file, std::ios::binary) << bytes.substr(0, 33) + chunks + bytes.substr(pixels);
  };
  const std::string text = PngChunk("tEXt", "XML" + std::string(1, '\0') + std::string(2 << 20, 'a'));
  write(text + PngChunk("gAMA", std::string("\0\1\x86\xa0", 4)));
  EXPECT_NEAR(ReadPhotograph({.image = file}).linear.at(1, 1, 0), 0.6, 1e-3);
  write(text + PngChunk("cICP", std::string("\x09\x10\0\1", 4)));
  EXPECT_NE(RefusalOf({.image = file}).find("cICP"), std::string::npos);
  write(PngChunk("cICP", std::string("\1\x0d\0\0", 4)));
  EXPECT_NE(RefusalOf({.image = file}).find("narrow range"), std::string::npos);
  write(PngChunk("iCCP", std::string("p\0\0garbage", 10)));
  EXPECT_NE(RefusalOf({.image = file}).find("ICC profile"), std::string::npos);
}

TEST(Encodings, RadianceFilesAreDividedByExposureAndColourCorrection) {
  const TemporaryFolder folder;
  const auto file = folder.path / "p.hdr";
  const auto write = [&](const std::string& lines, const std::string& rows) {
    std::ofstream stream(file, std::ios::binary);
    stream << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" << lines << "\n" << rows << "\n";
    for (int i = 0; i < 16; ++i) stream << "\x80\x80\x80\x80";  // 0.5
  };
  write("EXPOSURE=2\nCOLORCORR= 2 1 0.5\nEXPOSURE=0.5\n", "-Y 4 +X 4");
  const Photograph photo = ReadPhotograph({.image = file});
  EXPECT_NEAR(photo.linear.at(1, 1, 0), 0.25, 1e-2);
  EXPECT_NEAR(photo.linear.at(1, 1, 1), 0.5, 1e-2);
  EXPECT_NEAR(photo.linear.at(1, 1, 2), 1.0, 2e-2);
  write("", "+Y 4 +X 4");
  EXPECT_NE(RefusalOf({.image = file}).find("+Y +X"), std::string::npos);
  write("EXPOSURE=0\n", "-Y 4 +X 4");
  EXPECT_NE(RefusalOf({.image = file}).find("EXPOSURE"), std::string::npos);
}

TEST(Photographs, AlphaCountsBesideOtherLayersAndFurtherBandsAreRefused) {
  const TemporaryFolder folder;
  WriteEven(folder.path / "p.exr", OIIO::TypeDesc::FLOAT, {0.6f, 0.4f, 0.2f, 0.25f, 9.0f});
  const Photograph photo = ReadPhotograph({.image = folder.path / "p.exr"});
  EXPECT_EQ(photo.transparent_pixels, 64);
  for (const std::vector<float>& bands : {std::vector<float>(5, 0.5f), std::vector<float>(6, 0.5f)}) {
    WriteEven(folder.path / "p.tif", OIIO::TypeDesc::FLOAT, bands);
    EXPECT_NE(RefusalOf({.image = folder.path / "p.tif"}).find("channels"), std::string::npos);
  }
}

TEST(Photographs, AlphaOfAnotherLayerIsNotThePhotographs) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "p.exr", Image(8, 8, 7, 0.5f), false,
                 {"R", "G", "B", "left.R", "left.G", "left.B", "left.A"});
  EXPECT_EQ(ReadPhotograph({.image = folder.path / "p.exr"}).transparent_pixels, 0);
}

TEST(Photographs, PreviewsAreNotTakenInPlaceOfARaw) {
  const TemporaryFolder folder;
  WriteEven(folder.path / "p.tif", OIIO::TypeDesc::UINT8, {0.5f, 0.4f, 0.3f});
  for (const char* name : {"p.dng", "p.NEF", "p.3fr", "p.iiq"}) {
    std::filesystem::copy_file(folder.path / "p.tif", folder.path / name);
    EXPECT_NE(RefusalOf({.image = folder.path / name}).find("preview"), std::string::npos) << name;
  }
}

TEST(Photographs, TiffsOfFewBitsAreReadRightOrRefused) {
  const TemporaryFolder folder;
  for (const char* compression : {"none", "lzw"}) {
    OIIO::ImageSpec spec(64, 8, 1, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:BitsPerSample", 1);
    spec.attribute("compression", compression);
    std::vector<float> stripe;
    for (int i = 0; i < 64 * 8; ++i) stripe.push_back(i % 64 < 24 ? 1.0f : 0.0f);
    const auto file = folder.path / "m.tif";
    const auto out = OIIO::ImageOutput::create(file.string());
    out->open(file.string(), spec);
    out->write_image(OIIO::TypeDesc::FLOAT, stripe.data());
    out->close();
    try {
      EXPECT_EQ(ReadImageFile(file).image.values, stripe) << compression;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("fewer than 8 bits"), std::string::npos) << e.what();
    }
  }
}

TEST(Photographs, MasksWithTransparencyAreRefused) {
  const TemporaryFolder folder;
  WriteEven(folder.path / "p.exr", OIIO::TypeDesc::FLOAT, {0.5f, 0.5f, 0.5f});
  const PhotographFiles files{.image = folder.path / "p.exr", .mask = folder.path / "m.png"};
  WriteEven(*files.mask, OIIO::TypeDesc::UINT8, {1.0f, 1.0f, 1.0f, 0.0f});
  EXPECT_NE(RefusalOf(files).find("transparent"), std::string::npos);
  WriteEven(*files.mask, OIIO::TypeDesc::UINT8, {1.0f, 1.0f, 1.0f, 1.0f});
  EXPECT_EQ(RefusalOf(files), "");
}

TEST(Photographs, AlphaMultipliesNothingAndMakesPixelsUnusable) {
  const TemporaryFolder folder;
  for (const char* name : {"a.tif", "a.png"})
    for (const float alpha : {1.0f, 0.5f, 0.0f}) {
      WriteEven(folder.path / name, OIIO::TypeDesc::UINT16, {0.6f, 0.4f, 0.2f, alpha}, GammaProfile(1.0, kSrgb));
      const Photograph photo = ReadPhotograph({.image = folder.path / name});
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(photo.linear.at(3, 3, c), 0.6 - 0.2 * c, 1e-4) << name << " " << alpha;
      EXPECT_EQ(photo.usable[0], alpha == 1.0f);
      EXPECT_EQ(photo.transparent_pixels, alpha == 1.0f ? 0 : 64);
    }
}

TEST(Photographs, GreyPicturesAreRefused) {
  const TemporaryFolder folder;
  WriteEven(folder.path / "g.png", OIIO::TypeDesc::UINT8, {0.5f});
  EXPECT_NE(RefusalOf({.image = folder.path / "g.png"}).find("grey"), std::string::npos);
}

TEST(ImageFiles, NonFiniteValuesAreRefused) {
  const TemporaryFolder folder;
  Image image = Ramp(8, 8);
  image.values[17] = std::nanf("");
  WriteImageFile(folder.path / "nan.exr", image);
  EXPECT_THROW(ReadImageFile(folder.path / "nan.exr"), InputError);
}

TEST(ImageFiles, OnePixelImageIsReadAndInterpolated) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "one.exr", Image(1, 1, 3, 0.25f));
  const Image one = ReadImageFile(folder.path / "one.exr").image;
  for (double x : {-1e9, 0.0, 0.5, 7.0}) EXPECT_EQ(Bilinear(one, {x, -x}, 2), 0.25);
}

TEST(ImageFiles, MultilayerExrUsesFirstThreeChannelsIfTheyAreRgb) {
  const TemporaryFolder folder;
  WriteImageLayers(folder.path / "layers.exr", {{"", Image(2, 2, 3, 0.5f)}, {"variance", Image(2, 2, 3, 9.0f)}});
  const Image read = ReadImageFile(folder.path / "layers.exr").image;
  ASSERT_EQ(read.channels, 3);
  EXPECT_EQ(*std::max_element(read.values.begin(), read.values.end()), 0.5f);
  WriteImageLayers(folder.path / "named.exr", {{"left", Image(2, 2, 3, 0.5f)}});
  EXPECT_THROW(ReadImageFile(folder.path / "named.exr"), InputError);
}

TEST(ImageFiles, WritingIsDeterministic) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "a.exr", Ramp(8, 8));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  WriteImageFile(folder.path / "b.exr", Ramp(8, 8));
  EXPECT_EQ(Sha256OfFile(folder.path / "a.exr"), Sha256OfFile(folder.path / "b.exr"));
}

TEST(Photographs, SrgbDecodingInvertsEncodingAndOnlyEncodedFilesAreDecoded) {
  for (double v : {0.0, 0.002, 0.0031308, 0.18, 0.5, 1.0}) EXPECT_NEAR(LinearFromSrgb(SrgbFromLinear(v)), v, 1e-7);
  const TemporaryFolder folder;
  WriteAs(folder.path / "grey.png", Image(4, 4, 3, 128.0f / 255.0f), OIIO::TypeDesc::UINT8);
  WriteAs(folder.path / "grey.exr", Image(4, 4, 3, 128.0f / 255.0f), OIIO::TypeDesc::FLOAT);
  const auto value = [&](const char* name) { return ReadPhotograph({.image = folder.path / name}).linear.at(1, 1, 1); };
  EXPECT_NEAR(value("grey.png"), 0.2158605, 1e-6);  // IEC 61966-2-1 of 128 / 255
  EXPECT_NEAR(value("grey.exr"), 128.0 / 255.0, 1e-6);
}

TEST(Photographs, MaskAndSaturationDecideWhatIsUsable) {
  const TemporaryFolder folder;
  Image image(4, 1, 3, 0.5f), mask(4, 1, 3, 1.0f);
  image.at(1, 0, 2) = 1.2f;
  mask.at(2, 0, 0) = mask.at(2, 0, 1) = mask.at(2, 0, 2) = 0.4f;
  WriteImageFile(folder.path / "p.exr", image);
  WriteImageFile(folder.path / "m.png", mask);
  PhotographFiles files{.image = folder.path / "p.exr", .mask = folder.path / "m.png"};
  EXPECT_EQ(ReadPhotograph(files).usable, (std::vector<uint8_t>{1, 1, 0, 1}));  // float files state no saturation level
  files.saturation = 1.0;
  const Photograph photo = ReadPhotograph(files);
  EXPECT_EQ(photo.usable, (std::vector<uint8_t>{1, 0, 0, 1}));
  EXPECT_EQ(photo.saturated_pixels, 1);
}

TEST(Photographs, AMaskOfZerosAndOnesInBytesIsRefusedAndToldWhatWhiteIs) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "p.exr", Image(4, 2, 3, 0.5f));
  const auto refusal = [&](const char* name, float white, OIIO::TypeDesc type) -> std::string {
    Image mask(4, 2, 3, 0.0f);
    for (int c = 0; c < 3; ++c) mask.at(1, 1, c) = white;
    WriteAs(folder.path / name, mask, type);
    try {
      const Photograph photo = ReadPhotograph({.image = folder.path / "p.exr", .mask = folder.path / name});
      EXPECT_EQ(photo.usable, (std::vector<uint8_t>{0, 0, 0, 0, 0, white > 0, 0, 0}));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string bytes = refusal("m.png", 1.0f / 255, OIIO::TypeDesc::UINT8);
  EXPECT_NE(bytes.find("m.png: chooses no pixel: its largest value is 1, and white is 255"), std::string::npos)
      << bytes;
  EXPECT_NE(refusal("n.png", 1.0f / 65535, OIIO::TypeDesc::UINT16).find("white is 65535"), std::string::npos);
  EXPECT_EQ(refusal("o.png", 1.0f, OIIO::TypeDesc::UINT8), "");
  EXPECT_EQ(refusal("q.png", 0.0f, OIIO::TypeDesc::UINT8), "") << "black all over: nothing says that white was meant";
}

TEST(Photographs, SaturationInCountsIsRefusedWhereValuesAreShares) {
  const TemporaryFolder folder;
  WriteAs(folder.path / "p.png", Image(2, 2, 3, 0.5f), OIIO::TypeDesc::UINT16);
  WriteAs(folder.path / "p.exr", Image(2, 2, 3, 5000.0f), OIIO::TypeDesc::FLOAT);
  WriteTextFile(folder.path / "noise.json",
                "{\"format\": \"crownfit-noise/1\", \"gain\": 1e-4, \"read_noise\": 1e-3, \"saturation\": 4095}");
  const auto refusal = [&](const PhotographFiles& files) -> std::string {
    try {
      ReadPhotograph(files);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const SensorNoise noise = ReadSensorNoise(folder.path / "noise.json");
  for (const std::string& said :
       {refusal({.image = folder.path / "p.png", .noise = noise}),
        refusal({.image = folder.path / "p.png", .saturation = 4095, .saturation_key = "photographs[0].saturation"})}) {
    EXPECT_NE(said.find("saturation: is 4095"), std::string::npos) << said;
    EXPECT_NE(said.find("p.png are shares of full scale"), std::string::npos) << said;
    EXPECT_NE(said.find("65535"), std::string::npos) << said;  // full scale of 16 bits
  }
  EXPECT_EQ(refusal({.image = folder.path / "p.png", .saturation = 1.0}), "");
  EXPECT_EQ(refusal({.image = folder.path / "p.exr", .noise = noise}), "");
  EXPECT_EQ(ReadPhotograph({.image = folder.path / "p.exr", .noise = noise}).saturated_pixels, 4);
}

TEST(Photographs, NoiseFileGivesGainTimesSignalPlusReadNoiseSquared) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "p.exr", Image(2, 2, 3, 0.6f));
  WriteTextFile(
      folder.path / "noise.json",
      "{\"format\": \"crownfit-noise/1\", \"gain\": [1e-4, 2e-4, 3e-4], \"read_noise\": 1e-3, \"black\": 0.1}");
  PhotographFiles files{.image = folder.path / "p.exr"};
  files.noise = ReadSensorNoise(folder.path / "noise.json");
  const Photograph photo = ReadPhotograph(files);
  EXPECT_NEAR(photo.linear.at(0, 0, 1), 0.5, 1e-6);  // black level removed
  EXPECT_NEAR(photo.variance.at(0, 0, 1), 2e-4 * 0.5 + 1e-6, 1e-9);
}

TEST(Photographs, SamplesOfATiffAreTheChannelsInTheirOrder) {
  const TemporaryFolder folder;
  for (const int channels : {1, 2, 4, 5, 16}) {
    Image image(6, 5, channels);
    for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = static_cast<float>(i + 1) / 1024.0f;
    std::vector<std::string> names;
    for (int c = 0; c < channels; ++c) names.push_back(std::to_string(400 + 20 * c));
    PhotographFiles files{.image = folder.path / (std::to_string(channels) + ".tif"), .channel_names = names};
    WriteAs(files.image, image, OIIO::TypeDesc::FLOAT);
    const Photograph photo = ReadPhotograph(files);
    EXPECT_EQ(photo.linear.channels, channels);
    EXPECT_EQ(photo.linear.values, image.values) << channels;
    EXPECT_EQ(photo.usable, std::vector<uint8_t>(30, 1)) << channels << ": a second or fourth sample is no alpha";
  }
}

TEST(Photographs, WithoutANoiseFileTheErrorIsOnePerCentAndAFloor) {
  const TemporaryFolder folder;
  WriteImageFile(folder.path / "p.exr", Image(2, 2, 3, 0.6f));
  EXPECT_NEAR(ReadPhotograph({.image = folder.path / "p.exr"}).variance.at(0, 0, 0), 0.006 * 0.006 + 0.0005 * 0.0005,
              1e-8);
}

TEST(Photographs, AveragingKeepsLightAndReducesOnlyIndependentNoise) {
  Photograph photo;
  photo.linear = Ramp(7, 5);
  photo.variance = Image(7, 5, 3, 0.09f);
  photo.usable.assign(35, 1);
  photo.usable[3 * 7 + 4] = 0;
  const Photograph measured = Averaged(photo, 2, true), assumed = Averaged(photo, 2, false);
  ASSERT_EQ(measured.linear.width, 3);
  ASSERT_EQ(measured.linear.height, 2);
  double of_squares = 0, of_pixels = 0;
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 3; ++x) of_squares += 4.0 * measured.linear.at(x, y, 1);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) of_pixels += photo.linear.at(x, y, 1);
  EXPECT_NEAR(of_squares, of_pixels, 1e-5);
  EXPECT_NEAR(measured.variance.at(1, 1, 2), 0.09 / 4, 1e-6);
  EXPECT_NEAR(assumed.variance.at(1, 1, 2), 0.09, 1e-6);
  EXPECT_EQ(measured.usable, (std::vector<uint8_t>{1, 1, 1, 1, 1, 0})) << "one pixel of the last square is not usable";

  const Photograph of_usable = Averaged(photo, 2, true, 0.5);
  EXPECT_EQ(of_usable.usable, std::vector<uint8_t>(6, 1));
  EXPECT_NEAR(of_usable.linear.at(2, 1, 0),
              (photo.linear.at(5, 2, 0) + photo.linear.at(4, 2, 0) + photo.linear.at(5, 3, 0)) / 3, 1e-6);
  EXPECT_NEAR(of_usable.variance.at(2, 1, 0), 0.09 / 3, 1e-6);
}

TEST(Photographs, TextStandsOnItsBaseline) {
  Image image(60, 40, 3);
  DrawText(image, 10, 30, 20, "H", 1.0f);
  int ink = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) {
      if (image.at(x, y, 1) < 0.5f) continue;
      ++ink;
      EXPECT_TRUE(x >= 10 && x <= 30 && y >= 12 && y <= 30) << x << ", " << y;
    }
  EXPECT_GT(ink, 40) << "two strokes as high as a capital";
}

}  // namespace
}  // namespace crownfit

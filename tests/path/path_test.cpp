// Path-traced images do not depend on tessellation, units, threads or lanes, nor on how a path is traced. They state
// their own errors.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "path/flight_lanes.h"
#include "path/path_options.h"
#include "scene/crown_source.h"
#include "support/shapes.h"
#include "support/walked.h"

namespace crownfit {
namespace {

/// A grey sphere with a core under a lamp and a dome: something to compare with itself.
KnownScene Bead(double scale = 1.0, int rings = 24) {
  KnownScene scene(Sphere(1.5 * scale, rings), 2, 0.4 * scale, 6, 4.0);
  SetLayer(scene, 0, 1.62, 0.6, 1.0 / scale, 0.05 / scale);
  SetLayer(scene, 1, 1.54, 0.8, 3.0 / scale, 0.2 / scale);
  SetSurface(scene, 0.3, 0.0);
  scene.Light(DiskLight{{200, 0, 200}, {-1, 0, -1}, glm::dvec3(2.0), 0.0, 90.0});
  scene.Light(DomeLight{glm::dvec3(0.1)});
  return scene;
}

TEST(Path, FinerTrianglesOfTheSameSurfaceChangeNothing) {
  KnownScene coarse = Bead(), fine = Bead();
  // Both cores come from the same field; only the tessellation differs.
  fine.source.meshes[0] = Refined(*coarse.source.meshes[0], 0.1);
  fine.source.fields = coarse.source.fields;
  const Mean a = RenderedMean(coarse, 4000, 1), b = RenderedMean(fine, 4000, 2);
  EXPECT_NEAR(a.value(), b.value(), 4 * std::hypot(a.stated, b.stated));
}

TEST(Path, UnitsOfLengthDoNotMatter) {
  KnownScene small = Bead(), large = Bead(1000.0);
  large.capture.photographs[0].camera_from_object.translation_mm *= 1000.0;
  large.capture.lights[0].shape =
      DiskLight{{2e5, 0, 2e5}, glm::normalize(glm::dvec3(-1, 0, -1)), glm::dvec3(2.0), 0.0, 9e4};
  const Mean a = RenderedMean(small, 4000, 1), b = RenderedMean(large, 4000, 2);
  EXPECT_NEAR(a.value(), b.value(), 4 * std::hypot(a.stated, b.stated));
}

/// A channel's mean over the picture, and the variance of that mean.
std::array<double, 2> MeanOfChannel(const PathPhotograph& photo, int channel) {
  double mean = 0, variance = 0;
  const double n = static_cast<double>(photo.pixels.size());
  for (const PixelEstimate& p : photo.pixels) mean += p.mean[channel] / n, variance += p.variance()[channel] / (n * n);
  return {mean, variance};
}

TEST(Path, EachOfManyChannelsIsRenderedAsIfItWereAlone) {
  const std::vector<double> scattering{0.3, 0.5, 1.0, 1.8, 3.0}, absorption{0.3, 0.02, 0.1, 0.01, 0.05};
  const auto of_channels = [](const std::vector<double>& of_outer, const std::vector<double>& of_absorption) {
    KnownScene scene = Bead();
    Capture& capture = scene.capture;
    const int channels = static_cast<int>(of_outer.size());
    capture.channel_names.clear();
    for (int c = 0; c < channels; ++c) capture.channel_names.push_back(std::to_string(c));
    capture.wavelengths_nm.assign(of_outer.size(), 540.0);
    std::get<DiskLight>(capture.lights[0].shape).radiance = Spectrum(2.0);
    std::get<DomeLight>(capture.lights[1].shape).radiance = Spectrum(0.1);
    for (LayerSpec& layer : capture.layers)
      for (ParameterSpec& spec : layer.parameters) spec.value = Spectrum(channels, spec.value[0]);
    for (ParameterSpec& spec : capture.surface) spec.value = Spectrum(channels, spec.value[0]);
    capture.layers[0][Quantity::kReducedScattering].value = Spectrum(of_outer);
    capture.layers[0][Quantity::kAbsorption].value = Spectrum(of_absorption);
    return RenderByPaths(capture, BodyOf(scene), {}, StatedMaterial(capture), 0, {4000, 1, 0, 0}, [](double) {});
  };
  const PathPhotograph together = of_channels(scattering, absorption);
  for (size_t c = 0; c < scattering.size(); ++c) {
    const auto [mean, variance] = MeanOfChannel(together, static_cast<int>(c));
    const auto [alone, of_alone] = MeanOfChannel(of_channels({scattering[c]}, {absorption[c]}), 0);
    EXPECT_NEAR(mean, alone, 4 * std::sqrt(variance + of_alone)) << "channel " << c;
    EXPECT_LT(std::sqrt(variance), 0.02 * mean) << "tenfold scattering keeps the weights bounded";
  }
}

TEST(Path, SamePictureForAnyNumberOfThreads) {
  const KnownScene scene = Bead();
  const LayeredBody body = BodyOf(scene);
  std::vector<PathPhotograph> photos;
  for (const int threads : {1, 3})
    photos.push_back(
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {20, 1, 0, threads}, [](double) {}));
  for (size_t p = 0; p < photos[0].pixels.size(); ++p) {
    EXPECT_EQ(photos[0].pixels[p].mean, photos[1].pixels[p].mean);
    EXPECT_EQ(photos[0].pixels[p].covariance, photos[1].pixels[p].covariance);
  }
}

TEST(Path, SamePictureForAnyNumberOfLanes) {
  // Three heroes, a texture-free outer layer, a rough boundary: every kind of event.
  KnownScene scene(Incisor(), 2, 0.9, 10, 6.0);
  scene.capture.layers[1][Quantity::kReducedScattering].value = {2.5, 2.0, 1.5};
  scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 65.0});
  const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0);
  PathOptions options{.paths_per_pixel = 12};
  const auto render = [&](int lanes) {
    options.lanes = lanes;
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  };
  const PathPhotograph reference = render(64);
  for (const int lanes : {1, 3, 17, 128}) {
    const PathPhotograph other = render(lanes);
    EXPECT_EQ(other.counters.flights, reference.counters.flights);
    for (size_t i = 0; i < other.pixels.size(); ++i) {
      EXPECT_EQ(other.pixels[i].mean, reference.pixels[i].mean) << lanes << " lanes, pixel " << i;
      EXPECT_EQ(other.pixels[i].covariance, reference.pixels[i].covariance) << lanes << " lanes, pixel " << i;
    }
  }
}

TEST(Path, TracingAndLightSamplingMethodsAgree) {
  // Facets in double precision by the grid, against rays in single precision. Lamps hit by chance, against both methods
  // combined.
  for (const double roughness : {0.0, 0.3}) {
    KnownScene scene(Incisor(50), 2, 0.9, 8, 12.0);
    scene.capture.layers[1][Quantity::kReducedScattering].value = {2.5, 2.0, 1.5};
    SetSurface(scene, roughness, 0.0);
    scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 90.0});
    const LayeredBody body = BodyOf(scene);
    const auto render = [&](uint64_t seed, int lanes, bool lamps_are_sampled) {
      PathOptions options{.paths_per_pixel = 1500, .seed = seed};
      options.lanes = lanes;
      options.lamps_are_sampled = lamps_are_sampled;
      return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
    };
    const PathPhotograph a = render(1, 64, true), b = render(2, 0, true), c = render(3, 64, false);
    for (const PathPhotograph* other : {&b, &c}) {
      double difference = 0, variance = 0, sum = 0;
      for (size_t p = 0; p < a.pixels.size(); ++p) {
        difference += other->pixels[p].mean[1] - a.pixels[p].mean[1];
        sum += a.pixels[p].mean[1];
        variance += other->pixels[p].variance()[1] + a.pixels[p].variance()[1];
      }
      EXPECT_LT(std::abs(difference), 3.5 * std::sqrt(variance)) << roughness << (other == &b ? " rays" : " chance");
      EXPECT_LT(std::sqrt(variance), 0.03 * sum);
    }
  }
}

/// Four photographs by one camera: lit from the front over a black and over a white tile in the same place, with a
/// sheet before half of the object, and from behind.
KnownScene FourPhotographs(double roughness) {
  KnownScene scene = Bead();
  SetSurface(scene, roughness, 0.0);
  scene.Light(DiskLight{{0, 0, -150}, {0, 0, 1}, glm::dvec3(8.0), 0.0, 55.0});
  Capture& capture = scene.capture;
  for (const double rho : {0.03, 0.9})
    capture.backings.push_back(
        {.name = "tile", .point_mm = {0, 0, -1.8}, .normal = {0, 0, 1}, .size_mm = 20, .reflectance = glm::dvec3(rho)});
  ScenerySpec sheet;
  sheet.reflectance = glm::dvec3(0.02);
  capture.scenery.push_back(sheet);
  scene.scenery.push_back(SquareTile({10.2, 0, 1.8}, {0, 0, 1}, 20.0));
  capture.photographs.resize(4, capture.photographs[0]);
  for (size_t i = 0; i < 4; ++i)
    capture.photographs[i].lights = i == 3 ? std::vector<size_t>{2} : std::vector<size_t>{0, 1};
  capture.photographs[0].backing = 0;
  capture.photographs[1].backing = 1;
  capture.photographs[2].scenery = {0};
  capture.photographs[1].polarisation = Polarisation::kCross;
  return scene;
}

TEST(Path, SharedPathsAgreeWithSeparatePaths) {
  for (const double roughness : {0.0, 0.3}) {
    const KnownScene scene = FourPhotographs(roughness);
    const LayeredBody body = BodyOf(scene);
    PathOptions options{.paths_per_pixel = 10000};
    options.derivatives = true;
    const std::vector<PathPhotograph> together = RenderTogether(
        scene.capture, body, scene.scenery, StatedMaterial(scene.capture), {0, 1, 2, 3}, options, [](double) {});
    options.seed = 2;
    for (size_t i = 0; i < together.size(); ++i) {
      const PathPhotograph alone =
          RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), i, options, [](double) {});
      double square = 0;
      int values = 0;
      Mean slope;
      for (size_t p = 0; p < alone.pixels.size(); ++p) {
        const PixelEstimate &a = together[i].pixels[p], &b = alone.pixels[p];
        EXPECT_EQ(a.on_object, b.on_object);
        if (!(std::sqrt(b.variance()[1]) < 0.2 * b.mean[1])) continue;  // a few bright paths give no reliable error
        square += (a.mean[1] - b.mean[1]) * (a.mean[1] - b.mean[1]) / (a.variance()[1] + b.variance()[1]);
        ++values;
        for (size_t g = 0; g < alone.groups; ++g) {
          const size_t k = 2 * (p * alone.groups + g);
          slope.Add(together[i].derivatives.absorption.at(k, 1) - alone.derivatives.absorption.at(k, 1));
        }
      }
      EXPECT_GT(values, 12);
      EXPECT_LT(square / values, 1.0 + 4.0 * std::sqrt(2.0 / values)) << "photograph " << i << ", " << roughness;
      EXPECT_LT(std::abs(slope.value()), 4 * slope.error()) << "photograph " << i << ", " << roughness;
    }
  }
}

/// Level of the whole image without filters, through crossed and through parallel ones.
std::array<double, 3> LevelsByFilter(KnownScene scene, double memory_events) {
  Capture& capture = scene.capture;
  capture.photographs.resize(3, capture.photographs[0]);
  for (PhotographSpec& photo : capture.photographs) photo.polarisation_memory_events = memory_events;
  capture.photographs[1].polarisation = Polarisation::kCross;
  capture.photographs[2].polarisation = Polarisation::kParallel;
  std::array<double, 3> levels{};
  const std::vector<PathPhotograph> together =
      RenderTogether(capture, BodyOf(scene), scene.scenery, StatedMaterial(capture), {0, 1, 2},
                     PathOptions{.paths_per_pixel = 1000}, [](double) {});
  for (size_t i = 0; i < 3; ++i)
    for (const PixelEstimate& p : together[i].pixels) levels[i] += p.mean[1];
  return levels;
}

TEST(Path, SingleScatteringKeepsTheStatedPolarisation) {
  KnownScene dark(Sphere(1.5, 24), 1, 0.4, 6, 4.0);  // no index step; nearly all returning light was scattered once
  SetLayer(dark, 0, 1.0, 0.0, 0.02, 5.0);
  SetSurface(dark, 0.3, 0.0);
  dark.Light(DiskLight{{200, 0, 200}, {-1, 0, -1}, glm::dvec3(2.0), 0.0, 90.0});
  const auto [none, cross, parallel] = LevelsByFilter(dark, 2.0);
  EXPECT_NEAR(cross / none, 1.0 - std::exp(-0.5), 0.005);
  EXPECT_NEAR(parallel / none, 1.0 + std::exp(-0.5), 0.005);
  const auto [without, crossed, doubled] = LevelsByFilter(dark, 0.0);
  EXPECT_EQ(without, none);
  EXPECT_EQ(crossed, none);
  EXPECT_EQ(doubled, none);
}

TEST(Path, PolarisersSeparatePolarisedFromDepolarisedLight) {
  constexpr double kForEver = 1e6;
  KnownScene bead = Bead();
  for (const double memory : {3.0, kForEver}) {
    const auto [none, cross, parallel] = LevelsByFilter(bead, memory);
    EXPECT_NEAR(0.5 * (cross + parallel), none, 1e-9 * none);
    EXPECT_LT(cross, (memory == kForEver ? 1e-3 : 1.0) * none);  // layers alone do not depolarise
  }
  bead.capture.backings.push_back(
      {.name = "tile", .point_mm = {0, 0, -1.8}, .normal = {0, 0, 1}, .size_mm = 20, .reflectance = glm::dvec3(0.9)});
  bead.capture.photographs[0].backing = 0;
  const auto [none, cross, parallel] = LevelsByFilter(bead, kForEver);
  EXPECT_GT(cross, 0.03 * none);  // light reflected by the tile
  EXPECT_NEAR(0.5 * (cross + parallel), none, 1e-9 * none);
}

TEST(Path, IdenticalPhotographsWithSharedPathsAreEqual) {
  KnownScene scene = FourPhotographs(0.3);
  scene.capture.photographs[3] = scene.capture.photographs[1];
  PathOptions options{.paths_per_pixel = 30};
  const std::vector<PathPhotograph> together = RenderTogether(
      scene.capture, BodyOf(scene), scene.scenery, StatedMaterial(scene.capture), {0, 1, 2, 3}, options, [](double) {});
  for (size_t p = 0; p < together[1].pixels.size(); ++p)
    EXPECT_EQ(together[1].pixels[p].mean, together[3].pixels[p].mean);
}

TEST(TriangleGrid, AgreesWithExhaustiveSearch) {
  // Flights from anywhere inside, in every medium, through nested layers and through a protruding root (exposed
  // facets). The reference is a search over all triangles (Moeller and Trumbore 1997). Flights that pass within
  // rounding of an edge are excluded.
  TriangleMesh root = Sphere(1.2, 20);
  for (auto& v : root.vertices) v.z -= 0.9;
  KnownScene nested(Incisor(30), 2, 0.9, 4, 4.0);
  const LayeredBody bodies[] = {BodyOf(nested), LayeredBody({Sphere(1.5, 20), root}, 0)};
  for (const LayeredBody& body : bodies) {
    int found = 0, compared = 0;
    for (uint64_t i = 0; i < 4000; ++i) {
      RandomStream random(Key(31, i));
      FacetFlight flight;
      flight.origin = body.low + glm::dvec3(random.Next(), random.Next(), random.Next()) * (body.high - body.low);
      flight.direction = Towards(std::acos(1.0 - 2.0 * random.Next()), 2.0 * std::numbers::pi * random.Next());
      flight.medium = 1 + static_cast<int>(i % 2);
      flight.max_mm = i % 5 == 0 ? kFar : 3.0 * random.Next() * random.Next();
      double nearest = kFar;
      bool is_doubtful = false;
      for (size_t m = 0; m < body.surfaces.size(); ++m)
        for (size_t t = 0; t < body.surfaces[m].triangles.size(); ++t) {
          const TriangleMesh& mesh = body.surfaces[m];
          const glm::ivec3 k = mesh.triangles[t];
          const glm::dvec3 &a = mesh.vertices[k.x], u = mesh.vertices[k.y] - a, v = mesh.vertices[k.z] - a,
                           normal = glm::cross(u, v), from = flight.origin - a;
          const double along = glm::dot(normal, flight.direction);
          const int inside = static_cast<int>(m) + 1;
          const bool exposed = !body.is_exposed[m].empty() && body.is_exposed[m][t];
          if (along > 0 ? flight.medium != inside
                        : flight.medium >= inside || (!exposed && flight.medium != inside - 1))
            continue;
          const double distance = -glm::dot(normal, from) / along;
          if (distance < 0 || distance > flight.max_mm || distance > nearest + 1e-9) continue;
          const glm::dvec3 at = from + distance * flight.direction;
          const double area = glm::dot(normal, normal), p = glm::dot(glm::cross(at, v), normal) / area,
                       q = glm::dot(glm::cross(u, at), normal) / area, least = std::min({p, q, 1.0 - p - q});
          if (std::abs(least) < 1e-9) is_doubtful = true;
          if (least > 0) nearest = std::min(nearest, distance);
        }
      if (is_doubtful) continue;
      body.grid.FindEnds({&flight, 1});
      ++compared;
      found += flight.is_ended();
      ASSERT_EQ(flight.is_ended(), std::isfinite(nearest)) << i;
      if (!flight.is_ended()) continue;
      ASSERT_NEAR(flight.distance_mm, nearest, 1e-9 * (1 + nearest)) << i;
    }
    EXPECT_GT(compared, 3900);
    EXPECT_GT(found, 500);
  }
}

TEST(FlightLanes, AgreeWithScalarSamplingAndScattering) {
  // No surface is near. Flights and directions are compared with the scalar functions.
  TriangleMesh mesh = Incisor();
  for (glm::dvec3& v : mesh.vertices) v *= 1e4;
  const LayeredBody body({mesh}, 0);
  FlightLanes lanes{};
  constexpr int kCount = 37;
  std::vector<RandomStream> streams;
  std::vector<Medium> media;
  std::vector<glm::dvec3> directions;
  for (int i = 0; i < kCount; ++i) {
    Medium medium;
    medium.g = i % 3 == 0 ? 0.0 : 0.027 * i - 0.1;
    medium.isotropic_fraction = i % 2 ? 0.3 : 0.0;
    media.push_back(medium);
    streams.emplace_back(Key(5, i));
    directions.push_back(glm::normalize(glm::dvec3(i - 18, 3, 9 - i)));
    lanes.dx[i] = directions[i].x, lanes.dy[i] = directions[i].y, lanes.dz[i] = directions[i].z;
    lanes.random[i] = streams[i].state();
    lanes.random_step[i] = streams[i].step();
    lanes.free_path_mm[i] = 0.5;
    lanes.g[i] = medium.g;
    lanes.isotropic_fraction[i] = medium.isotropic_fraction;
  }
  std::vector<double> length(kCount, 0.0);
  for (int step = 0; step < 200; ++step) {
    lanes.Fly(body.grid, kCount);
    lanes.Scatter(kCount);
    for (int i = 0; i < kCount; ++i) {
      ASSERT_EQ(lanes.collides[i], 1.0);
      length[i] += -std::log(1.0 - streams[i].Next()) * 0.5;
      directions[i] = SamplePhaseFunction(media[i], directions[i], streams[i]);
      ASSERT_NEAR(lanes.length_mm[i], length[i], 1e-12 * (1 + length[i]));
      const glm::dvec3 d(lanes.dx[i], lanes.dy[i], lanes.dz[i]);
      ASSERT_NEAR(glm::length(d), 1.0, 1e-14);
      ASSERT_LT(glm::distance(d, directions[i]), 1e-11) << "lane " << i << ", step " << step;
      directions[i] = d;  // so that differences do not grow
      ASSERT_EQ(lanes.random[i], streams[i].state());
    }
  }
}

TEST(Path, StatedErrorsMatchTheScatterOfThirtySeeds) {
  // Scatter of every pixel over 30 seeds against the variance it states, for shared paths and for groups of three
  // heroes.
  for (const bool alike : {true, false}) {
    KnownScene scene = Bead();
    scene.source.meshes[1] = Sphere(1.1, 12);
    if (!alike) scene.capture.layers[1][Quantity::kReducedScattering].value = {2, 6, 9};
    const LayeredBody body = BodyOf(scene);
    const Material material = StatedMaterial(scene.capture);
    constexpr int kSeeds = 30;
    std::vector<PathPhotograph> photos;
    for (int seed = 1; seed <= kSeeds; ++seed)
      photos.push_back(RenderByPaths(scene.capture, body, {}, material, 0, {90, uint64_t(seed), 0, 0}, [](double) {}));
    double ratios = 0, count = 0;
    for (size_t p = 0; p < photos[0].pixels.size(); ++p)
      for (int c = 0; c < 3; ++c) {
        double sum = 0, square = 0, stated = 0;
        for (const auto& photo : photos) {
          const double v = photo.pixels[p].mean[c];
          sum += v, square += v * v, stated += photo.pixels[p].variance()[c] / kSeeds;
        }
        if (!photos[0].pixels[p].on_object) continue;
        ratios += (square - sum * sum / kSeeds) / (kSeeds - 1) / stated;
        ++count;
      }
    const double ratio = std::sqrt(ratios / count);
    EXPECT_GT(ratio, 0.8) << (alike ? "alike" : "heroes");
    EXPECT_LT(ratio, 1.25) << (alike ? "alike" : "heroes");
    std::printf("scatter over stated error, %s: %.3f\n", alike ? "shared paths" : "three heroes", ratio);
  }
}

TEST(Path, SpectralMisAgreesWithSingleChannels) {
  // Spectral multiple importance sampling against grey runs, for coefficients as far apart as 2, 6 and 9.
  const double s[3] = {2, 6, 9};
  KnownScene together = Bead();
  for (int c = 0; c < 3; ++c) {
    together.capture.layers[0][Quantity::kReducedScattering].value[c] = s[c];
    together.capture.layers[1][Quantity::kReducedScattering].value[c] = s[2 - c];
  }
  const LayeredBody body = BodyOf(together);
  const auto render = [&](const KnownScene& scene, int paths) {
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {paths, 3, 0, 0}, [](double) {});
  };
  const PathPhotograph all = render(together, 6000);
  for (int c = 0; c < 3; ++c) {
    KnownScene alone = together;
    alone.capture.layers[0][Quantity::kReducedScattering].value.fill(s[c]);
    alone.capture.layers[1][Quantity::kReducedScattering].value.fill(s[2 - c]);
    const PathPhotograph one = render(alone, 3000);
    double difference = 0, variance = 0;
    for (size_t p = 0; p < all.pixels.size(); ++p) {
      difference += all.pixels[p].mean[c] - one.pixels[p].mean[c];
      variance += all.pixels[p].variance()[c] + one.pixels[p].variance()[c];
    }
    EXPECT_LT(std::abs(difference), 4 * std::sqrt(variance)) << c;
  }
}

TEST(Path, IsReciprocalInLampAndCamera) {
  // Reciprocity: a small bright disk at A seen from B gives the same as one at B seen from A, when both subtend the
  // same few degrees and the "camera" is the mean over a picture that sees the whole body.
  const auto look = [](const glm::dvec3& lamp, bool swap, uint64_t seed) {
    KnownScene scene = Bead();
    scene.capture.lights.clear();
    scene.capture.photographs[0].lights.clear();
    SetSurface(scene, 0.4, 0.0);
    if (swap) LookAtOriginFrom(lamp, scene);
    const glm::dvec3 place = swap ? glm::dvec3(0, 0, 250) : lamp;
    scene.Light(DiskLight{place, -glm::normalize(place), glm::dvec3(100.0), 0.0, 12.0});
    const LayeredBody body = BodyOf(scene);
    const PathPhotograph photo =
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {3000, seed, 0, 0}, [](double) {});
    Mean mean;
    double variance = 0;
    for (const PixelEstimate& p : photo.pixels) mean.Add(p.mean[1]), variance += p.covariance[3];
    mean.stated = std::sqrt(variance) / mean.n;
    return mean;
  };
  const glm::dvec3 lamp = 250.0 * Towards(1.1, 0.7);
  const Mean there = look(lamp, false, 1), back = look(lamp, true, 2);
  EXPECT_NEAR(there.value(), back.value(), 4 * std::hypot(there.stated, back.stated) + 2e-3 * there.value());
}

}  // namespace
}  // namespace crownfit

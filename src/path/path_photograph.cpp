#include "path/path_photograph.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "base/parallel.h"
#include "capture/capture.h"
#include "path/light_field.h"
#include "path/noise_of_rays.h"
#include "path/path_context.h"
#include "path/uncollided_light.h"
#include "path/walk_pool.h"

namespace crownfit {
namespace {

struct GroupSums {
  LayerDerivatives derivatives;
  LayerControls controls;
  void Add(const LayerDerivatives& s, const LayerControls& c) {
    derivatives.scattering += s.scattering, derivatives.absorption += s.absorption,
        derivatives.asymmetry += s.asymmetry;
    controls.scattering += c.scattering, controls.asymmetry += c.asymmetry;
  }
  /// Sets the means. Values are pi x radiance; so are their derivatives.
  void Write(double paths, size_t at, GroupDerivatives& to) const {
    const double pi = std::numbers::pi / paths, one = 1.0 / paths;
    to.scattering.Set(at, pi * derivatives.scattering);
    to.absorption.Set(at, pi * derivatives.absorption);
    to.asymmetry.Set(at, pi * derivatives.asymmetry);
    to.scattering_control.Set(at, one * controls.scattering);
    to.asymmetry_control.Set(at, one * controls.asymmetry);
  }
};

/// Calls visit(rank, neighbour) for the neighbours of every pixel that are on the object like it, or off it like it;
/// then done(rank, neighbours). The reach grows where there are few.
template <class Visit, class Done>
void ForNeighbours(const PathPhotograph& photo, int reach, const Visit& visit, const Done& done) {
  constexpr int kFewest = 4;
  const int furthest = std::max(photo.width, photo.height);
  for (size_t here = 0; here < photo.pixels.size(); ++here) {
    const int x = static_cast<int>(photo.rendered[here] % photo.width),
              y = static_cast<int>(photo.rendered[here] / photo.width);
    std::vector<size_t> neighbours;
    const bool is_on = photo.pixels[here].on_object;
    for (int r = reach; neighbours.size() < kFewest && r < furthest; r *= 2) {
      neighbours.clear();
      for (int v = std::max(0, y - r); v <= std::min(photo.height - 1, y + r); ++v)
        for (int u = std::max(0, x - r); u <= std::min(photo.width - 1, x + r); ++u) {
          const uint32_t near = photo.RankOf(static_cast<size_t>(v) * photo.width + u);
          if (near == PathPhotograph::kNotRendered || near == here || photo.pixels[near].on_object != is_on) continue;
          neighbours.push_back(near);
        }
      if (!is_on) break;
    }
    for (const size_t near : neighbours) visit(here, photo.pixels[near]);
    done(here, static_cast<double>(neighbours.size()));
  }
}

}  // namespace

std::vector<ChannelCovariance> SmoothedCovariance(const PathPhotograph& photo) {
  constexpr int kReach = 5;
  std::vector<ChannelCovariance> smooth;
  for (const PixelEstimate& e : photo.pixels) smooth.emplace_back(e.covariance.size(), 0.0);
  ForNeighbours(
      photo, kReach,
      [&](size_t here, const PixelEstimate& near) {
        for (size_t k = 0; k < near.covariance.size(); ++k) smooth[here][k] += near.covariance[k];
      },
      [&](size_t here, double count) {
        for (size_t k = 0; k < smooth[here].size(); ++k)
          smooth[here][k] = count > 0 ? smooth[here][k] / count : photo.pixels[here].covariance[k];
      });
  return smooth;
}

std::vector<Spectrum> SmoothedMeans(const PathPhotograph& photo) {
  constexpr int kReach = 2;
  std::vector<Spectrum> smooth(photo.pixels.size());
  ForNeighbours(
      photo, kReach, [&](size_t here, const PixelEstimate& near) { smooth[here] += near.mean; },
      [&](size_t here, double count) { smooth[here] = count > 0 ? smooth[here] / count : photo.pixels[here].mean; });
  return smooth;
}

namespace {

/// Results of the paths of some pixels: samples of a pixel have one path per hero channel, and each path serves all
/// photographs.
class FoundByPaths {
 public:
  FoundByPaths(size_t pixels, size_t samples, size_t heroes, size_t photographs, size_t layers_with_derivatives,
               size_t channels_by_rays)
      : samples_(samples),
        heroes_(heroes),
        photographs_(photographs),
        layers_(layers_with_derivatives),
        channels_by_rays_(channels_by_rays),
        values_(pixels * samples * heroes * photographs),
        by_rays_(values_.size() * channels_by_rays),
        derivatives_(values_.size() * layers_),
        controls_(derivatives_.size()) {}

  void Keep(size_t path, const CameraPath& ended) {
    for (size_t p = 0; p < photographs_; ++p) {
      values_[path * photographs_ + p] = ended.value(p);
      const auto by_rays = ended.by_rays(p);
      std::copy(by_rays.begin(), by_rays.end(), by_rays_.begin() + (path * photographs_ + p) * channels_by_rays_);
    }
    if (layers_ == 0) return;
    const size_t first = path * photographs_ * layers_;
    std::copy(ended.derivatives().derivatives().begin(), ended.derivatives().derivatives().end(), &derivatives_[first]);
    std::copy(ended.derivatives().controls().begin(), ended.derivatives().controls().end(), &controls_[first]);
  }

  /// Writes the sums of the pixel's paths to `rank` of the picture.
  void Write(size_t pixel, size_t photograph, size_t rank, PathPhotograph& picture) const {
    const size_t groups = std::min(samples_, PathPhotograph::kMaxGroups);
    const auto place = [&](size_t sample, size_t hero) {
      return ((pixel * samples_ + sample) * heroes_ + hero) * photographs_ + photograph;
    };
    PixelSum sum(picture.group_values.channels());
    std::array<Spectrum, PathPhotograph::kMaxGroups> group_mean{};
    for (size_t s = 0; s < samples_; ++s) {
      Spectrum value;
      for (size_t hero = 0; hero < heroes_; ++hero) value += values_[place(s, hero)];
      value /= static_cast<double>(heroes_);
      sum.Add(value);
      const size_t in_group = (samples_ - s % groups + groups - 1) / groups;
      group_mean[s % groups] += value / static_cast<double>(in_group);
    }
    picture.pixels[rank] = sum.Estimate(static_cast<int>(samples_));
    if (channels_by_rays_ > 0) IncludeNoiseOfRays(place(0, 0), groups, picture.pixels[rank], group_mean.data());
    for (size_t g = 0; g < picture.groups; ++g) picture.group_values.Set(rank * groups + g, group_mean[g]);
    for (size_t g = 0; g < groups; ++g)
      for (size_t l = 0; l < layers_; ++l) {
        GroupSums group;
        size_t paths = 0;
        for (size_t s = g; s < samples_; s += groups)
          for (size_t hero = 0; hero < heroes_; ++hero, ++paths)
            group.Add(derivatives_[place(s, hero) * layers_ + l], controls_[place(s, hero) * layers_ + l]);
        group.Write(static_cast<double>(paths), (rank * groups + g) * layers_ + l, picture.derivatives);
      }
  }

 private:
  /// All paths see the same rays of uncollided light; their noise enters.
  void IncludeNoiseOfRays(size_t first, size_t groups, PixelEstimate& estimate, Spectrum* group_means) const {
    NoiseOfRays noise(static_cast<int>(channels_by_rays_));
    std::vector<NoiseOfRays::OfGroups> of_sample(channels_by_rays_);
    const double scale = std::numbers::pi * UncollidedLight::kGroups / static_cast<double>(heroes_);
    for (size_t s = 0; s < samples_; ++s) {
      for (size_t c = 0; c < channels_by_rays_; ++c) {
        of_sample[c] = {};
        for (size_t hero = 0; hero < heroes_; ++hero) {
          const auto& found = by_rays_[(first + (s * heroes_ + hero) * photographs_) * channels_by_rays_ + c];
          for (size_t j = 0; j < found.size(); ++j) of_sample[c][j] += scale * static_cast<double>(found[j]);
        }
      }
      noise.Add(of_sample);
    }
    estimate.covariance = noise.Include(estimate, groups, group_means);
  }

  size_t samples_, heroes_, photographs_, layers_;
  size_t channels_by_rays_;       ///< 0: walks see no uncollided light
  std::vector<Spectrum> values_;  ///< index ((pixel * samples + sample) * heroes + hero) * photographs + photograph
  std::vector<UncollidedLight::OfGroups> by_rays_;  ///< index of the value * channels + channel
  std::vector<LayerDerivatives> derivatives_;       ///< index of the value * layers + layer; none without derivatives
  std::vector<LayerControls> controls_;
};

/// A picture with storage for the requested output.
PathPhotograph EmptyPicture(const Camera& camera, const PathOptions& options, int channels, size_t layers,
                            size_t groups) {
  PathPhotograph result;
  result.width = camera.width;
  result.height = camera.height;
  std::vector<uint32_t> ranks(static_cast<size_t>(result.width) * result.height, PathPhotograph::kNotRendered);
  for (size_t place = 0; place < ranks.size(); ++place)
    if (options.wanted.empty() || options.wanted[place]) {
      ranks[place] = static_cast<uint32_t>(result.rendered.size());
      result.rendered.push_back(place);
    }
  result.ranks = std::make_shared<const std::vector<uint32_t>>(std::move(ranks));
  result.pixels.resize(result.rendered.size());
  result.layers = layers;
  result.estimator = options.estimator;
  result.groups = options.derivatives || options.keeps_groups ? groups : 0;
  result.group_values.resize(result.rendered.size() * result.groups, channels);
  GroupDerivatives& d = result.derivatives;
  for (SpectrumArray<>* part :
       {&d.scattering, &d.absorption, &d.asymmetry, &d.scattering_control, &d.asymmetry_control})
    part->resize(options.derivatives ? result.group_values.size() * layers : 0, channels);
  return result;
}

/// With rays for so many paths a pixel. Variance x time is least, on the bundled photographs, with about three tenths
/// as many rays as paths.
std::optional<UncollidedLight> UncollidedLightOf(const PathContext& context, const Media& media,
                                                 const LayeredBody& body, const PathOptions& options, uint64_t seed,
                                                 size_t pixels, size_t paths) {
  constexpr double kOfPaths = 0.3, kFewest = 2e4, kMost = 2e6;
  if (std::none_of(context.lamps.begin(), context.lamps.end(), [](const Lamp& lamp) { return lamp.is_followed; }))
    return std::nullopt;
  UncollidedOptions of_light = options.uncollided;
  if (of_light.rays == 0)
    of_light.rays = static_cast<int>(std::clamp(kOfPaths * static_cast<double>(pixels * paths), kFewest, kMost));
  return std::make_optional<UncollidedLight>(context, media, body, of_light, seed, options.threads);
}

}  // namespace

std::vector<std::vector<size_t>> WhichShareWalks(const Capture& capture, const std::vector<size_t>& photographs) {
  std::vector<std::vector<size_t>> groups;
  for (size_t k = 0; k < photographs.size(); ++k) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const std::vector<size_t>& g) {
      return g.size() < kMaxPhotographs && CanShareWalks(capture, photographs[g[0]], photographs[k]);
    });
    if (group == groups.end())
      groups.push_back({k});
    else
      group->push_back(k);
  }
  return groups;
}

PathPhotograph RenderByPaths(const Capture& capture, const LayeredBody& body, const std::vector<TriangleMesh>& scenery,
                             const Material& material, size_t photograph, const PathOptions& options,
                             const std::function<void(double)>& progress) {
  return std::move(RenderTogether(capture, body, scenery, material, {photograph}, options, progress).front());
}

std::vector<PathPhotograph> RenderTogether(const Capture& capture, const LayeredBody& body,
                                           const std::vector<TriangleMesh>& scenery, const Material& material,
                                           const std::vector<size_t>& photographs, const PathOptions& options,
                                           const std::function<void(double)>& progress) {
  Check(!photographs.empty() && photographs.size() <= kMaxPhotographs, "photographs of one camera");
  for (const size_t i : photographs) Check(CanShareWalks(capture, photographs[0], i), "photographs of one camera");
  Check(options.lanes > 0 || !options.derivatives, "derivatives need lanes");
  const PhotographSpec& first = capture.photographs[photographs[0]];
  const RigidTransform object_from_camera = first.camera_from_object.Inverse();
  const auto ray_through = [&](double x, double y) {
    return object_from_camera.Direction(DirectionFromPixel(first.camera, {x, y}));
  };
  const Surroundings around(capture, scenery, photographs);
  const WalkScene scene(body, around.meshes);
  const Media media = MediaOf(capture, material, body);
  PathContext context = PathContextOf(capture, material, photographs, options, {scene, media, around.things});
  std::optional<LightFields> fields;
  if (options.lattice) {
    fields.emplace(context, *options.lattice, Lighting{.collisions = options.collisions, .rays = options.rays},
                   Key(options.seed, options.field), options.threads);
    context.hand_over = {options.collisions, &*fields};
  }
  const size_t heroes = media.heroes(), shared = photographs.size(), layers = material.layers.size(),
               samples = std::max<size_t>(1, (options.paths_per_pixel + heroes - 1) / heroes),
               groups = std::min(samples, PathPhotograph::kMaxGroups);
  std::vector<PathPhotograph> results(shared, EmptyPicture(first.camera, options, capture.channels(), layers, groups));
  const std::vector<size_t>& wanted = results[0].rendered;
  const Media reduced = Reduced(media);
  const auto light_in = [&](const Media& of, uint64_t which) {
    return UncollidedLightOf(context, of, body, options, Key(options.seed, options.stream, photographs[0], which),
                             wanted.size(), samples * heroes);
  };
  const auto uncollided = light_in(media, 0);
  const auto by_reduced = uncollided && fields ? light_in(reduced, 1) : std::nullopt;
  if (uncollided && uncollided->is_resolved() && !(by_reduced && !by_reduced->is_resolved())) {
    context.uncollided = &*uncollided;
    if (by_reduced) context.uncollided_by_reduced = &*by_reduced;
  } else if (uncollided) {
    for (Lamp& lamp : context.lamps) lamp.is_followed = false;
    for (PathPhotograph& picture : results) picture.estimator = Estimator::kExits;
  }
  constexpr size_t kAtOnce = 4096;  // path values per batch
  const size_t pixels_at_once = std::max<size_t>(1, kAtOnce / (samples * heroes * shared)),
               chunks = (wanted.size() + pixels_at_once - 1) / pixels_at_once;
  std::vector<WalkCounters> counters(chunks);
  const auto render = [&](size_t chunk) {
    const size_t begin = chunk * pixels_at_once, count = std::min(pixels_at_once, wanted.size() - begin),
                 tasks = count * samples * heroes;
    const auto start = [&](size_t task) {
      const size_t pixel = wanted[begin + task / (samples * heroes)], s = task / heroes % samples, hero = task % heroes,
                   row = pixel / first.camera.width;
      RandomStream random(Key(options.seed, 0x70617468ull, options.stream, photographs[0], pixel, s, hero));
      const double x = static_cast<double>(pixel % first.camera.width) + random.Next(),
                   y = static_cast<double>(row) + random.Next();
      return PathStart{object_from_camera.translation_mm, ray_through(x, y), static_cast<int>(hero), random};
    };
    FoundByPaths found(count, samples, heroes, shared, options.derivatives ? layers : 0,
                       context.uncollided ? static_cast<size_t>(capture.channels()) : 0);
    TracePaths(
        context, body.grid, tasks, options.lanes, start,
        [&](size_t task, const CameraPath& path) { found.Keep(task, path); }, counters[chunk]);
    for (size_t k = 0; k < count; ++k) {
      const size_t rank = begin + k, row = wanted[rank] / first.camera.width;
      const glm::dvec3 centre =
          ray_through(static_cast<double>(wanted[rank] % first.camera.width) + 0.5, static_cast<double>(row) + 0.5);
      for (size_t p = 0; p < shared; ++p) {
        found.Write(k, p, rank, results[p]);
        const auto seen = scene.Next(object_from_camera.translation_mm, centre, kOutside, kFar, nullptr,
                                     [&](int t) { return (around.things[t].photographs >> p & 1) != 0; });
        results[p].pixels[rank].on_object = seen && seen->opaque < 0;
      }
    }
  };
  const size_t chunks_at_once = std::max(16u, 4 * std::thread::hardware_concurrency());
  for (size_t begin = 0; begin < chunks; begin += chunks_at_once) {
    const size_t some = std::min(chunks_at_once, chunks - begin);
    ParallelFor(some, options.threads, [&](size_t i) { render(begin + i); });
    progress(static_cast<double>(begin + some) / static_cast<double>(chunks));
  }
  for (const auto& c : counters) results[0].counters.Add(c);
  return results;
}

}  // namespace crownfit

#include "walk/path_photograph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <thread>

#include "base/error.h"
#include "base/parallel.h"
#include "optics/fresnel_moments.h"
#include "optics/media.h"
#include "walk/walk_pool.h"

namespace crownfit {
namespace {

/// Sums of independent samples.
struct PixelSum {
  glm::dvec3 sum{0.0};
  std::array<double, 6> square{};
  void Add(const glm::dvec3& x) {
    sum += x;
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) square[k++] += x[a] * x[b];
  }
  PixelEstimate Estimate(int samples) const {
    PixelEstimate e;
    const double n = samples;
    e.mean = sum / n;
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b, ++k)
        e.covariance[k] = samples > 1 ? (square[k] / n - e.mean[a] * e.mean[b]) / (n - 1.0) : 0.0;
    for (const int own : {0, 3, 5})
      e.covariance[own] = std::max(0.0, e.covariance[own]);  // of paths that are all alike
    return e;
  }
};

struct GroupSums {
  LayerSlopes slopes;
  LayerControls controls;
  void Add(const LayerSlopes& s, const LayerControls& c) {
    slopes.scattering += s.scattering, slopes.absorption += s.absorption, slopes.asymmetry += s.asymmetry;
    controls.scattering += c.scattering, controls.asymmetry += c.asymmetry;
  }
  /// Values are pi x radiance; so are their slopes.
  GroupSlopes Mean(double paths) const {
    const double pi = std::numbers::pi / paths, one = 1.0 / paths;
    return {glm::vec3(pi * slopes.scattering), glm::vec3(pi * slopes.absorption), glm::vec3(pi * slopes.asymmetry),
            glm::vec3(one * controls.scattering), glm::vec3(one * controls.asymmetry)};
  }
};

/// d ln HalfSpaceReflectance of the layer by ln scattering and ln absorption.
CutSlopes SlopesOfHalfSpace(const Material::Layer& layer) {
  const auto slope = [&](Quantity q) {
    constexpr double kStep = 1e-4;
    Material::Layer up = layer, down = layer;
    for (int c = 0; c < kChannels; ++c) up[q][c] *= std::exp(kStep), down[q][c] *= std::exp(-kStep);
    const glm::dvec3 high = HalfSpaceReflectance(up), low = HalfSpaceReflectance(down);
    glm::dvec3 d(0.0);
    for (int c = 0; c < kChannels; ++c)
      if (low[c] > 0) d[c] = std::log(high[c] / low[c]) / (2.0 * kStep);
    return d;
  };
  return {slope(Quantity::kReducedScattering), slope(Quantity::kAbsorption)};
}

}  // namespace

glm::dvec3 HalfSpaceReflectance(const Material::Layer& layer) {
  glm::dvec3 reflectance(0.0);
  for (int c = 0; c < kChannels; ++c)
    reflectance[c] = HalfSpaceReflectance(layer[Quantity::kReducedScattering][c], layer[Quantity::kAbsorption][c]);
  return reflectance;
}

namespace {

/// Calls visit(rank, neighbour) for the pixels around every pixel that are on the object like it, or off it like it;
/// then done(rank, neighbours). Further away where there are few.
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

std::vector<std::array<double, 6>> SmoothedCovariance(const PathPhotograph& photo) {
  constexpr int kReach = 5;
  std::vector<std::array<double, 6>> smooth(photo.pixels.size());
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

std::vector<glm::dvec3> SmoothedMeans(const PathPhotograph& photo) {
  constexpr int kReach = 2;
  std::vector<glm::dvec3> smooth(photo.pixels.size(), glm::dvec3(0.0));
  ForNeighbours(
      photo, kReach, [&](size_t here, const PixelEstimate& near) { smooth[here] += near.mean; },
      [&](size_t here, double count) { smooth[here] = count > 0 ? smooth[here] / count : photo.pixels[here].mean; });
  return smooth;
}

Media MediaOf(const Capture& capture, const Material& material, const LayeredBody& body) {
  std::vector<Medium> media(1);
  media[0].ior = capture.outside_ior;
  for (size_t l = 0; l < material.layers.size(); ++l) {
    const Material::Layer& layer = material.layers[l];
    Medium m;
    m.texture = body.absorption[l].get();
    m.ior = layer[Quantity::kIor][0];
    m.g = layer[Quantity::kAsymmetry][0];
    m.isotropic_fraction = layer[Quantity::kIsotropicFraction][0];
    for (int c = 0; c < kChannels; ++c) {
      m.scattering[c] = TrueScattering(layer[Quantity::kReducedScattering][c], m.g, m.isotropic_fraction);
      m.absorption[c] = layer[Quantity::kAbsorption][c];
    }
    media.push_back(m);
  }
  return Media(std::move(media));
}

namespace {

/// The tile that touches the object, if there is one.
std::optional<size_t> ContactBackingOf(const Capture& capture, size_t photograph) {
  const std::optional<size_t> backing = capture.photographs[photograph].backing;
  return backing && capture.backings[*backing].in_contact ? backing : std::nullopt;
}

/// The opaque things of some photographs, each once.
struct Things {
  std::vector<TriangleMesh> meshes;
  std::vector<OpaqueThing> things;

  Things(const Capture& capture, const std::vector<TriangleMesh>& scenery, const std::vector<size_t>& photographs) {
    std::map<std::pair<bool, size_t>, size_t> index;  // of a backing or of scenery
    const auto add = [&](bool is_backing, size_t i, size_t photograph, const auto& mesh, const glm::dvec3& rho) {
      const auto [at, is_new] = index.try_emplace({is_backing, i}, things.size());
      if (is_new) meshes.push_back(mesh()), things.push_back({rho, 0});
      things[at->second].photographs |= PhotographSet{1} << photograph;
    };
    for (size_t k = 0; k < photographs.size(); ++k) {
      const PhotographSpec& photo = capture.photographs[photographs[k]];
      for (const size_t i : photo.scenery)
        add(
            false, i, k, [&] { return scenery[i]; }, capture.scenery[i].reflectance);
      if (!photo.backing) continue;
      const BackingSpec& tile = capture.backings[*photo.backing];
      add(
          true, *photo.backing, k, [&] { return SquareTile(tile.point_mm, tile.normal, tile.size_mm); },
          tile.reflectance);
    }
  }
};

/// The scene and its media with boundaries, cut, tile in contact and lamps.
Studio StudioOf(const Capture& capture, const Material& material, const std::vector<size_t>& photographs,
                const PathOptions& options, Studio studio) {
  const PhotographSpec& first = capture.photographs[photographs[0]];
  for (const size_t i : photographs)
    studio.specular_factor.push_back(SpecularFactor(capture.photographs[i].polarisation));
  studio.wants_slopes = options.slopes;
  studio.has_diffuse_exits = options.diffuse_exits;
  for (size_t i = 0; i < studio.media.size(); ++i) {
    const OuterBoundary outer{material.surface[Quantity::kRoughness][0], material.surface[Quantity::kWetness][0],
                              studio.media[static_cast<int>(i)].ior, capture.outside_ior};
    const double relative_ior = std::max(1.0, outer.inside_ior / outer.outside_ior);
    studio.outer.push_back(outer);
    studio.exit_scale.push_back(1.0 / (std::numbers::pi * (1.0 - MomentsOf(relative_ior).diffuse_outside)));
  }
  studio.cut_is_opaque = capture.neck != Neck::kAir;
  if (capture.neck == Neck::kRoot) {
    const Material::Layer& root = material.layers.back();
    studio.cut_reflectance = glm::min(material.surface[Quantity::kNeckReturn][0] * HalfSpaceReflectance(root), 1.0);
    const glm::dvec3 unclamped(glm::lessThan(studio.cut_reflectance, glm::dvec3(1.0)));
    const CutSlopes slopes = SlopesOfHalfSpace(root);
    studio.cut_slopes = {unclamped * slopes.scattering, unclamped * slopes.absorption};
  }
  if (const auto contact = ContactBackingOf(capture, photographs[0]))
    studio.contact.emplace(capture.backings[*contact]);
  size_t sampled = 0;
  std::map<size_t, size_t> lamp_of_light;
  for (size_t k = 0; k < photographs.size(); ++k)
    for (const size_t i : capture.photographs[photographs[k]].lights) {
      const Light& light = capture.lights[i];
      if (const auto [at, is_new] = lamp_of_light.try_emplace(i, studio.lamps.size()); is_new) {
        const bool is_sampled =
            options.lamps_are_sampled && !std::holds_alternative<DomeLight>(light.shape) && sampled++ < kMaxLamps;
        studio.lamps.push_back(
            {light.in_camera_frame ? Transformed(light.shape, first.camera_from_object.Inverse()) : light.shape,
             light.intensity_scale, is_sampled, 0});
      }
      studio.lamps[lamp_of_light[i]].photographs |= PhotographSet{1} << k;
    }
  return studio;
}

/// A picture with room for what is asked.
PathPhotograph EmptyPicture(const Camera& camera, const PathOptions& options, size_t layers, size_t groups) {
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
  if (options.slopes || options.keeps_groups) {
    result.groups = groups;
    result.group_values.resize(result.rendered.size() * groups);
    result.slopes.resize(options.slopes ? result.group_values.size() * layers : 0);
  }
  return result;
}

bool CanShareWalks(const Capture& capture, size_t a, size_t b) {
  const PhotographSpec &first = capture.photographs[a], &second = capture.photographs[b];
  return first.camera == second.camera && first.camera_from_object == second.camera_from_object &&
         ContactBackingOf(capture, a) == ContactBackingOf(capture, b);
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
  Check(options.lanes > 0 || !options.slopes, "derivatives need lanes");
  const PhotographSpec& first = capture.photographs[photographs[0]];
  const RigidTransform object_from_camera = first.camera_from_object.Inverse();
  const auto ray_through = [&](double x, double y) {
    return object_from_camera.Direction(DirectionFromPixel(first.camera, {x, y}));
  };
  const Things things(capture, scenery, photographs);
  const WalkScene scene(body, things.meshes);
  const Media media = MediaOf(capture, material, body);
  const Studio studio = StudioOf(capture, material, photographs, options, {scene, media, things.things});

  const size_t heroes = media.heroes(), shared = photographs.size(), layers = material.layers.size(),
               samples = std::max<size_t>(1, (options.paths_per_pixel + heroes - 1) / heroes),
               groups = std::min(samples, PathPhotograph::kMaxGroups);
  std::vector<PathPhotograph> results(shared, EmptyPicture(first.camera, options, layers, groups));
  const std::vector<size_t>& wanted = results[0].rendered;
  constexpr size_t kAtOnce = 4096;  // values of paths
  const size_t pixels_at_once = std::max<size_t>(1, kAtOnce / (samples * heroes * shared)),
               chunks = (wanted.size() + pixels_at_once - 1) / pixels_at_once;
  std::vector<WalkCounters> counters(chunks);
  const auto render = [&](size_t chunk) {
    const size_t begin = chunk * pixels_at_once, count = std::min(pixels_at_once, wanted.size() - begin);
    const auto start = [&](size_t task) {
      const size_t pixel = wanted[begin + task / (samples * heroes)], s = task / heroes % samples, hero = task % heroes;
      RandomStream random(Key(options.seed, 0x70617468ull, options.stream, photographs[0], pixel, s, hero));
      const double x = static_cast<double>(pixel % first.camera.width) + random.Next(),
                   y = static_cast<double>(pixel / first.camera.width) + random.Next();
      return PathStart{object_from_camera.translation_mm, ray_through(x, y), static_cast<int>(hero), random};
    };
    const size_t tasks = count * samples * heroes;
    std::vector<glm::dvec3> values(tasks * shared);  // index task * shared + photograph
    std::vector<LayerSlopes> slopes(options.slopes ? values.size() * layers : 0);
    std::vector<LayerControls> controls(slopes.size());
    const auto keep = [&](size_t task, const CameraPath& path) {
      for (size_t p = 0; p < shared; ++p) values[task * shared + p] = path.value(p);
      if (!options.slopes) return;
      std::copy(path.slopes().slopes().begin(), path.slopes().slopes().end(), &slopes[task * shared * layers]);
      std::copy(path.slopes().controls().begin(), path.slopes().controls().end(), &controls[task * shared * layers]);
    };
    TracePaths(studio, body.grid, tasks, options.lanes, start, keep, counters[chunk]);
    for (size_t k = 0; k < count; ++k)
      for (size_t p = 0; p < shared; ++p) {
        PathPhotograph& result = results[p];
        const auto value_at = [&](size_t s, size_t hero) { return ((k * samples + s) * heroes + hero) * shared + p; };
        PixelSum sum;
        std::array<glm::dvec3, PathPhotograph::kMaxGroups> group_sum{};
        for (size_t s = 0; s < samples; ++s) {
          glm::dvec3 value(0.0);
          for (size_t hero = 0; hero < heroes; ++hero) value += values[value_at(s, hero)];
          value /= static_cast<double>(heroes);
          sum.Add(value);
          group_sum[s % groups] += value;
        }
        const size_t rank = begin + k;
        for (size_t g = 0; g < result.groups; ++g)
          result.group_values[rank * groups + g] =
              glm::vec3(group_sum[g] / static_cast<double>((samples - g + groups - 1) / groups));
        for (size_t g = 0; options.slopes && g < groups; ++g)
          for (size_t l = 0; l < layers; ++l) {
            GroupSums group;
            size_t paths = 0;
            for (size_t s = g; s < samples; s += groups)
              for (size_t hero = 0; hero < heroes; ++hero, ++paths)
                group.Add(slopes[value_at(s, hero) * layers + l], controls[value_at(s, hero) * layers + l]);
            result.slopes[(rank * groups + g) * layers + l] = group.Mean(static_cast<double>(paths));
          }
        PixelEstimate& pixel = result.pixels[rank];
        pixel = sum.Estimate(static_cast<int>(samples));
        const glm::dvec3 centre = ray_through(static_cast<double>(wanted[rank] % result.width) + 0.5,
                                              static_cast<double>(wanted[rank] / result.width) + 0.5);
        const auto seen = scene.Next(object_from_camera.translation_mm, centre, kOutside, kFar, nullptr,
                                     [&](int t) { return (things.things[t].photographs >> p & 1) != 0; });
        pixel.on_object = seen && seen->opaque < 0;
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

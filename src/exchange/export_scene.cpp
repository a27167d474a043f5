#include "exchange/export_scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "capture/capture.h"
#include "optics/media.h"
#include "scene/light_samples.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;
// Distance of lamps at infinity: parallax 2e-4 rad over a crown. Disks of up to 60 degrees stay within
// kFarthestPlace_mm.
constexpr double kFar_mm = 5e4;
constexpr double kLeastRadius_rad = 1e-4;

/// A polygonal ring or disk with the same area as the round one.
TriangleMesh RingMesh(const glm::dvec3& centre, const glm::dvec3& normal, double inner, double outer) {
  constexpr int kCorners = 256;
  const double step = 2 * kPi / kCorners, same_area = std::sqrt(step / std::sin(step));
  const auto [u, v] = Tangents(normal);
  TriangleMesh mesh;
  for (int i = 0; i < kCorners; ++i)
    for (const double radius : {inner, outer})
      mesh.vertices.push_back(centre + same_area * radius * (std::cos(i * step) * u + std::sin(i * step) * v));
  for (int i = 0; i < kCorners; ++i) {
    const int a = 2 * i, b = a + 1, c = 2 * ((i + 1) % kCorners), d = c + 1;
    if (inner > 0) mesh.triangles.emplace_back(a, d, c);
    mesh.triangles.emplace_back(a, b, d);
  }
  return mesh;
}

struct ShapeOf {
  double factor;  ///< from radiance to the exported value
  const std::string& name;

  ExportedLamp operator()(const DirectionalLight& l) const {
    const double radius = std::max(l.angular_radius, kLeastRadius_rad), sine = std::sin(radius);
    return {name, factor * l.irradiance / (kPi * sine * sine),
            RingMesh(kFar_mm * l.direction, -l.direction, 0.0, kFar_mm * std::tan(radius))};
  }
  ExportedLamp operator()(const PointLight& l) const {
    const double radius = std::max(l.radius_mm, kLeastRadius_rad * glm::length(l.position_mm));
    return {name, factor * l.radiant_intensity / (kPi * radius * radius), BallLamp{l.position_mm, radius}};
  }
  ExportedLamp operator()(const DiskLight& l) const {
    return {name, factor * l.radiance, RingMesh(l.centre_mm, l.normal, l.inner_radius_mm, l.outer_radius_mm)};
  }
  ExportedLamp operator()(const RectangleLight& l) const {
    const glm::dvec3 &c = l.centre_mm, &u = l.half_axis_u_mm, &v = l.half_axis_v_mm;
    TriangleMesh mesh;
    mesh.vertices = {c - u - v, c + u - v, c + u + v, c - u + v};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return {name, factor * l.radiance, mesh};
  }
  ExportedLamp operator()(const DomeLight& l) const { return {name, factor * l.radiance, DomeLamp{}}; }
  ExportedLamp operator()(const EnvironmentLight& l) const {
    constexpr int kWidth = 1024, kHeight = 512;
    const Spectrum first = l.scale * l.map->Radiance({0, 0, 1});
    Image picture(kWidth, kHeight, std::max(1, first.size()));
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {  // the centre is along +z, a quarter to its left along +x; +y is up
        const double azimuth = 2 * kPi * (0.5 - (x + 0.5) / kWidth), polar = kPi * (y + 0.5) / kHeight;
        const glm::dvec3 way(std::sin(polar) * std::sin(azimuth), std::cos(polar), std::sin(polar) * std::cos(azimuth));
        const Spectrum radiance = LightAlong(l, glm::dvec3(0.0), way)->radiance;
        for (int c = 0; c < picture.channels; ++c) picture.at(x, y, c) = static_cast<float>(factor * radiance[c]);
      }
    return {name, Spectrum(factor), EnvironmentLamp{std::move(picture)}};
  }
};

/// Largest displacement of the picture's content by the camera's distortion, px.
double LargestDistortion_px(const Camera& camera) {
  Camera pinhole = camera;
  pinhole.distortion = {};
  double largest = 0;
  for (const double x : {0.0, 0.5, 1.0})
    for (const double y : {0.0, 0.5, 1.0}) {
      const glm::dvec2 pixel(x * camera.width, y * camera.height);
      if (const auto undistorted = PixelFromPoint(pinhole, DirectionFromPixel(camera, pixel)))
        largest = std::max(largest, glm::distance(*undistorted, pixel));
    }
  return largest;
}

}  // namespace

void LeaveOutWhatOthersLack(Capture& capture, Material& material, std::vector<std::string>& left_out) {
  const auto say = [&](const std::string& what) {
    if (std::find(left_out.begin(), left_out.end(), what) == left_out.end()) left_out.push_back(what);
  };
  for (LayerSpec& layer : capture.layers)
    if (layer.absorption_texture) {
      say("layer " + layer.name + ": absorption_texture (the exported absorption is even)");
      layer.absorption_texture.reset();
    }
  const double wetness = std::as_const(material.surface)[Quantity::kWetness][0];
  if (wetness > 0) say(Printed("wetness %.3g (the exported surface is dry)", wetness));
  material.surface[Quantity::kWetness].fill(0.0);
  for (BackingSpec& backing : capture.backings)
    if (backing.in_contact) {
      say("backing " + backing.name + ": optical contact (exported with an air gap)");
      backing.in_contact = false;
    }
  for (PhotographSpec& photo : capture.photographs) {
    if (photo.polarisation != Polarisation::kNone)
      say("photograph " + photo.name + ": polarisers (exported without them)");
    photo.polarisation = Polarisation::kNone;
    if (photo.blur) say("photograph " + photo.name + ": blur and veiling glare of the lens");
    photo.blur.reset();
    Camera& camera = photo.camera;
    if (const double off = LargestDistortion_px(camera); off > 1e-6)
      say("photograph " + photo.name + ": distortion of the lens, " + Printed("up to %.2g px", off));
    camera.distortion = {};
    if (camera.fx != camera.fy) {
      const double focal = std::sqrt(camera.fx * camera.fy);
      say("photograph " + photo.name + ": pixels that are not square, " +
          Printed("%.2g %%", 100 * std::abs(camera.fx / camera.fy - 1)));
      camera.fx = camera.fy = focal;
    }
  }
}

ExportScene SceneOfMaterial(const Capture& capture, const MaterialRecord& record) {
  ExportScene scene;
  scene.channel_names = capture.channel_names;
  scene.wavelengths_nm = capture.wavelengths_nm;
  scene.record = record;
  scene.roughness = record.material.surface[Quantity::kRoughness][0];
  scene.outside_ior = capture.outside_ior;
  for (size_t l = 0; l < record.material.layers.size(); ++l) {
    const Material::Layer& from = record.material.layers[l];
    ExportedLayer layer{from.name,
                        from[Quantity::kIor][0],
                        from[Quantity::kAsymmetry][0],
                        from[Quantity::kIsotropicFraction][0],
                        {},
                        {},
                        {}};
    layer.scattering_per_mm = from[Quantity::kReducedScattering].Mapped(
        [&](double reduced) { return TrueScattering(reduced, layer.asymmetry, layer.isotropic_fraction); });
    layer.absorption_per_mm = from[Quantity::kAbsorption];
    if (record.layers[l][static_cast<size_t>(Quantity::kThickness)].is_stated)
      layer.thickness_mm = from[Quantity::kThickness][0];
    scene.layers.push_back(layer);
  }
  return scene;
}

void AddPhotographs(const Capture& capture, const std::vector<TriangleMesh>& scenery, ExportScene& scene) {
  for (const PhotographSpec& photo : capture.photographs) {
    ExportedPhotograph out{photo.name, photo.camera, photo.camera_from_object, {}, {}};
    for (const size_t l : photo.lights) {
      const Light& light = capture.lights[l];
      const LightShape shape =
          light.in_camera_frame ? Transformed(light.shape, photo.camera_from_object.Inverse()) : light.shape;
      out.lamps.push_back(std::visit(ShapeOf{kPi * photo.exposure_scale * light.intensity_scale, light.name}, shape));
    }
    for (const size_t s : photo.scenery)
      out.things.push_back({capture.scenery[s].name, scenery[s], capture.scenery[s].reflectance});
    if (photo.backing) {
      const BackingSpec& tile = capture.backings[*photo.backing];
      out.things.push_back({tile.name, SquareTile(tile.point_mm, tile.normal, tile.size_mm), tile.reflectance});
    }
    scene.photographs.push_back(std::move(out));
  }
}

ExportScene InThreeChannels(ExportScene scene) {
  if (scene.channels() == 3) return scene;
  std::vector<int> chosen;
  std::string names;
  for (const double wanted_nm : {600.0, 540.0, 450.0}) {
    const auto nearest =
        std::ranges::min_element(scene.wavelengths_nm, {}, [&](double nm) { return std::abs(nm - wanted_nm); });
    chosen.push_back(static_cast<int>(nearest - scene.wavelengths_nm.begin()));
    names += (names.empty() ? "" : ", ") + scene.channel_names[static_cast<size_t>(chosen.back())];
  }
  const auto reduce = [&](Spectrum& values) {
    if (values.size() > 0) values = {values[chosen[0]], values[chosen[1]], values[chosen[2]]};
  };
  for (ExportedLayer& layer : scene.layers) reduce(layer.scattering_per_mm), reduce(layer.absorption_per_mm);
  reduce(scene.neck_reflectance);
  for (ExportedPhotograph& photo : scene.photographs) {
    for (ExportedThing& thing : photo.things) reduce(thing.reflectance);
    for (ExportedLamp& lamp : photo.lamps) {
      reduce(lamp.radiance);
      auto* map = std::get_if<EnvironmentLamp>(&lamp.shape);
      if (!map) continue;
      Image rgb(map->radiance.width, map->radiance.height, 3);
      for (size_t p = 0; p < rgb.values.size() / 3; ++p) {
        const Spectrum all = PixelOf(map->radiance, p);
        for (size_t c = 0; c < 3; ++c)
          rgb.values[3 * p + c] = static_cast<float>(all.size() == 1 ? all[0] : all[chosen[c]]);
      }
      map->radiance = std::move(rgb);
    }
  }
  scene.left_out.push_back("channels: the format holds three, and of " + std::to_string(scene.channels()) + " it has " +
                           names + " as red, green and blue");
  std::vector<std::string> channel_names;
  std::vector<double> wavelengths_nm;
  for (const int c : chosen) {
    channel_names.push_back(scene.channel_names[static_cast<size_t>(c)]);
    wavelengths_nm.push_back(scene.wavelengths_nm[static_cast<size_t>(c)]);
  }
  scene.channel_names = channel_names;
  scene.wavelengths_nm = wavelengths_nm;
  return scene;
}

std::vector<std::string> FileNames(const std::vector<std::string>& names, const std::string& taken) {
  std::vector<std::string> files;
  for (std::string name : names) {
    for (char& c : name)
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
    while (name == taken || std::find(files.begin(), files.end(), name) != files.end()) name += '_';
    files.push_back(name);
  }
  return files;
}

}  // namespace crownfit
